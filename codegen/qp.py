"""The quadratic programme of a station: which entries its matrices have, in which order.

OSQP is generated for this structure; the firmware writes the values at run time. The values here are realistic ones,
so that the generated solver is a valid one for some station with every slot in use.

N connectors, T steps, R rows of limits (rows.py). Variable v(i,t) = i*T + t: energy that connector i has got by the end
of step t. Rows, with v(i,-1) = 0:

    rate    i*T + t                      v(i,t) - v(i,t-1)
    taper   N*T + i*(T-1) + (t-1)        v(i,t) - (1 - a_i) v(i,t-1), t >= 1
    target  M + i                        0.58 v(i,T-1)                           M = N*T + N*(T-1)
    sum     M + N + r*T + t              s_r * sum of c_ri (v(i,t) - v(i,t-1)) over the n_r connectors in row r

with s_r = sqrt(5 / n_r); for sums of currents 0.4 sqrt(5 / sum of c_ri^2). c_ri is what the row counts per power of the
connector: supply power, or current times the site's voltage. The factors 0.58 and s_r make the rows alike in size, which
OSQP's convergence depends on. Of a station that plans with two lines of the taper, as many rows for the second lines follow on
those of the first, with a_i of their own: M is N*T + 2*N*(T-1).

In the compressed columns the entries stand by ascending row. Column v(i,t) of A is therefore

    1 (rate t), -1 (rate t+1), 1 (taper t), -(1-a_i) (taper t+1), the last two for each line, 0.58 (target),
    then for each row r that i is in, ascending: s_r c_ri (sum t), -s_r c_ri (sum t+1)

where "t" of the taper is there only for t >= 1, all of "t+1" only for t < T-1 and the target only for t = T-1.
Column v(i,t) of P (upper triangle) is the entry with v(i,t-1), for t >= 1, and then the diagonal.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from scipy import sparse

from rows import DIFFERENCES, POWER, Row, planned_rows
from station import Station

TARGET_FACTOR = 0.58
SUM_FACTOR_CONNECTORS = 5.0  # s_r is 1 for a row of this many
CURRENT_FACTOR = 0.4  # of sums of currents besides: there are several for one of power, and they bind together
TAPER = 0.03  # a: fall of the power per energy, per unit
POWER_COST = 0.1  # q
DISCOUNT = 0.95  # g, per step


@dataclass(frozen=True)
class Layout:
    """Where rows and variables stand. All other parts of the generator ask here."""

    connectors: int
    steps: int
    sums: int  # rows of limits in each step
    lines: int = 1  # of the taper

    @property
    def variables(self) -> int:
        return self.connectors * self.steps

    @property
    def rows(self) -> int:
        return self.sum_row(self.sums, 0)

    def variable(self, connector: int, step: int) -> int:
        return connector * self.steps + step

    def rate_row(self, connector: int, step: int) -> int:
        return connector * self.steps + step

    def taper_row(self, connector: int, step: int, line: int = 0) -> int:
        """Step 0 has none: the energy before it is known, so that its taper is a bound of its rate row."""
        return self.variables + (line * self.connectors + connector) * (self.steps - 1) + step - 1

    def target_row(self, connector: int) -> int:
        return self.variables + self.lines * self.connectors * (self.steps - 1) + connector

    def sum_row(self, number: int, step: int) -> int:
        return self.target_row(self.connectors) + number * self.steps + step


def layout(station: Station) -> Layout:
    return Layout(len(station.connectors), station.steps, len(planned_rows(station)), station.planning.taper_lines)


def constraint_matrix(station: Station) -> sparse.csc_matrix:
    """A, with sorted row indices."""
    at = layout(station)
    limits = [sum_factors(station, row) for row in planned_rows(station)]
    entries: list[tuple[int, int, float]] = []
    for i in range(at.connectors):
        own = [(number, factors[i]) for number, factors in enumerate(limits) if i in factors]
        for t in range(at.steps):
            differences = [(at.rate_row(i, t), 1.0)] + [(at.sum_row(number, t), factor) for number, factor in own]
            for row, factor in differences:
                entries.append((row, at.variable(i, t), factor))
                if t > 0:
                    entries.append((row, at.variable(i, t - 1), -factor))
            for line in range(at.lines if t > 0 else 0):
                entries.append((at.taper_row(i, t, line), at.variable(i, t), 1.0))
                entries.append((at.taper_row(i, t, line), at.variable(i, t - 1), TAPER - 1.0))
        entries.append((at.target_row(i), at.variable(i, at.steps - 1), TARGET_FACTOR))
    return _csc(entries, (at.rows, at.variables))


def sum_factors(station: Station, row: Row) -> dict[int, float]:
    """s_r c_ri of the connectors in a row, all conductors in use."""
    reference = 1.0 if row.kind == POWER else station.site_voltage_mV / 1000  # makes a row of currents one of powers
    factors = {i: weight * reference / _drawn_W_per_A(station, i) for i, weight in row.weights.items()}
    scale = sqrt(SUM_FACTOR_CONNECTORS / len(factors))
    if row.kind != POWER and row.kind not in DIFFERENCES:
        scale = CURRENT_FACTOR * sqrt(SUM_FACTOR_CONNECTORS / sum(factor**2 for factor in factors.values()))
    return {i: scale * factor for i, factor in factors.items()}


def _drawn_W_per_A(station: Station, i: int) -> float:
    """Power of the vehicle for 1 A of setpoint: without the losses that count in the supply."""
    connector = station.connectors[i]
    return float(-(-connector.voltage_mV // 1000) * connector.phases)


def cost_matrix(station: Station) -> sparse.csc_matrix:
    """P of the cost sum over t of g^(t+1) q/2 (v(i,t) - v(i,t-1))^2: upper triangle, with sorted row indices."""
    at = layout(station)
    weight = [POWER_COST * DISCOUNT ** (t + 1) for t in range(at.steps)] + [0.0]
    entries: list[tuple[int, int, float]] = []
    for i in range(at.connectors):
        for t in range(at.steps):
            if t > 0:
                entries.append((at.variable(i, t - 1), at.variable(i, t), -weight[t]))
            entries.append((at.variable(i, t), at.variable(i, t), weight[t] + weight[t + 1]))
    return _csc(entries, (at.variables, at.variables))


def neutral_bounds(station: Station) -> tuple[np.ndarray, np.ndarray]:
    """Bounds l < u in every row: OSQP sorts rows into equalities and inequalities, and starts with the latter."""
    rows = layout(station).rows
    return np.full(rows, -1.0), np.full(rows, 1.0)


def _csc(entries: list[tuple[int, int, float]], shape: tuple[int, int]) -> sparse.csc_matrix:
    rows, columns, values = zip(*entries, strict=True)
    matrix = sparse.csc_matrix((values, (rows, columns)), shape=shape)
    matrix.sort_indices()
    assert matrix.nnz == len(entries), "two entries in one place"
    return matrix
