"""How long planning takes on the problems of a day: by throughput, by log utility, and by the exact solver."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from statistics import median

from .log_utility import LogUtility
from .planner_probe import LOG_UTILITY, THROUGHPUT, plan_warm
from .planning_cases import Case, evenly
from .written_out import solve_written_out

REPETITIONS = 3  # of everything; the least time of each problem counts
FULL = 0.75  # of all connectors


@dataclass(frozen=True)
class Exact:
    """One problem: Clarabel alone, with CVXPY's statement of matrices, and with the one a vehicle at a time [ms]."""

    solver_ms: float
    matrices_ms: float
    written_out_ms: float


@dataclass(frozen=True)
class Times:
    """Medians over the problems [ms]."""

    which: str  # all problems, or those of a full station
    problems: int
    vehicles: float  # this too
    throughput_ms: float
    log_utility_ms: float
    exact_problems: int  # the lines below are of these
    exact_vehicles: float
    log_utility_on_those_ms: float
    exact_solver_ms: float
    matrices_ms: float
    written_out_ms: float

    @property
    def log_to_throughput(self) -> float:
        return self.log_utility_ms / self.throughput_ms

    def times_faster(self, exact_ms: float) -> float:
        return exact_ms / self.log_utility_on_those_ms


@dataclass(frozen=True)
class Day:
    """The problems of a day in their order, with the firmware's time of each, warm [ms]."""

    cases: list[Case]
    throughput_ms: list[float]
    log_utility_ms: list[float]

    def groups(self) -> dict[str, list[int]]:
        """Places of the problems by group; that of a full station only if there are any."""
        full = [k for k, case in enumerate(self.cases) if len(case.demands) >= FULL * case.station.connectors]
        return {"all problems": list(range(len(self.cases)))} | ({"a full station": full} if full else {})


def _least_ms(runs: list[list[float]]) -> list[float]:
    return [min(times) / 1000 for times in zip(*runs)]


def time_day(probe: Path, cases: list[Case]) -> Day:
    runs: dict[int, list[list[float]]] = {THROUGHPUT: [], LOG_UTILITY: []}
    for _ in range(REPETITIONS):
        for objective, times in runs.items():
            times.append([planned.time_us for planned in plan_warm(probe, cases, objective)])
    return Day(cases, _least_ms(runs[THROUGHPUT]), _least_ms(runs[LOG_UTILITY]))


def time_exact(case: Case) -> Exact:
    """At Clarabel's own tolerances."""
    runs = [LogUtility(case).solve() for _ in range(REPETITIONS)]
    written_out_s = min(solve_written_out(case).total_s for _ in range(REPETITIONS))
    return Exact(1000 * min(run.solver_s for run in runs), 1000 * min(run.total_s for run in runs), 1000 * written_out_s)


def chosen(places: list[int], count: int) -> list[int]:
    """So many of them, evenly."""
    return [places[k] for k in evenly(len(places), count)]


def times_of(which: str, day: Day, places: list[int], exact: dict[int, Exact]) -> Times:
    """Of the problems at these places; `exact` has some of them."""
    return Times(
        which=which,
        problems=len(places),
        vehicles=median(len(day.cases[k].demands) for k in places),
        throughput_ms=median(day.throughput_ms[k] for k in places),
        log_utility_ms=median(day.log_utility_ms[k] for k in places),
        exact_problems=len(exact),
        exact_vehicles=median(len(day.cases[k].demands) for k in exact),
        log_utility_on_those_ms=median(day.log_utility_ms[k] for k in exact),
        exact_solver_ms=median(one.solver_ms for one in exact.values()),
        matrices_ms=median(one.matrices_ms for one in exact.values()),
        written_out_ms=median(one.written_out_ms for one in exact.values()),
    )
