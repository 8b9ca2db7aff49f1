#!/usr/bin/env python3
"""The firmware's planner against the OSQP package for Python, on the same problems in one run.

A case is replayed and every planning problem written down (taper-sim --problems). The generated C solver then solves
them in a row, warm-started as in the firmware (planner_probe), and so does the package, with the same tolerances and
penalty, warm-started from its last answer. Times are wall times on this machine: read the ratio.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import osqp
from rich.progress import track

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "codegen"))
import qp  # noqa: E402
from station import Station, read_station  # noqa: E402

SETTINGS = dict(
    scaling=0, rho=0.3, eps_abs=1e-4, eps_rel=3e-4, max_iter=500, check_termination=10, adaptive_rho=1,
    adaptive_rho_interval=50, polishing=False, warm_starting=True, verbose=False,
)  # fmt: skip


@dataclass
class Problem:
    """Numbers of one problem, and how the firmware's planner did on it."""

    linear: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    keep: np.ndarray
    iterations: int
    solve_ms: float


def record(sim: Path, arguments: list[str], target: Path) -> None:
    subprocess.run([sim, *arguments, "--policy", "soc-mpc", "--problems", target], check=True, stdout=subprocess.DEVNULL)


def solve_in_c(probe: Path, problems: Path) -> list[Problem]:
    with problems.open() as stream:
        text = subprocess.run([probe, "--numbers"], stdin=stream, capture_output=True, text=True, check=True).stdout
    lines = iter(text.splitlines())
    solved = []
    for head in lines:
        _, iterations, microseconds = head.split()
        numbers = [np.array(next(lines).split(), dtype=float) for _ in range(4)]
        solved.append(Problem(*numbers, int(iterations), float(microseconds) / 1e3))
    return solved


def with_tapers(station: Station, matrix: np.ndarray, places: np.ndarray, keep: np.ndarray) -> np.ndarray:
    values = matrix.copy()
    values[places] = -np.repeat(keep, station.steps - 1)
    return values


def taper_places(station: Station, a) -> np.ndarray:
    """Where in the values of A the taper factors stand, connector by connector."""
    layout = qp.layout(station)
    places = []
    for i in range(len(station.connectors)):
        for t in range(1, station.steps):
            column = layout.variable(i, t - 1)
            start, end = a.indptr[column], a.indptr[column + 1]
            places.append(start + int(np.flatnonzero(a.indices[start:end] == layout.taper_row(i, t))[0]))
    return np.array(places)


def solve_in_python(station: Station, problems: list[Problem]) -> tuple[list[int], list[float]]:
    a = qp.constraint_matrix(station)
    a.sort_indices()
    places = taper_places(station, a)
    solver = osqp.OSQP()
    first = problems[0]
    solver.setup(qp.cost_matrix(station), first.linear, a, first.lower, first.upper, **SETTINGS)
    iterations, times_ms, keep = [], [], None
    for problem in track(problems, description="osqp for Python"):
        began = time.perf_counter()
        if keep is None or not np.array_equal(keep, problem.keep):
            keep = problem.keep
            solver.update(Ax=with_tapers(station, a.data, places, keep))
        solver.update(q=problem.linear, l=problem.lower, u=problem.upper)
        result = solver.solve()
        times_ms.append((time.perf_counter() - began) * 1e3)
        iterations.append(result.info.iter)
    return iterations, times_ms


def row(name: str, iterations: list[int], times_ms: list[float]) -> str:
    return (
        f"| {name} | {np.median(iterations):.0f} | {np.percentile(iterations, 99):.0f} | {max(iterations)} "
        f"| {np.median(times_ms):.2f} | {np.percentile(times_ms, 99):.2f} | {max(times_ms):.2f} |"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    build = ROOT / "build/host-release"
    parser.add_argument("--sessions", required=True, type=Path, help="sessions CSV")
    parser.add_argument("--station", default="garage")
    parser.add_argument("--limit-kw", default=None, help="site limit [kW]")
    parser.add_argument("--tick-s", default="60", help="control tick [s], at least 10")
    parser.add_argument("--sim", type=Path, default=build / "host_sim/taper-sim")
    parser.add_argument("--probe", type=Path, default=build / "tests/planner/planner_probe")
    options = parser.parse_args()
    arguments = ["--sessions", str(options.sessions), "--station", options.station, "--tick-s", options.tick_s]
    if options.limit_kw is not None:
        arguments += ["--limit-kw", options.limit_kw]
    with tempfile.TemporaryDirectory() as folder:
        recorded = Path(folder) / "problems.txt"
        record(options.sim, arguments, recorded)
        problems = solve_in_c(options.probe, recorded)
    station = read_station(ROOT / f"codegen/stations/{options.station}.toml")
    in_c = [problem.iterations for problem in problems], [problem.solve_ms for problem in problems]
    in_python = solve_in_python(station, problems)
    print(f"{len(problems)} problems of station {options.station}")
    print("| solver | iterations p50 | p99 | max | solve ms p50 | p99 | max |")
    print("|---|---|---|---|---|---|---|")
    print(row("firmware (generated C)", *in_c))
    print(row("osqp for Python", *in_python))
    print(f"Median time, firmware to Python: {np.median(in_c[1]) / np.median(in_python[1]):.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
