"""How far the firmware's plans are from the exact ones: by problem, and by number of outer iterations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from statistics import mean, median

from .log_utility import Exact, LogUtility
from .planner_probe import Planned
from .planning_cases import Case


@dataclass(frozen=True)
class Gap:
    """Of one problem, solved with so many outer iterations."""

    problem: str
    vehicles: int
    logarithms: int
    outer_iterations: int
    verdict: int
    solver_iterations: int
    first_step_percent: float  # of peak power
    exact_doubt_percent: float  # of the exact one, Exact.first_step_doubt
    objective_percent: float  # LogUtility.gap
    objective: float
    exact_objective: float
    excess: float  # over the rows, LogUtility.excess
    firmware_ms: float
    exact_solver_ms: float
    exact_total_ms: float
    usable: bool


@dataclass(frozen=True)
class Line:
    """Of the table: all problems with so many outer iterations."""

    outer_iterations: int
    problems: int
    without_plan: int
    first_step_worst_percent: float
    first_step_mean_percent: float
    objective_worst_percent: float
    objective_mean_percent: float
    firmware_ms: float  # this and what follows: medians
    exact_solver_ms: float
    exact_total_ms: float

    @property
    def times_faster(self) -> float:
        return self.exact_total_ms / self.firmware_ms

    @property
    def times_faster_than_solver(self) -> float:
        return self.exact_solver_ms / self.firmware_ms


@dataclass(frozen=True)
class Solved:
    """A problem and its optimum."""

    case: Case
    utility: LogUtility
    exact: Exact

    @staticmethod
    def of(case: Case) -> Solved:
        utility = LogUtility(case)
        return Solved(case, utility, utility.solve_precisely())

    def gap(self, planned: Planned, outer_iterations: int) -> Gap:
        return Gap(
            problem=self.case.name,
            vehicles=len(self.case.demands),
            logarithms=int(self.utility.terms.sum()),
            outer_iterations=outer_iterations,
            verdict=planned.verdict,
            solver_iterations=planned.iterations,
            first_step_percent=100 * self.utility.first_step_difference(planned.power_kW, self.exact),
            exact_doubt_percent=100 * self.exact.first_step_doubt(self.utility.base_kW),
            objective_percent=100 * self.utility.gap(planned.power_kW, self.exact),
            objective=self.utility.objective(planned.power_kW),
            exact_objective=self.exact.objective,
            excess=self.utility.excess(planned.power_kW),
            firmware_ms=planned.time_us / 1000,
            exact_solver_ms=1000 * self.exact.solver_s,
            exact_total_ms=1000 * self.exact.total_s,
            usable=planned.is_usable,
        )


def line_of(gaps: list[Gap]) -> Line:
    """The line of the table for problems with the same number of outer iterations."""
    return Line(
        outer_iterations=gaps[0].outer_iterations,
        problems=len(gaps),
        without_plan=sum(not gap.usable for gap in gaps),
        first_step_worst_percent=max(gap.first_step_percent for gap in gaps),
        first_step_mean_percent=mean(gap.first_step_percent for gap in gaps),
        objective_worst_percent=max(gap.objective_percent for gap in gaps),
        objective_mean_percent=mean(gap.objective_percent for gap in gaps),
        firmware_ms=median(gap.firmware_ms for gap in gaps),
        exact_solver_ms=median(gap.exact_solver_ms for gap in gaps),
        exact_total_ms=median(gap.exact_total_ms for gap in gaps),
    )


def csv_text(rows: Iterable[Gap] | Iterable[Line], kind: type) -> str:
    names = [field.name for field in fields(kind)]
    lines = [",".join(names)]
    lines += [",".join(_cell(getattr(row, name)) for name in names) for row in rows]
    return "\n".join(lines) + "\n"


def _cell(value: object) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return f'"{text}"' if "," in text else text
