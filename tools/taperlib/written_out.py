"""The paper's planning problem in CVXPY as one writes it down, a vehicle at a time.

log_utility.py states the same as a few products of matrices, scaled for the solver, without powers that can only be 0. That
costs CVXPY little to translate, and somebody who knows it well to write. This is the statement of a first reading of the paper,
which the times of tools/reference.py show beside it.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import cvxpy as cp
import numpy as np

from .log_utility import LogUtility, SolverError
from .planning_cases import Case


@dataclass(frozen=True)
class Answer:
    power_kW: np.ndarray  # [connectors of the station x steps]
    total_s: float  # statement, translation and solution


class _Vehicle:
    """Its powers [kW], what it has received by the end of each step [kWh], its rows and its part of the objective."""

    def __init__(self, utility: LogUtility, case: Case, chain: int):
        demand = case.demands[utility.connectors[chain]]
        steps, step_h, need_kWh = case.planned.steps, utility.step_h, float(utility.need_kWh[chain])
        charges = np.flatnonzero(utility.terms[chain])
        most_kW = utility.base_kW * np.where(utility.terms[chain], utility.most[chain], 0.0)
        self.power = cp.Variable(steps)
        energy = cp.Variable(steps)
        self.rows = [
            energy[0] == step_h * self.power[0],
            energy[1:] == energy[:-1] + step_h * self.power[1:],
            self.power >= 0,
            self.power <= most_kW,
            energy[-1] <= need_kWh,
        ]
        for line_W, fall_per_Wh in demand.lines:
            self.rows.append(self.power[1:] + fall_per_Wh * energy[:-1] <= line_W / 1000)
        missing = utility.weight * cp.square(energy[-1] - need_kWh)
        self.objective = (cp.sum(cp.log(self.power[charges])) if charges.size else 0.0) - missing


def solve_written_out(case: Case) -> Answer:
    """The optimum at Clarabel's own tolerances. Raises SolverError."""
    utility = LogUtility(case)
    sums = slice(utility.problem.first_sum, None)
    shared, bounds = utility.problem.R[sums, : utility.terms.size], utility.base_kW * utility.problem.b[sums]
    began = time.perf_counter()
    vehicles = [_Vehicle(utility, case, chain) for chain in range(len(utility.connectors))]
    powers = cp.hstack([vehicle.power for vehicle in vehicles])
    rows = [row for vehicle in vehicles for row in vehicle.rows] + [shared @ powers <= bounds]
    problem = cp.Problem(cp.Maximize(sum(vehicle.objective for vehicle in vehicles)), rows)
    problem.solve(solver=cp.CLARABEL)
    total_s = time.perf_counter() - began
    if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
        raise SolverError(f"station {case.station.name}: CVXPY says {problem.status}")
    power_kW = np.zeros((case.station.connectors, case.planned.steps))
    power_kW[utility.connectors] = [vehicle.power.value for vehicle in vehicles]
    return Answer(power_kW, total_s)
