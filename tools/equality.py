#!/usr/bin/env python3
"""Whether every target decides the same: runs replays on each, and compares all frames that the station sends.

The reference is taper-sim of build/host-debug. Against it stand the images cm7-hub, cm4-hub and cm7-garage in QEMU, which it
drives, and taper-sim of linux-armhf and linux-aarch64 under qemu-user. All have 32-bit floats. A table goes to standard
output. Exit code: 0 all equal, 1 something cannot be run, 4 a difference.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from import_acn import REQUEST_COLUMNS, read_acn_csv, sessions_of
from synthetic import synthetic_day
from taperlib.equality import Case, Difference, EqualityError, Outcome, Target, compare, long_cases, run, short_cases
from taperlib.numbers import whole_positive
from taperlib.sessions import Session

ROOT = Path(__file__).resolve().parents[1]
BUILD = ROOT / "build"
WEEK = ROOT / "host_sim/data/acn-jpl-2019-10-06.csv"
PAPER_ALPHA = 0.02
STATIONS = ("hub", "garage")
HOST = BUILD / "host-debug/host_sim/taper-sim"
BOARDS = {  # preset: name, station, image
    "cm7-hub": ("Cortex-M7", "hub", "firmware/mps2/taper-mps2-an500.elf"),
    "cm4-hub": ("Cortex-M4F", "hub", "firmware/mps2/taper-mps2-an386.elf"),
    "cm7-garage": ("Cortex-M7", "garage", "firmware/mps2/taper-mps2-an500.elf"),
}
PROGRAMS = {  # preset: name, what runs it
    "linux-armhf": ("armhf", "qemu-arm-static", "/usr/arm-linux-gnueabihf"),
    "linux-aarch64": ("aarch64", "qemu-aarch64-static", "/usr/aarch64-linux-gnu"),
}
EXIT_DIFFERENT = 4


def real_week() -> list[Session]:
    rows = read_acn_csv(WEEK, REQUEST_COLUMNS["requested"])
    return sessions_of(rows, seed=0, max_kw=7.2, taper_share=0.6, driver_departure=False)


def paper_day() -> list[Session]:
    return synthetic_day(PAPER_ALPHA)


def cases_of(station: str, long: bool) -> list[Case]:
    week = real_week()
    return short_cases(station, week) + (long_cases(station, week, paper_day()) if long else [])


def board(preset: str) -> Target:
    name, _, image = BOARDS[preset]
    return Target(name, HOST, image=BUILD / preset / image)


def _linux(preset: str) -> Target:
    name, runner, libraries = PROGRAMS[preset]
    return Target(name, BUILD / preset / "host_sim/taper-sim", runner=(runner, "-L", libraries))


def targets_of(station: str, presets: list[str]) -> list[Target]:
    return ([board(preset) for preset, (_, built_for, _) in BOARDS.items() if built_for == station and preset in presets]
            + [_linux(preset) for preset in PROGRAMS if preset in presets])


def _missing(presets: list[str]) -> Iterator[str]:
    """The lines that make what is not there."""
    if not HOST.is_file():
        yield "cmake --preset host-debug && cmake --build --preset host-debug -t taper-sim"
    for preset in presets:
        path = board(preset).image if preset in BOARDS else _linux(preset).program
        if not path.is_file():
            yield f"cmake --preset {preset} && cmake --build --preset {preset}"


def _row(case: Case, target: Target, outcome: Outcome, difference: Difference | None) -> str:
    wall = f"{outcome.wall_s:.0f} s"
    if difference is None:
        return f"| {case.name} | {target.name} | {len(outcome.frames())} | | | {wall} |"
    first = ", ".join(filter(None, (difference.first, *difference.files)))
    return f"| {case.name} | {target.name} | {difference.frames} | {difference.count} | {first or 'none'} | {wall} |"


def table(cases: list[Case], presets: list[str], folder: Path, jobs: int) -> tuple[list[str], bool]:
    """Lines of Markdown, and whether all is equal. Raises EqualityError."""
    lines = ["| run | target | frames | differ | first difference, and files that differ | time |",
             "|---|---|---|---|---|---|"]
    host, equal = Target("host", HOST), True
    with ThreadPoolExecutor(jobs) as pool:
        started = [[(case, target, pool.submit(run, target, case, folder / f"{number}-{k}"))
                    for k, target in enumerate([host, *targets_of(case.station, presets)])]
                   for number, case in enumerate(cases)]
        for of_case in started:
            reference = of_case[0][2].result()
            for case, target, future in of_case:
                outcome = future.result()
                difference = None if target is host else compare(reference, outcome)
                equal = equal and not difference
                lines.append(_row(case, target, outcome, difference))
                print(lines[-1], file=sys.stderr, flush=True)
    return lines, equal


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--long", action="store_true", help="the paper's day and a real week too (an hour)")
    parser.add_argument("--station", choices=STATIONS, action="append", help="runs of this station only")
    parser.add_argument("--target", choices=[*BOARDS, *PROGRAMS], action="append", help="compare this one only; repeatable")
    parser.add_argument("--jobs", type=whole_positive, default=os.cpu_count(), help="runs at a time (default: processors)")
    return parser


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    presets = options.target or [*BOARDS, *PROGRAMS]
    missing = list(_missing(presets))
    if missing:
        print("equality: not built yet; to build it:", *missing, sep="\n    ", file=sys.stderr)
        return 1
    cases = [case for station in options.station or STATIONS for case in cases_of(station, options.long)]
    try:
        with tempfile.TemporaryDirectory(prefix="taper-equality-") as folder:
            lines, equal = table(cases, presets, Path(folder), options.jobs)
    except EqualityError as error:
        print(f"equality: {error}", file=sys.stderr)
        return 1
    print("\n".join(lines))
    return 0 if equal else EXIT_DIFFERENT


if __name__ == "__main__":
    sys.exit(main())
