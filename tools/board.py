#!/usr/bin/env python3
"""Runs the image of a board in QEMU on a day of a real week, and tells what it did and what it took.

The station runs on the board; vehicles, connectors and the gateway are taper-sim's, which reaches the board over SLCAN and
has its clock. Exit code: 0 all well; 1 something failed; 2 wrong usage; 3 a limit was exceeded.
"""

import argparse
import dataclasses
import json
import re
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from import_acn import REQUEST_COLUMNS, read_acn_csv, sessions_of
from taperlib.cases import KW_PER_CAR
from taperlib.emulator import EmulatorError, emulated
from taperlib.feeders import connector_count
from taperlib.files import InputError
from taperlib.image import BrokenImage, Image
from taperlib.numbers import positive, whole_not_negative
from taperlib.sessions import Session, peak_present, read_sessions_csv, write_sessions_csv

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build"
WEEK = ROOT / "host_sim/data/acn-caltech-2019-07-14.csv"
SIMULATOR = BUILD / "host-release/host_sim/taper-sim"
DAY_S = 86400.0
TAPER_SHARE = 0.6
LIMIT_SHARE = 1 / 3
EXIT_FAILED, EXIT_LIMIT_EXCEEDED = 1, 3


class BoardError(Exception):
    """The run cannot be made. The text is for the user."""


@dataclass(frozen=True)
class Build:
    """What a preset has built."""
    preset: str
    board: str
    station: str
    image: Path

    @property
    def map(self) -> Path:
        return self.image.with_suffix(".map")


def build_of(preset: str) -> Build:
    folder = BUILD / preset
    try:
        cache = (folder / "CMakeCache.txt").read_text(encoding="utf-8")
    except OSError:
        raise BoardError(f"there is no build of {preset}; make it with: tools/dev board {preset}") from None
    values = dict(re.findall(r"^(TAPER_\w+):\w+=(.*)$", cache, re.MULTILINE))
    board, station = values.get("TAPER_BOARD", ""), values.get("TAPER_STATIONS", "")
    if not board:
        raise BoardError(f"{preset} builds no image: the presets of boards are cm7-hub, cm7-garage and cm4-hub")
    return Build(preset, board, station, folder / "firmware/mps2" / f"taper-{board}.elf")


def sessions_of_day(week: Path, day: int) -> list[Session]:
    """Who came on that day, from its midnight; who stayed longer leaves with it. Vehicles as import_acn.py draws them."""
    rows = read_acn_csv(week, REQUEST_COLUMNS["requested"])
    begin_s, end_s = day * DAY_S, (day + 1) * DAY_S
    chosen = [dataclasses.replace(session, arrival_s=session.arrival_s - begin_s,
                                  departure_s=min(session.departure_s, end_s) - begin_s)
              for session in sessions_of(rows, 0, KW_PER_CAR, TAPER_SHARE, driver_departure=False)
              if begin_s <= session.arrival_s < end_s]
    if not chosen:
        raise BoardError(f"{week}: nobody came on day {day}")
    return chosen


def default_limit_kw(sessions: list[Session], station: str) -> float:
    """A third of what those cars could draw that find a connector at the busiest moment."""
    cars = min(peak_present(sessions), connector_count(station))
    return round(LIMIT_SHARE * cars * KW_PER_CAR, 1)


def simulate(options: argparse.Namespace, build: Build, limit_kw: float, sessions: Path) -> str:
    """@return what the image reported besides its starts: nothing, if all went well."""
    with emulated(build.image) as board:
        command = [str(options.sim), "--sessions", str(sessions), "--station", build.station, "--policy", options.policy,
                   "--limit-kw", f"{limit_kw:g}", "--tick-s", f"{options.tick_s:g}", "--iterations", str(options.iterations),
                   "--bus", f"slcan:127.0.0.1:{board.port}", "--out", str(options.out)]
        try:
            done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
        except FileNotFoundError:
            raise BoardError(f"there is no simulator at {options.sim}; build it with: tools/dev build") from None
        text = board.text()
    if done.returncode not in (0, EXIT_LIMIT_EXCEEDED):
        raise BoardError(f"taper-sim failed with exit code {done.returncode}:\n{done.stderr.strip()}\n{text}".strip())
    return text


def number(value: float | None) -> str:
    return f"{value:,.0f}" if value else "none"


def memory_lines(image: Image) -> list[str]:
    memory = image.memory()
    limit_B = next(symbol.address for symbol in image.symbols if symbol.name == "mps2_ram_size")
    code_B, tables_B, start_B = (memory[f"flash_{part}_B"] for part in ("code", "solver_tables", "start_values"))
    return [
        f"  flash             {number(code_B + tables_B + start_B)} bytes: code and constants {number(code_B)}, the solver's "
        f"tables {number(tables_B)}, start values of RAM {number(start_B)}",
        f"  RAM               {number(memory['ram_B'])} of {number(limit_B)} bytes: solver {number(memory['ram_solver_B'])}, "
        f"station {number(memory['ram_station_B'])}, stack {number(memory['ram_stack_B'])}",
    ]


def report(build: Build, summary: dict, limit_kw: float, seconds: float) -> list[str]:
    board = summary["board"]
    per_tick = board["instructions_per_tick"]
    stack = f"{number(board['stack_used_b'])} of {number(board['stack_size_b'])} bytes used"
    return [
        f"{build.preset}: station {build.station} on {build.board}, {summary['policy']}, limit {limit_kw:g} kW, "
        f"{seconds:.0f} s",
        f"  energy            {summary['delivered_kwh']:.1f} of {summary['requested_kwh']:.1f} kWh asked for; "
        f"{summary['satisfied']} of {summary['sessions']} sessions satisfied, peak {summary['peak_kw']:.1f} kW",
        f"  limit violations  {summary['limit_violations']}",
        f"  instructions      per tick: median {number(per_tick['p50'])}, worst {number(per_tick['max'])}, "
        f"worst without a solver slice {number(per_tick['max_without_slice'])}",
        f"                    per poll: worst {number(board['max_instructions_per_poll'])}",
        f"                    per frame, taken in as it comes: mean {number(board['mean_instructions_per_frame'])}, "
        f"all of a tick: worst {number(board['max_instructions_for_frames_of_tick'])}",
        *memory_lines(Image(build.image)),
        f"  stack             {stack}",
        f"  map               {build.map.relative_to(ROOT)}",
    ]


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("preset", help="cm7-hub, cm7-garage or cm4-hub; it must have been built")
    parser.add_argument("--week", type=Path, default=WEEK, help=f"CSV of ACN-Data (default {WEEK.relative_to(ROOT)})")
    parser.add_argument("--day", type=whole_not_negative, default=0, help="of the week, from 0 (default 0)")
    parser.add_argument("--limit-kw", type=positive, help="site limit [kW] (default: a third of what the cars that find a "
                        f"connector could draw at once, {KW_PER_CAR} kW each)")
    parser.add_argument("--policy", default="soc-mpc", help="of taper-sim (default soc-mpc)")
    parser.add_argument("--tick-s", type=positive, default=30.0, help="control tick [s] (default 30)")
    parser.add_argument("--iterations", type=int, default=9, help="of the solver in a tick: below 10 its work is bounded, and a "
                        "plan takes some 15 ticks (default 9)")
    parser.add_argument("--sim", type=Path, default=SIMULATOR, help=f"default {SIMULATOR.relative_to(ROOT)}")
    parser.add_argument("--out", type=Path, help="folder for the simulator's files (default build/board/PRESET)")
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    options.out = options.out or BUILD / "board" / options.preset
    try:
        build = build_of(options.preset)
        options.out.mkdir(parents=True, exist_ok=True)
        sessions = sessions_of_day(options.week, options.day)
        write_sessions_csv(options.out / "day.csv", sessions)
        limit_kw = options.limit_kw or default_limit_kw(sessions, build.station)
        began = time.monotonic()
        text = simulate(options, build, limit_kw, options.out / "day.csv")
        summary = json.loads((options.out / "summary.json").read_text(encoding="utf-8"))
    except (BoardError, BrokenImage, EmulatorError, InputError, OSError) as error:
        print(f"board: {error}", file=sys.stderr)
        return EXIT_FAILED
    print("\n".join(report(build, summary, limit_kw, time.monotonic() - began)))
    faults = [line for line in text.splitlines() if not line.startswith("taper: start:")]
    if faults:
        print("board: the image reported:", *faults, sep="\n", file=sys.stderr)
        return EXIT_FAILED
    return EXIT_LIMIT_EXCEEDED if summary["limit_violations"] > 0 else 0


if __name__ == "__main__":
    sys.exit(main())
