"""Runs the simulator for one policy and reads back what it wrote, checking the form of all of it."""

import csv
import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .files import InputError, number_at

POLICIES = ("soc-mpc", "mpc", "edf", "edf-soc", "llf", "equal-share")
SUMMARY_NUMBERS = ("delivered_kwh", "satisfied", "limit_violations", "fallback_ticks", "solves", "peak_kw")


class SimulationError(Exception):
    """The simulator failed, or wrote something that cannot be used."""


@dataclass(frozen=True)
class Spread:
    """Median, 99th percentile and maximum over all solves; None where the policy solves nothing."""

    p50: float | None
    p99: float | None
    max: float | None


@dataclass(frozen=True)
class Departure:
    energy_kwh: float
    soc: float


@dataclass(frozen=True)
class Run:
    policy: str
    delivered_kwh: float
    satisfied: int
    violations: int
    fallback_ticks: int
    solves: int
    peak_kw: float
    iterations: Spread
    solve_ms: Spread
    departures: dict[str, Departure]
    time_s: np.ndarray
    limit_kw: np.ndarray
    power_kw: np.ndarray
    cost: float | None = None  # of the energy; None: it had no price


def _spread(summary: dict, name: str) -> Spread:
    values = summary.get(name) or {}
    if not isinstance(values, dict):
        raise ValueError(f"{name} is not an object")
    return Spread(*(None if values.get(key) is None else float(values[key]) for key in ("p50", "p99", "max")))


def _read_rows(path: Path, columns: tuple[str, ...]) -> list[tuple[str, dict[str, str]]]:
    """Each row with the words that name its place."""
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        missing = [name for name in columns if name not in (reader.fieldnames or [])]
        if missing:
            raise ValueError(f"{path}: the header lacks {', '.join(missing)}")
        return [(f"{path}, line {reader.line_num}", row) for row in reader]


def _read_departures(path: Path) -> dict[str, Departure]:
    departures = {}
    for where, row in _read_rows(path, ("session_id", "energy_kwh", "soc_departure")):
        departures[row["session_id"]] = Departure(
            energy_kwh=number_at(row["energy_kwh"], f"{where}, column energy_kwh"),
            soc=number_at(row["soc_departure"], f"{where}, column soc_departure"),
        )
    return departures


def _read_steps(path: Path) -> np.ndarray:
    """Array of shape (rows, 3): time_s, limit_kw, power_kw."""
    columns = ("time_s", "limit_kw", "power_kw")
    rows = _read_rows(path, columns)
    if not rows:
        raise ValueError(f"{path}: holds no steps")
    return np.array([[number_at(row[name], f"{where}, column {name}") for name in columns] for where, row in rows])


def read_run(policy: str, folder: Path) -> Run:
    """Reads the simulator's output. Raises SimulationError when a file is absent or malformed."""
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        numbers = {name: float(summary[name]) for name in SUMMARY_NUMBERS}
        cost = None if summary.get("energy_cost") is None else float(summary["energy_cost"])
        iterations, solve_ms = _spread(summary, "iterations"), _spread(summary, "solve_ms")
        departures = _read_departures(folder / "sessions.csv")
        steps = _read_steps(folder / "steps.csv")
    except KeyError as error:
        raise SimulationError(f"{policy}: summary.json lacks {error}") from None
    except (OSError, ValueError, TypeError, InputError) as error:
        raise SimulationError(f"{policy}: the simulator's output cannot be read: {error}") from None
    return Run(
        policy=policy,
        delivered_kwh=numbers["delivered_kwh"],
        satisfied=int(numbers["satisfied"]),
        violations=int(numbers["limit_violations"]),
        fallback_ticks=int(numbers["fallback_ticks"]),
        solves=int(numbers["solves"]),
        peak_kw=numbers["peak_kw"],
        iterations=iterations,
        solve_ms=solve_ms,
        departures=departures,
        time_s=steps[:, 0],
        limit_kw=steps[:, 1],
        power_kw=steps[:, 2],
        cost=cost,
    )


def run_policy(simulator: Path, policy: str, case_arguments: list[str], folder: Path) -> Run:
    """Runs one policy; its output stays in `folder`. Raises SimulationError with the simulator's own message."""
    folder.mkdir(parents=True)
    command = [str(simulator), "--policy", policy, *case_arguments, "--out", str(folder)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    except OSError as error:
        raise SimulationError(f"{policy}: {simulator} cannot be started: {error.strerror}") from None
    if done.returncode != 0:
        message = (done.stderr.strip() or done.stdout.strip() or "no message")[-2000:]
        how = f"signal {-done.returncode}" if done.returncode < 0 else f"exit code {done.returncode}"
        raise SimulationError(f"{policy}: the simulator failed with {how}:\n{message}")
    return read_run(policy, folder)
