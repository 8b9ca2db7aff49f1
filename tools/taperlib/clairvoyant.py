"""The clairvoyant bound: the most energy that any policy can deliver, as a linear programme solved by HiGHS.

It knows every session in advance. Per session i and step t, with e the energy charged in the step [kWh] and x the
energy charged since arrival at the end of the step [kWh]:

    maximise   sum of e(i,t)
    x(i,t) = x(i,t-1) + e(i,t),  x(i,-1) = 0,  x(i,t) <= request(i)
    0 <= e(i,t) <= g(i,l,t) * hours * (max_kw(i,l) - taper_kw(i,l) * soc(i))   soc at the start of the step, per line l
    sum over i of e(i,t) <= hours * mean limit in the step
    sum over i of per_kw(k,i) * e(i,t) <= hours * limit(k)               per row k of the feeder tree (feeders.py)

A session has the lines that it tells; one with a curve has the edges of the curve's concave hull instead, which no
vehicle that obeys the curve is above.

With f the share of the step that the car is there, g is f when the power is held for the step (the paper's model,
tick_s = step_s). A controller with a shorter tick lets the power fall with the SOC within the step; following the taper
for n ticks gives what the recursion x <- x + hours_of_tick * (max_kw - taper_kw * soc) gives:
g = f * (1 - (1-a)^n) / (n a), with a the relative drop per tick; a line that rises has a < 0. Each line alone is
followed at best so, so with several of them it stays a bound. A step that overlaps several limits only sees their
mean, and the number of connectors is not modelled; both can only raise the bound, so it stays a bound.
"""

import time
from dataclasses import dataclass

import highspy
import numpy as np

from .feeders import FeederRow
from .files import InputError
from .limits import Limit
from .sessions import Session

SECONDS_PER_HOUR = 3600.0


@dataclass(frozen=True)
class Bound:
    energy_kwh: float
    solve_s: float
    variables: int
    constraints: int


@dataclass(frozen=True)
class _Cells:
    """One entry per (session, step) in which the car is there, in order of session, then step."""

    session: np.ndarray
    step: np.ndarray
    present: np.ndarray
    is_first: np.ndarray


def _cells(arrival_s: np.ndarray, departure_s: np.ndarray, step_s: float) -> _Cells:
    first_step = np.floor(arrival_s / step_s).astype(int)
    end_step = np.ceil(departure_s / step_s).astype(int)
    count = end_step - first_step
    session = np.repeat(np.arange(count.size), count)
    offset = np.arange(session.size) - np.repeat(np.cumsum(count) - count, count)
    step = first_step[session] + offset
    there_from_s = np.maximum(arrival_s[session], step * step_s)
    there_to_s = np.minimum(departure_s[session], (step + 1) * step_s)
    return _Cells(session, step, (there_to_s - there_from_s) / step_s, offset == 0)


def _taper_gain(present: np.ndarray, drop_per_tick: np.ndarray, ticks_per_step: float) -> np.ndarray:
    """g of the module's text: `present` reduced by how much the power falls within the step."""
    ticks = np.maximum(present * ticks_per_step, 1.0)
    drop = np.where(drop_per_tick != 0, drop_per_tick, 1.0)
    reduced = (1 - (1 - drop) ** ticks) / (ticks * drop)
    return present * np.where(drop_per_tick != 0, reduced, 1.0)


@dataclass(frozen=True)
class _LineRows:
    """One entry per (cell, line of its session): e(cell) + slope * x(cell before) <= upper."""

    cell: np.ndarray
    slope: np.ndarray
    upper: np.ndarray


def _line_rows(cells: _Cells, sessions: list[Session], step_s: float, tick_s: float) -> _LineRows:
    lines = [session.limit_lines for session in sessions]
    count = np.array([len(own) for own in lines])
    max_kw, taper_kw = np.array([line for own in lines for line in own]).T
    owner = np.repeat(np.arange(count.size), count)
    battery_kwh = np.array([session.battery_kwh for session in sessions])[owner]
    soc_arrival = np.array([session.soc_arrival for session in sessions])[owner]
    drop_per_tick = taper_kw / battery_kwh * tick_s / SECONDS_PER_HOUR
    if np.any(drop_per_tick >= 1):
        raise InputError(f"a step or tick of {tick_s:g} s is too long for the steepest taper")

    count_of_cell = count[cells.session]
    cell = np.repeat(np.arange(cells.session.size), count_of_cell)
    place = np.arange(cell.size) - np.repeat(np.cumsum(count_of_cell) - count_of_cell, count_of_cell)
    line = (np.cumsum(count) - count)[cells.session[cell]] + place
    gain_h = _taper_gain(cells.present[cell], drop_per_tick[line], step_s / tick_s) * (step_s / SECONDS_PER_HOUR)
    arrival_kw = max_kw - taper_kw * soc_arrival
    return _LineRows(cell, gain_h * (taper_kw / battery_kwh)[line], gain_h * arrival_kw[line])


@dataclass(frozen=True)
class _Sums:
    """The rows that sum over sessions: entries in the columns of e, and bounds. Row numbers count from 0."""

    row: np.ndarray
    cell: np.ndarray
    value: np.ndarray
    upper: np.ndarray


def _sums(cells: _Cells, limit: Limit, feeders: list[FeederRow], step_s: float) -> _Sums:
    """The site's limit in every step, then every row of the feeder tree in every step."""
    hours = step_s / SECONDS_PER_HOUR
    steps, site_row = np.unique(cells.step, return_inverse=True)
    limit_kw = limit.mean_kw(np.arange(steps[0], steps[-1] + 2) * step_s)[steps - steps[0]]
    row, cell, value, upper = [site_row], [np.arange(site_row.size)], [np.ones(site_row.size)], [limit_kw * hours]
    for index, feeder in enumerate(feeders, start=1):
        weight = feeder.per_kw[cells.session]
        counted = np.flatnonzero(weight)
        row.append(index * steps.size + site_row[counted])
        cell.append(counted)
        value.append(weight[counted])
        upper.append(np.full(steps.size, feeder.limit * hours))
    return _Sums(*(np.concatenate(part) for part in (row, cell, value, upper)))


def _matrix(
    cells: _Cells, lines: _LineRows, sums: _Sums
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """CSC arrays (start, row, value). Columns: all e, then all x. Rows: balance, lines, sums."""
    count = cells.session.size
    cell = np.arange(count)
    followed = cell[:-1][~cells.is_first[1:]]
    line_row = count + np.arange(lines.cell.size)
    later = ~cells.is_first[lines.cell]
    rows = [cell, line_row, count + lines.cell.size + sums.row, cell, followed + 1, line_row[later]]
    columns = [cell, lines.cell, sums.cell, count + cell, count + followed, count + lines.cell[later] - 1]
    values = [np.ones(count), np.ones(lines.cell.size), sums.value, -np.ones(count), np.ones(followed.size),
              lines.slope[later]]
    row, column, value = (np.concatenate(part) for part in (rows, columns, values))
    order = np.lexsort((row, column))
    start = np.searchsorted(column[order], np.arange(2 * count + 1))
    return start, row[order], value[order]


def _linear_programme(
    sessions: list[Session], limit: Limit, feeders: list[FeederRow], step_s: float, tick_s: float
) -> highspy.HighsLp:
    def column(name: str) -> np.ndarray:
        return np.array([getattr(session, name) for session in sessions], dtype=float)

    cells = _cells(column("arrival_s"), column("departure_s"), step_s)
    lines = _line_rows(cells, sessions, step_s, tick_s)
    sums = _sums(cells, limit, feeders, step_s)
    count = cells.session.size
    lp = highspy.HighsLp()
    lp.num_col_ = 2 * count
    lp.num_row_ = count + lines.upper.size + sums.upper.size
    lp.sense_ = highspy.ObjSense.kMaximize
    lp.col_cost_ = np.concatenate([np.ones(count), np.zeros(count)])
    lp.col_lower_ = np.zeros(2 * count)
    lp.col_upper_ = np.concatenate([np.full(count, highspy.kHighsInf), column("requested_kwh")[cells.session]])
    no_bound = np.full(lines.upper.size + sums.upper.size, -highspy.kHighsInf)
    lp.row_lower_ = np.concatenate([np.zeros(count), no_bound])
    lp.row_upper_ = np.concatenate([np.zeros(count), lines.upper, sums.upper])
    start, row, value = _matrix(cells, lines, sums)
    lp.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    lp.a_matrix_.start_, lp.a_matrix_.index_, lp.a_matrix_.value_ = start, row, value
    return lp


def clairvoyant_bound(
    sessions: list[Session], limit: Limit, step_s: float = 900.0, tick_s: float | None = None,
    feeders: list[FeederRow] | None = None
) -> Bound:
    """The bound in kWh. tick_s defaults to step_s, the paper's model.

    Interior point with crossover takes 2.5 s of processor time for a week of 335 sessions, and 0.3 s for the paper's
    day; simplex takes 3.5 s and up to 1.2 s.
    """
    started = time.perf_counter()
    lp = _linear_programme(sessions, limit, feeders or [], step_s, min(tick_s or step_s, step_s))
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.setOptionValue("solver", "ipm")
    highs.passModel(lp)
    highs.run()
    status = highs.getModelStatus()
    if status != highspy.HighsModelStatus.kOptimal:
        raise InputError(f"the clairvoyant bound was not found: HiGHS says {highs.modelStatusToString(status)}")
    energy_kwh = highs.getInfo().objective_function_value
    return Bound(energy_kwh, time.perf_counter() - started, lp.num_col_, lp.num_row_)
