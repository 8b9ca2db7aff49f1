"""The paper's planning problem, exact: stated in CVXPY, solved by Clarabel with exponential cones.

Chen and Zhang, "State-of-Charge Aware EV Charging" (arXiv 2111.15147), eq. 7 with the taper and eq. 4 without, for N
vehicles and T steps of h hours. p_it is the power of vehicle i in step t [kW], E_it = h (p_i0 + .. + p_it) what it has
received by the end of it [kWh], need_i what it still wants [kWh], lambda in 1/kWh2:

    maximise  sum of log p_it over the pairs (i,t) in which i may charge  -  lambda sum_i (E_i,T-1 - need_i)^2

below the rows of the throughput problem (planning_problem.py, which knows nothing of the firmware): rate (connector,
vehicle, share of the step that it stays, site), taper (p_it falls with E_i,t-1), target (E_i,T-1 <= need_i), and the sums
of the feeder tree. Equation 4 is the same problem for vehicles without a taper. The logarithm has no value at 0. So where
all that bounds p_it alone is at most NEGLIGIBLE of the strongest connector's power (the vehicle has left, the site has
none, the battery is full), p_it is 0, and there is no logarithm of it.

The logarithm is strictly concave, so that there is one answer.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import clarabel
import cvxpy as cp
import numpy as np
import scipy.sparse as sp

from .planning_cases import Case
from .planning_problem import Problem

NEGLIGIBLE = 1e-3  # of the strongest connector's power
ACCURACY = 1e-6  # of the exact answers, relative
LEAST_POWER = 1e-6  # the same: what the logarithm of a smaller power is taken of
PRECISE = {"tol_gap_abs": 1e-9, "tol_gap_rel": 1e-11, "tol_feas": 1e-9}
"""Clarabel's own 1e-8 is of the objective, where with a great lambda the energy missing hides the logarithms."""
UNSCALED = PRECISE | {"equilibrate_enable": False}  # the problem comes scaled: where Clarabel stops early, this goes on
DOUBT = 0.005  # Exact.first_step_doubt that is worth a second try


class SolverError(Exception):
    """The exact solver found no answer."""


@dataclass(frozen=True)
class Exact:
    power_kW: np.ndarray  # [connectors of the station x steps]
    objective: float
    duality_gap: float  # by which the objective may be short of the optimum
    solver_s: float  # Clarabel's own
    total_s: float  # with the statement in CVXPY, and its translation to cones

    def first_step_doubt(self, base_kW: float) -> float:
        """How far a power of the first step may be from the optimum's, as a share of base_kW.

        A power that is off by the share d of itself costs d^2/2 of the objective at least, because of its logarithm.
        """
        share = math.sqrt(2 * max(self.duality_gap, 0))
        return float(self.power_kW[:, 0].max() / base_kW * share / (1 - share)) if share < 1 else math.inf


class LogUtility:
    """One planning problem. `terms` says which [vehicle, step] have a logarithm."""

    def __init__(self, case: Case):
        self.station, self.weight = case.planned, case.lambda_per_kWh2
        station, demands = self.station, case.demands
        self.problem = Problem(station, demands, case.limit_W[: station.steps])
        self.connectors = self.problem.connectors
        self.base_kW = station.base_W / 1000
        self.step_h = station.step_s / 3600
        self.need_kWh = np.array([demands[i].need_Wh / 1000 for i in self.connectors])
        self.most = self._most().reshape(len(self.connectors), station.steps)  # per unit
        self.terms = self.most > NEGLIGIBLE
        self.unit = self._units(self.most)

    def _most(self) -> np.ndarray:
        """The least bound on each power by itself, per unit: from the rows in which nothing is negative."""
        count = len(self.connectors) * self.station.steps
        rows = self.problem.R.tocsr()
        adds_up = np.flatnonzero(rows.min(axis=1).toarray().ravel() >= 0)
        powers = rows[adds_up, :count].tocoo()
        most = np.full(count, np.inf)
        inside = powers.data > 0
        row, column, weight = powers.row[inside], powers.col[inside], powers.data[inside]
        np.minimum.at(most, column, self.problem.b[adds_up][row] / weight)
        return most

    def _units(self, most: np.ndarray) -> np.ndarray:
        """A unit for each power: what meets the vehicle's need evenly, or the most that it may be.

        The optimum of a vehicle that is nearly full is so small a power that the solver would not tell it from 0.
        """
        even = self.need_kWh / (self.base_kW * self.step_h * np.maximum(self.terms.sum(axis=1), 1))
        return np.clip(most, NEGLIGIBLE, even[:, None])

    def objective(self, power_kW: np.ndarray) -> float:
        """Of a plan [connectors of the station x steps]. Powers below LEAST_POWER count as that much."""
        p = power_kW[self.connectors]
        missing_kWh = self.step_h * p.sum(axis=1) - self.need_kWh
        logs = np.log(np.maximum(p[self.terms], LEAST_POWER * self.base_kW))
        return float(logs.sum() - self.weight * (missing_kWh**2).sum())

    def excess(self, power_kW: np.ndarray) -> float:
        """The most by which a plan exceeds a row, relative to bounds above 1 per unit."""
        return self.problem.judge(power_kW / self.base_kW)[1]

    def gap(self, power_kW: np.ndarray, exact: Exact) -> float:
        """How far the objective of a plan is off, as a share of the greater of the exact one and the number of logarithms.

        The sum of n logarithms may be anything near 0, and which depends on the unit of power. n does not: a plan whose
        powers are all 0.1 % off has a gap of about 0.1 %.
        """
        scale = max(abs(exact.objective), int(self.terms.sum()), 1)
        return abs(exact.objective - self.objective(power_kW)) / scale

    def first_step_difference(self, power_kW: np.ndarray, exact: Exact) -> float:
        """The greatest between two plans in the step that is carried out, as a share of the strongest connector's power."""
        return float(np.abs(power_kW[:, 0] - exact.power_kW[:, 0]).max() / self.base_kW)

    def _stated(self) -> tuple[cp.Problem, cp.Variable, sp.csr_matrix]:
        """The problem, its variables, and what makes (u, x) of them. Powers that are 0 are no variables, nor their sums."""
        count, steps = self.terms.size, self.station.steps
        charges = self.terms.any(axis=1)
        energies = np.flatnonzero(np.repeat(charges, steps))
        unit = self.unit.max(axis=1)
        units = np.concatenate([self.unit.ravel(), np.repeat(unit, steps)])
        expand = sp.diags(units, format="csc")[:, np.concatenate([np.flatnonzero(self.terms), count + energies])]
        z = cp.Variable(expand.shape[1])
        logs = expand.shape[1] - energies.size
        last = np.arange(logs + steps - 1, expand.shape[1], steps)
        missing = cp.multiply(self.base_kW * self.step_h * unit[charges], z[last]) - self.need_kWh[charges]
        rows = (self.problem.R @ expand).tocsr()
        says_more = np.flatnonzero(rows.max(axis=1).toarray().ravel() > 0)  # than that a power is not negative
        factor = 1 / abs(rows[says_more]).max(axis=1).toarray().ravel()
        below = [
            (sp.diags(1 / np.repeat(unit, steps)) @ self.problem.E @ expand)[energies] @ z == 0,
            sp.diags(factor) @ rows[says_more] @ z <= factor * self.problem.b[says_more],
        ]
        utility = cp.sum(cp.log(z[:logs])) - self.weight * cp.sum_squares(missing)
        return cp.Problem(cp.Maximize(utility), below), z, expand

    def solve(self, **settings: float) -> Exact:
        """The optimum. `settings` are Clarabel's, for example PRECISE. Raises SolverError."""
        if not self.terms.any():
            return self._nothing()
        began = time.perf_counter()
        problem, z, expand = self._stated()
        data, chain, inverse = problem.get_problem_data(cp.CLARABEL, solver_opts=dict(settings))
        answer = chain.solve_via_data(problem, data, solver_opts=dict(settings))
        total_s = time.perf_counter() - began
        duality_gap = self._judged(answer)
        z.value = chain.invert(answer, inverse).primal_vars[z.id]
        power_kW = np.zeros((self.station.connectors, self.station.steps))
        power_kW[self.connectors] = self.base_kW * (expand @ z.value)[: self.terms.size].reshape(self.terms.shape)
        return Exact(power_kW, self.objective(power_kW), duality_gap, answer.solve_time, total_s)

    def solve_precisely(self) -> Exact:
        """The optimum with the smaller duality gap of two tries, of which the second is seldom needed."""
        exact = self.solve(**PRECISE)
        if exact.first_step_doubt(self.base_kW) <= DOUBT:
            return exact
        return min(exact, self.solve(**UNSCALED), key=lambda one: abs(one.duality_gap))

    def _judged(self, answer: clarabel.DefaultSolution) -> float:
        """The duality gap. Clarabel says "almost solved" of answers that miss its tolerances by little: the gap counts."""
        gap = answer.obj_val - answer.obj_val_dual
        scale = max(abs(answer.obj_val), float(self.terms.sum()))
        worst = max(abs(gap) / scale, answer.r_prim, answer.r_dual)
        if str(answer.status) not in ("Solved", "AlmostSolved") or not worst <= ACCURACY:
            raise SolverError(f"station {self.station.name}: Clarabel says {answer.status}, gap {gap:.1e} of {scale:.1e}")
        return gap

    def _nothing(self) -> Exact:
        power_kW = np.zeros((self.station.connectors, self.station.steps))
        return Exact(power_kW, self.objective(power_kW), 0.0, 0.0, 0.0)
