#!/usr/bin/env python3
"""What a full bus costs: the station with 60 connectors at nominal rates, on a virtual CAN interface (tools/with-vcan).

Counts the frames, those lost, and, with --garbage-rate, whom a node disturbs that sends random bytes under one identifier.
CPU time is told three ways. "Own work" is the recording of the run, replayed without a bus on this machine: the exact work
of the firmware, and the reading of the log. "By /proc/PID/stat" is what the kernel beneath the interface says: User-Mode
Linux counts by ticks of 10 ms, at which a program that wakes up with the clock is found always or never. "All programs" are
those of this machine that make the bus and use it, with and without the station: the difference is the station with its
system calls, its recording, and what the others do because of it; in User-Mode Linux a system call costs tens of us.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from taperlib.busload import CONNECTORS, FullBus

ROOT = Path(__file__).resolve().parents[1]
DBC = ROOT / "codegen/taper.dbc"
ALONE_S = 30
RETURN_S = 5
TICK = os.sysconf("SC_CLK_TCK")
TROUBLE = {"connector_lost", "bad_frames", "babbling", "bus_off", "send_blocked", "overrun", "port", "gateway_lost"}


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    build = ROOT / "build/host-release"
    parser.add_argument("--seconds", type=float, default=600, help="how long (default 600)")
    parser.add_argument("--garbage-rate", type=float, default=0, help="frames of garbage a second (default none)")
    parser.add_argument("--garbage-id", type=lambda text: int(text, 0), default=0x107,
                        help="their identifier (default 0x107, EVSE_STATUS of connector 7)")
    parser.add_argument("--station-program", type=Path, default=build / "firmware/linux/taper-station")
    parser.add_argument("--ev-program", type=Path, default=build / "host_sim/taper-ev")
    parser.add_argument("--sim-program", type=Path, default=build / "host_sim/taper-sim")
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)  # the part that tools/with-vcan runs
    return parser.parse_args()


# Inside: on the interface


def own_cpu_s(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def mark(name: str) -> None:
    print(f"mark {name}", flush=True)


def run_inside(options: argparse.Namespace) -> None:
    """Everything that needs the interface. Results go to inside.json, marks to stdout."""
    garbage = {"strange_id": options.garbage_id} if options.garbage_rate > 0 else {}
    bus = FullBus(options.station_program, options.ev_program, options.inside, **garbage,
                  options=("--record", str(options.inside / "record.log")))
    try:
        bus.wait_for("session_begun", CONNECTORS)
        before_s, began_s = own_cpu_s(bus.station.pid), time.monotonic()
        mark("with")
        if options.garbage_rate > 0:
            bus.babbling(options.garbage_id, options.garbage_rate, options.seconds).join()
        else:
            time.sleep(options.seconds)
        mark("end")
        stat_percent = 100 * (own_cpu_s(bus.station.pid) - before_s) / (time.monotonic() - began_s)
        time.sleep(RETURN_S if options.garbage_rate > 0 else 0)
        summary = bus.stop_station()
        time.sleep(1)
        mark("without")
        time.sleep(min(ALONE_S, options.seconds))
        mark("end")
    finally:
        bus.stop()
    heard = bus.heard(DBC)
    result = {"stat_percent": stat_percent, "summary": summary, "events": bus.events(), "seconds": heard.seconds,
              "frames": bus.frames, "broken": heard.broken.total()}
    (options.inside / "inside.json").write_text(json.dumps(result))


# Outside: on this machine


def cpu_of_tree_s(root: int) -> dict[int, float]:
    """CPU time of a process and all below it that still run, by process."""
    parents, cpu_s = {}, {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended
        parents[int(path.parent.name)] = int(fields[1])
        cpu_s[int(path.parent.name)] = (int(fields[11]) + int(fields[12])) / TICK
    below = {root}
    while grown := {process for process, parent in parents.items() if parent in below} - below:
        below |= grown
    return {process: cpu_s[process] for process in below if process in cpu_s}


def watch(wrapper: subprocess.Popen) -> dict[str, float]:
    """CPU use of all processes [percent of a core] between the marks, by the name of the first."""
    percent = {}
    name, before_s, began_s = "", {}, 0.0
    for line in wrapper.stdout:
        if not line.startswith("mark "):
            print(line, end="")
            continue
        cpu_s, now_s = cpu_of_tree_s(wrapper.pid), time.monotonic()
        if line.split()[1] == "end":  # one that has ended meanwhile takes its time along
            used_s = sum(used - before_s.get(process, 0.0) for process, used in cpu_s.items())
            percent[name] = 100 * used_s / (now_s - began_s)
        name, before_s, began_s = line.split()[1], cpu_s, now_s
    return percent


def replay_percent(options: argparse.Namespace, folder: Path, seconds: float) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([options.sim_program, "--station", "depot", "--replay-log", folder / "record.log"], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return 100 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / seconds


def report(options: argparse.Namespace, result: dict, together: dict[str, float], replayed: float) -> bool:
    """Print it. Whether no frame was lost, and nobody but the garbage's node was disturbed."""
    summary = {name: int(value) for name, value in result["summary"].items() if value.isdigit()}
    babbler = options.garbage_id & 63 if options.garbage_rate > 0 else 0
    disturbed = sorted({(event, node) for event, node in result["events"] if event in TROUBLE and node != babbler})
    own = sorted({event for event, node in result["events"] if babbler and node == babbler and event != "session_begun"})
    received, sent = summary["frames_received"], summary["frames_sent"]
    missing = result["frames"] - received - sent
    print(f"{result['seconds']:.0f} s; frames a second: {received / result['seconds']:.0f} to the station, "
          f"{sent / result['seconds']:.0f} from it")
    print(f"frames: on the interface {result['frames']}, taken by the station {received}, sent by it {sent}, "
          f"missing {missing}")
    print(f"lost: by the station's check {summary['frames_lost']}, receive overflows {summary['receive_overflows']}, "
          f"refused to send {summary['send_refused']}, by the check of candump's record {result['broken']}")
    print(f"station, share of one core: own work {replayed:.2f} %, by /proc/PID/stat {result['stat_percent']:.2f} %")
    if not babbler:
        print(f"all programs {together['with']:.1f} %, without the station {together['without']:.1f} %")
    if babbler:
        print(f"node {babbler}, with garbage: {', '.join(own)}; frames dropped as babble {summary['frames_babbled']}")
    print(f"others disturbed: {disturbed or 'none'}")
    lost = missing or result["broken"] or summary["receive_overflows"] or (summary["frames_lost"] and not babbler)
    return not lost and not disturbed


def main() -> int:
    options = parse()
    if options.inside:
        run_inside(options)
        return 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        command = [ROOT / "tools/with-vcan", "-r", sys.executable, __file__, *sys.argv[1:], "--inside", folder]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as wrapper:
            together = watch(wrapper)
        if wrapper.returncode != 0:
            return 1
        result = json.loads((folder / "inside.json").read_text())
        good = report(options, result, together, replay_percent(options, folder, result["seconds"]))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
