"""How long planning takes on the problems of a day: by throughput, by log utility, and by the exact solver."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from statistics import median

from .log_utility import LogUtility
from .planner_probe import LOG_UTILITY, THROUGHPUT, plan_warm
from .planning_cases import Case

REPETITIONS = 3  # of everything; the least time of each problem counts


@dataclass(frozen=True)
class Times:
    """Medians over the problems [ms]."""

    problems: int
    vehicles: float  # this too
    throughput_ms: float
    log_utility_ms: float
    exact_problems: int  # the lines below are of these
    exact_vehicles: float
    log_utility_on_those_ms: float
    exact_solver_ms: float
    exact_total_ms: float

    @property
    def log_to_throughput(self) -> float:
        return self.log_utility_ms / self.throughput_ms

    @property
    def exact_to_log(self) -> float:
        return self.exact_total_ms / self.log_utility_on_those_ms

    @property
    def solver_to_log(self) -> float:
        return self.exact_solver_ms / self.log_utility_on_those_ms


def _least_ms(runs: list[list[float]]) -> list[float]:
    return [min(times) / 1000 for times in zip(*runs)]


def time_exact(case: Case) -> tuple[float, float]:
    """Of Clarabel alone, and with statement and translation by CVXPY [ms]. At Clarabel's own tolerances."""
    runs = [LogUtility(case).solve() for _ in range(REPETITIONS)]
    return 1000 * min(run.solver_s for run in runs), 1000 * min(run.total_s for run in runs)


def times_of_day(probe: Path, cases: list[Case], exact_ms: dict[int, tuple[float, float]]) -> Times:
    """The firmware on all problems of a day, warm, in their order. `exact_ms` has time_exact() of some, by their place."""
    runs: dict[int, list[list[float]]] = {THROUGHPUT: [], LOG_UTILITY: []}
    for _ in range(REPETITIONS):
        for objective, times in runs.items():
            times.append([planned.time_us for planned in plan_warm(probe, cases, objective)])
    log_ms = _least_ms(runs[LOG_UTILITY])
    return Times(
        problems=len(cases),
        vehicles=median(len(case.demands) for case in cases),
        throughput_ms=median(_least_ms(runs[THROUGHPUT])),
        log_utility_ms=median(log_ms),
        exact_problems=len(exact_ms),
        exact_vehicles=median(len(cases[k].demands) for k in exact_ms),
        log_utility_on_those_ms=median(log_ms[k] for k in exact_ms),
        exact_solver_ms=median(solver for solver, _ in exact_ms.values()),
        exact_total_ms=median(total for _, total in exact_ms.values()),
    )
