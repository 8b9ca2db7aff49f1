"""The same run on several targets, with everything that the station sends compared to the bit.

A target is a build of taper-sim that runs here or under qemu-user, or the image of a board that taper-sim drives. All have
32-bit floats, so the frames, steps.csv, connectors.csv and sessions.csv are to be equal byte by byte, and summary.json but
for what only one of them can measure.
"""

import json
import subprocess
import time
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from pathlib import Path

from .emulator import Emulator, EmulatorError, emulated
from .files import InputError
from .sessions import Session, write_sessions_csv

HOUR_S = 3600
DAY_S = 24 * HOUR_S
FRAMES = "frames.log"
TABLES = ("steps.csv", "connectors.csv", "sessions.csv")
MEASURED = ("solve_ms", "board")  # of summary.json
LONGEST_RUN_S = 4 * HOUR_S


class EqualityError(Exception):
    """A target is not there, or its run failed. The text is for the user."""


@dataclass(frozen=True)
class Case:
    """A run, but for who runs it."""
    name: str
    station: str
    sessions: list[Session]
    arguments: tuple[str, ...]
    files: dict[str, str] = field(default_factory=dict)  # that the arguments name


@dataclass(frozen=True)
class Target:
    """Who runs: a program with what stands before it on the command line, or the host's program and an image."""
    name: str
    program: Path
    runner: tuple[str, ...] = ()
    image: Path | None = None


@dataclass(frozen=True)
class Outcome:
    folder: Path
    wall_s: float

    def frames(self) -> list[str]:
        return (self.folder / FRAMES).read_text(encoding="ascii").splitlines()

    def table(self, name: str) -> bytes:
        return (self.folder / "out" / name).read_bytes()

    @property
    def summary(self) -> dict:
        return json.loads((self.folder / "out" / "summary.json").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Difference:
    frames: int  # compared
    count: int  # of frames that differ, or that only one of them sent
    first: str  # frame of each, or ""
    files: tuple[str, ...]  # that differ

    def __bool__(self) -> bool:
        return self.count > 0 or bool(self.files)


def _part_of_day(sessions: list[Session], day: int, begin_h: float, end_h: float, every: int) -> list[Session]:
    """One of `every` sessions that begin within these hours of a day; none stays beyond them."""
    begin_s, end_s = day * DAY_S + begin_h * HOUR_S, day * DAY_S + end_h * HOUR_S
    chosen = [one for one in sessions if begin_s <= one.arrival_s < end_s - HOUR_S / 2][::every]
    return [replace(one, departure_s=min(one.departure_s, end_s), expected_departure_s=one.departure_s) for one in chosen]


def hub_hours(week: list[Session]) -> Case:
    """Monday from 5 to 9 h: minimum currents, a limit that drops and comes back, a price, plans in slices."""
    drop_s = DAY_S + 7 * HOUR_S
    return Case("hub, 4 h of a real day", "hub", _part_of_day(week, 1, 5, 9, 2),
                ("--policy", "soc-mpc", "--tick-s", "300", "--min-current-a", "6", "--iterations", "150",
                 "--limit-csv", "limits.csv", "--price-csv", "prices.csv", "--price-weight", "0.5"),
                {"limits.csv": f"time_s,limit_kw\n0,40\n{drop_s},12\n{drop_s + HOUR_S},30\n",
                 "prices.csv": f"time_s,price_per_kwh\n0,0.3\n{drop_s + HOUR_S // 2},0.1\n{drop_s + HOUR_S},0.5\n"})


def hub_seconds(week: list[Session]) -> Case:
    """Ticks of a second, as a station has them: two minutes in which four come."""
    some = _part_of_day(week, 1, 5, 9, 2)[:4]
    begin_s = max(one.arrival_s for one in some)
    return Case("hub, 2 min in ticks of 1 s", "hub",
                [replace(one, arrival_s=begin_s + 20 * k, departure_s=begin_s + 120, expected_departure_s=one.departure_s)
                 for k, one in enumerate(some)],
                ("--policy", "soc-mpc", "--tick-s", "1", "--limit-kw", "15", "--iterations", "10"))


def garage_hours(week: list[Session]) -> Case:
    """Monday from 7 to 8.5 h in the garage."""
    return Case("garage, 90 min of a real day", "garage", _part_of_day(week, 1, 7, 8.5, 1),
                ("--policy", "soc-mpc", "--tick-s", "300", "--limit-kw", "60", "--iterations", "50"))


def long_cases(station: str, week: list[Session], paper_day: list[Session]) -> list[Case]:
    """A day of the paper and a whole week."""
    tick_s, limit_kw = ("60", "40") if station == "hub" else ("300", "100")
    common = ("--tick-s", tick_s, "--iterations", "50")
    return [Case(f"{station}, the paper's day", station, paper_day,
                 ("--policy", "soc-mpc", *common, "--limit-kw", "40" if station == "hub" else "56")),
            Case(f"{station}, a real week", station, week, ("--policy", "soc-mpc", *common, "--limit-kw", limit_kw))]


def short_cases(station: str, week: list[Session]) -> list[Case]:
    return [hub_hours(week), hub_seconds(week)] if station == "hub" else [garage_hours(week)]


def _command(target: Target, case: Case, folder: Path) -> list[str]:
    return [*target.runner, str(target.program), "--sessions", "sessions.csv", "--station", case.station,
            *case.arguments, "--out", "out", "--frames", FRAMES]


def _call(target: Target, case: Case, folder: Path, more: tuple[str, ...]) -> None:
    try:
        done = subprocess.run([*_command(target, case, folder), *more], cwd=folder, capture_output=True, text=True,
                              errors="replace", check=False, timeout=LONGEST_RUN_S)
    except OSError as error:
        raise EqualityError(f"{target.name}: {error.filename} cannot be started: {error.strerror}") from None
    if done.returncode != 0:
        raise EqualityError(f"{target.name}: {case.name}: exit code {done.returncode}: "
                            f"{(done.stderr or done.stdout).strip()[-2000:]}")


def _call_board(target: Target, case: Case, folder: Path, board: Emulator) -> None:
    try:
        _call(target, case, folder, ("--bus", f"slcan:127.0.0.1:{board.port}"))
    except EqualityError as error:
        raise EqualityError(f"{error}\n{board.text()}") from None


def run(target: Target, case: Case, folder: Path) -> Outcome:
    """Runs in a new folder. Raises EqualityError."""
    folder.mkdir(parents=True)
    write_sessions_csv(folder / "sessions.csv", case.sessions)
    for name, text in case.files.items():
        (folder / name).write_text(text, encoding="ascii")
    began = time.monotonic()
    if target.image is None:
        _call(target, case, folder, ())
    else:
        try:
            with emulated(target.image) as board:
                _call_board(target, case, folder, board)
        except (EmulatorError, InputError) as error:
            raise EqualityError(f"{target.name}: {error}") from None
    return Outcome(folder, time.monotonic() - began)


def _without_measures(summary: dict) -> dict:
    return {name: value for name, value in summary.items() if name not in MEASURED}


def compare(reference: Outcome, other: Outcome) -> Difference:
    pairs = list(zip_longest(reference.frames(), other.frames(), fillvalue="nothing"))
    unequal = [pair for pair in pairs if pair[0] != pair[1]]
    files = [name for name in TABLES if reference.table(name) != other.table(name)]
    if _without_measures(reference.summary) != _without_measures(other.summary):
        files.append("summary.json")
    return Difference(len(pairs), len(unequal), "{}, and not {}".format(*unequal[0][::-1]) if unequal else "", tuple(files))
