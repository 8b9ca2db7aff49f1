"""How long planning takes on the problems of a day: by throughput, by log utility, and by the exact solver."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from statistics import median

from .log_utility import Exact
from .planner_probe import LOG_UTILITY, THROUGHPUT, plan_warm
from .planning_cases import Case

REPETITIONS = 3  # of the firmware's runs, in turn, of which the least time of each problem counts


@dataclass(frozen=True)
class Times:
    """Medians over the problems [ms]."""

    problems: int
    throughput_ms: float
    log_utility_ms: float
    exact_problems: int
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


def times_of_day(probe: Path, cases: list[Case], exact: dict[int, Exact]) -> Times:
    """The firmware on all problems of a day, warm, in their order. `exact` has the answers to some, by their place."""
    runs: dict[int, list[list[float]]] = {THROUGHPUT: [], LOG_UTILITY: []}
    for _ in range(REPETITIONS):
        for objective, times in runs.items():
            times.append([planned.time_us for planned in plan_warm(probe, cases, objective)])
    log_ms = _least_ms(runs[LOG_UTILITY])
    return Times(
        problems=len(cases),
        throughput_ms=median(_least_ms(runs[THROUGHPUT])),
        log_utility_ms=median(log_ms),
        exact_problems=len(exact),
        log_utility_on_those_ms=median(log_ms[k] for k in exact),
        exact_solver_ms=1000 * median(one.solver_s for one in exact.values()),
        exact_total_ms=1000 * median(one.total_s for one in exact.values()),
    )
