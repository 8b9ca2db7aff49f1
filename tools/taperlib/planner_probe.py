"""The firmware's planner on planning problems, through the program planner_probe (tests/planner/planner_probe.c)."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from .files import InputError
from .planning_cases import Case
from .planning_problem import Demand, Station

SOLVED, INACCURATE = 2, 3  # taper_verdict_t
THROUGHPUT, LOG_UTILITY = 0, 1  # taper_objective_t
DEFAULT = 0  # outer iterations: as many as the firmware takes of itself


@dataclass(frozen=True)
class Planned:
    verdict: int
    iterations: int
    time_us: float
    power_kW: np.ndarray  # [connectors of the station x steps that are planned]

    @property
    def is_usable(self) -> bool:
        return self.verdict in (SOLVED, INACCURATE)


def demand_line(station: Station, i: int, d: Demand) -> str:
    connector = station.connector[i]
    max_mA = connector.max_mA if d.max_mA is None else d.max_mA
    W_per_A = connector.volts * d.conductors if d.conductors else connector.W_per_A
    phases = sum(1 << line for line in connector.lines[: d.conductors]) if d.conductors else ""
    return (
        f"demand {i} 1 {d.stored_Wh} {d.capacity_Wh} {d.need_Wh} {d.peak_W} {d.taper_W} "
        f"{max_mA} {W_per_A:g} {d.departs_in_s} {phases}"
        + (f"\nsecond {i} {d.second_peak_W} {d.second_taper_W}" if d.second_peak_W else "")
    )


def cold_start(case: Case, objective: int, outer_iterations: int) -> list[str]:
    """Lines that choose station and planning."""
    milli = round(1000 * case.lambda_per_kWh2)
    return [f"station {case.station.name}", f"planning {objective} {milli} {outer_iterations} {case.horizon_steps}"]


def problem_lines(case: Case) -> list[str]:
    demands = [demand_line(case.station, i, d) for i, d in case.demands.items()]
    return [f"time {case.time_ms}", "limit " + " ".join(map(str, case.limit_W)), *demands, "solve"]


def _planned(lines: list[str], case: Case) -> Planned:
    verdict, iterations, time_us = lines[0].split()
    per_unit = np.array([[float(u) for u in row.split()] for row in lines[1:]])
    power_kW = per_unit[:, : case.horizon_steps] * case.station.base_W / 1000
    return Planned(int(verdict), int(iterations), float(time_us), power_kW)


def run_probe(probe: Path, lines: list[str], cases: list[Case]) -> list[Planned]:
    """What the firmware plans, one for every `solve` of the lines, which are for `cases`. Raises InputError."""
    try:
        run = subprocess.run([str(probe.absolute())], input="\n".join([*lines, ""]), capture_output=True, text=True, check=False)
    except OSError as error:
        raise InputError(f"{probe}: cannot be started: {error.strerror}") from None
    if run.returncode != 0:
        raise InputError(f"{probe}: failed with exit code {run.returncode}: {run.stderr.strip()[-300:]}")
    answers = iter(run.stdout.splitlines())
    return [_planned(list(islice(answers, 1 + case.station.connectors)), case) for case in cases]


def plan_cold(probe: Path, cases: list[Case], outer_iterations: int = DEFAULT) -> list[Planned]:
    """By log utility, each problem without any memory of the one before."""
    lines = [line for case in cases for line in [*cold_start(case, LOG_UTILITY, outer_iterations), *problem_lines(case)]]
    return run_probe(probe, lines, cases)


def plan_warm(probe: Path, cases: list[Case], objective: int) -> list[Planned]:
    """Problems of one station in their order, each after the one before, as the firmware has them in a day."""
    lines = cold_start(cases[0], objective, DEFAULT) + [line for case in cases for line in problem_lines(case)]
    return run_probe(probe, lines, cases)
