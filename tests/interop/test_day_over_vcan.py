"""Simulated days over SocketCAN: the station's daemon against vehicles of two origins. Run it inside tools/with-vcan.

On vcan0 independent.py plays connectors 1-3 and audits the bus, taper-ev plays 4-8 and the gateway. On vcan1 taper-ev
replays a working day of a real garage, with more vehicles than connectors and power, and taper-sim in memory says what
must come out.
"""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from peer.wire import FUNCTIONS_WITHOUT_PROTECTION, Receiver

HERE = Path(__file__).resolve().parent
TIME_SCALE = 600
DAY_S = 86_400
BUS_S = DAY_S / TIME_SCALE
LIMIT_KW = "40"
TIMEOUT_S = 3 * BUS_S
START_S = 120.0  # of a Python program, in User-Mode Linux, on a busy machine
SAME_STAMP_S = 2e-6
COLUMNS = ("session_id", "connector", "arrival_s", "departure_s", "battery_kwh", "soc_arrival", "soc_target", "max_kw",
           "taper_kw")
# Nobody is cut short while he draws much: a second of the bus is ten minutes of the day, and programs start by seconds.
VISITS = [
    ("commuter", 1, 3_600, 72_000, 40, 0.75, 1.0, 11, 9), ("van", 2, 4_800, 76_000, 75, 0.2, 0.8, 22, 8),
    ("pool-morning", 3, 4_800, 36_000, 50, 0.3, 0.6, 11, 4), ("pool-evening", 3, 42_000, 80_000, 50, 0.4, 0.9, 11, 4),
    ("early", 4, 3_600, 30_000, 60, 0.2, 0.7, 22, 6), ("second", 4, 36_000, 80_000, 60, 0.5, 0.9, 11, 3),
    ("slow", 5, 7_200, 79_000, 80, 0.1, 0.9, 11, 5), ("tail", 6, 9_000, 70_000, 30, 0.6, 1.0, 7.4, 7.4),
    ("lorry", 7, 10_800, 80_000, 120, 0.3, 0.8, 22, 4), ("last", 8, 30_000, 80_000, 70, 0.3, 0.8, 22, 10)]
FIRST_OF_TAPER_EV = 4
ROOT = HERE.parents[1]
WEEK = ROOT / "host_sim/data/acn-jpl-2019-10-06.csv"  # its second day, a Monday, has 76 sessions
FIRST_MONDAY_SESSIONS = 25


def program(variable):
    path = os.environ.get(variable, "")
    if not os.access(path, os.X_OK):
        pytest.fail(f"{variable} must be the path of a program that was built, not '{path}'; ctest sets it")
    return path


def candump():
    path = shutil.which("candump")
    return path or pytest.fail("candump is missing: sudo apt-get install can-utils")


def interface(name):
    if not Path(f"/sys/class/net/{name}").exists():
        pytest.fail(f"there is no {name}: run this test as tools/with-vcan -i 'vcan0 vcan1' COMMAND")
    return name


def write_sessions(path, visits):
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([COLUMNS, *visits])
    return path


def write_monday(path):
    """The first sessions of the Monday of WEEK, at any connector."""
    subprocess.run([sys.executable, ROOT / "tools/import_acn.py", WEEK, "--out", path], check=True,
                   stdout=subprocess.DEVNULL)
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    midnight_s = min(float(row["arrival_s"]) for row in rows) // DAY_S * DAY_S + DAY_S
    monday = [row | {"connector": ""} for row in rows if 0 <= float(row["arrival_s"]) - midnight_s < DAY_S]
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(monday[:FIRST_MONDAY_SESSIONS])
    return path


class Programs:
    """Those of one day, with their outputs in a folder; whatever happens, none outlives the test."""

    def __init__(self, folder):
        self.folder = folder
        self.running = {}

    def start(self, name, *command):
        with (self.folder / f"{name}.out").open("w") as output:
            self.running[name] = subprocess.Popen([str(part) for part in command], cwd=self.folder, stdout=output,
                                                  stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL)

    def wait_for_word(self, name, word):
        give_up_s = time.monotonic() + START_S
        while word not in self.said(name):
            if time.monotonic() > give_up_s or self.running[name].poll() is not None:
                pytest.fail(f"{name} did not say '{word}', but: {self.said(name)}")
            time.sleep(0.05)

    def wait(self, name):
        """Exit code of a program that ends by itself, with what it said."""
        try:
            code = self.running[name].wait(TIMEOUT_S)
        except subprocess.TimeoutExpired:
            pytest.fail(f"{name} did not end; it said: {self.said(name)}")
        return code, self.said(name)

    def stop(self, name, with_signal):
        self.running[name].send_signal(with_signal)
        return self.wait(name)

    def said(self, name):
        return (self.folder / f"{name}.out").read_text()[-2000:]

    def end_all(self):
        for process in self.running.values():
            if process.poll() is None:
                process.kill()
                process.wait()


def start_station(programs, bus, *options):
    programs.start("station", program("TAPER_STATION"), "--can", bus, "--station", "hub", "--limit-kw", LIMIT_KW,
                   "--time-scale", TIME_SCALE, *options)


def start_vehicles(programs, bus, connectors, sessions, out):
    programs.start("ev", program("TAPER_EV"), "--can", bus, "--station", "hub", "--connectors", connectors,
                   "--limit-kw", LIMIT_KW, "--time-scale", TIME_SCALE, "--sessions", sessions, "--out", out)


@pytest.fixture(scope="module")
def days(tmp_path_factory):
    """Both days, at the same time: their folders and programs, which have been started."""
    mixed, alone = (Programs(tmp_path_factory.mktemp(name)) for name in ("mixed", "alone"))
    try:
        mixed.start("candump", candump(), "-l", interface("vcan0"))
        time.sleep(0.5)
        own = [visit for visit in VISITS if visit[1] < FIRST_OF_TAPER_EV]
        others = [visit for visit in VISITS if visit[1] >= FIRST_OF_TAPER_EV]
        mixed.start("independent", sys.executable, HERE / "independent.py", "--can", "vcan0", "--nodes", "1,2,3",
                    "--seconds", BUS_S, "--time-scale", TIME_SCALE, "--report", mixed.folder / "report.json",
                    "--vehicles", write_sessions(mixed.folder / "own.csv", own))
        mixed.wait_for_word("independent", "on vcan0")  # so that both halves of the day begin together
        start_vehicles(mixed, "vcan0", "4-8", write_sessions(mixed.folder / "others.csv", others), mixed.folder / "out")
        start_station(mixed, "vcan0")
        start_vehicles(alone, interface("vcan1"), "1-8", write_monday(alone.folder / "monday.csv"), alone.folder / "out")
        start_station(alone, "vcan1", "--tick-ms", 100)  # a minute of the day, as in taper-sim
        yield mixed, alone
    finally:
        mixed.end_all()
        alone.end_all()


@pytest.fixture(scope="module")
def mixed_day(days):
    """Exit codes and words of the programs on vcan0, the report, and candump's frames."""
    programs, _ = days
    ends = {name: programs.wait(name) for name in ("independent", "ev")}
    ends["station"] = programs.stop("station", signal.SIGTERM)
    programs.stop("candump", signal.SIGINT)
    return ends, json.loads((programs.folder / "report.json").read_text()), frames_of_log(programs.folder)


def frames_of_log(folder):
    """(time, identifier, data) of every frame that candump wrote."""
    (log,) = folder.glob("candump-*.log")
    frames = []
    for line in log.read_text().splitlines():
        stamp, _, frame = line.split()[:3]
        can_id, data = frame.split("#")
        frames.append((float(stamp.strip("()")), int(can_id, 16), bytes.fromhex(data)))
    return frames


def test_all_programs_of_the_day_succeed(mixed_day):
    ends, _, _ = mixed_day
    assert {name: code for name, (code, _) in ends.items()} == {"independent": 0, "ev": 0, "station": 0}, ends


def test_at_no_frame_could_a_limit_have_been_exceeded(mixed_day):
    _, report, _ = mixed_day
    assert report["violations"] == []
    assert report["worst_margin_W"] >= -1
    assert sorted(report["setpoints"], key=int) == [str(node) for node in range(1, 9)]


def test_the_two_implementations_of_the_protection_agree_on_every_frame(mixed_day):
    _, report, _ = mixed_day
    assert report["e2e"] == {"crc": 0, "repeated": 0, "sequence": 0, "lost": 0, "untrusted": 0}, report["e2e_errors"]
    assert report["frames"]["error_frames"] == 0


def test_vehicles_of_another_origin_get_what_they_ask_for(mixed_day):
    _, report, _ = mixed_day
    assert len(report["sessions"]) == 4
    for session in report["sessions"]:
        assert session["energy_kwh"] >= 0.99 * session["wanted_kwh"], session


def test_the_record_of_the_bus_is_complete(mixed_day):
    _, report, frames = mixed_day
    first_s, last_s = report["first_frame_s"] - SAME_STAMP_S, report["last_frame_s"] + SAME_STAMP_S
    assert sum(first_s <= stamp <= last_s for stamp, _, _ in frames) == report["frames"]["all"]
    receivers = {}
    for _, can_id, data in frames:
        if can_id >> 6 not in FUNCTIONS_WITHOUT_PROTECTION:
            verdict = receivers.setdefault(can_id, Receiver()).sort(can_id, data)
            assert verdict == ("ok", 0), f"{can_id:03X} {data.hex(' ')}"
    assert len(receivers) > 8 * 8


def energies_kwh(folder):
    with (folder / "sessions.csv").open(newline="") as file:
        return {row["session_id"]: float(row["energy_kwh"]) for row in csv.DictReader(file)}


def test_a_real_day_over_the_bus_gives_the_energy_of_the_day_in_memory(days, tmp_path):
    _, programs = days
    code, said = programs.wait("ev")
    assert code == 0, said
    code, said = programs.stop("station", signal.SIGTERM)
    assert code == 0, said
    subprocess.run([program("TAPER_SIM"), "--sessions", programs.folder / "monday.csv", "--station", "hub", "--limit-kw",
                    LIMIT_KW, "--tick-s", "60", "--policy", "soc-mpc", "--out", tmp_path / "memory"], check=True,
                   stdout=subprocess.DEVNULL)
    over_the_bus, in_memory = energies_kwh(programs.folder / "out"), energies_kwh(tmp_path / "memory")
    assert over_the_bus.keys() == in_memory.keys()
    assert sum(in_memory.values()) > 200  # kWh, of 600 that were asked for: the limit holds all day
    assert sum(over_the_bus.values()) == pytest.approx(sum(in_memory.values()), rel=0.005)
