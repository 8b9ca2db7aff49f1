"""What is compared between policies, computed from their runs."""

from dataclasses import dataclass

import numpy as np

from .limits import Limit
from .sessions import Session, requested_kwh
from .simulator import Run, Spread

POWER_TOLERANCE_KW = 1e-6
LIMIT_ROUNDING_KW = 5e-5  # steps.csv has four decimals
NOTHING_SOLVED = Spread(None, None, None)


@dataclass(frozen=True)
class Measures:
    """One line of the table. Its fields are the columns of table.csv."""

    policy: str
    energy_kwh: float
    share_of_bound_percent: float
    sessions: int
    satisfied: int
    unserved_kwh: float
    jain_fairness: float
    peak_kw: float
    violations: int
    fallback_ticks: int
    solves: int
    iterations_p50: float | None
    iterations_max: float | None
    solve_ms_p50: float | None
    solve_ms_max: float | None
    cost: float | None
    cost_per_kwh: float | None


def jain_fairness(shares: np.ndarray) -> float:
    """Jain's index, (sum s)^2 / (n sum s^2): 1 when all are equal, 1/n when one has all. 1 when nobody has any."""
    square_sum = float(np.sum(shares**2))
    return 1.0 if square_sum == 0 else float(np.sum(shares)) ** 2 / (shares.size * square_sum)


def energy_shares(sessions: list[Session], run: Run) -> np.ndarray:
    """The part of its request that each session received; a session that was never served received 0."""
    return np.array([
        run.departures[session.session_id].energy_kwh / session.requested_kwh
        if session.session_id in run.departures else 0.0
        for session in sessions
        if session.requested_kwh > 0
    ])


def missing_soc_percent(sessions: list[Session], run: Run) -> np.ndarray:
    """How far below its target each session left, in percentage points of SOC."""
    missing = []
    for session in sessions:
        departure = run.departures.get(session.session_id)
        soc = session.soc_arrival if departure is None else departure.soc
        missing.append(100 * max(session.soc_target - soc, 0.0))
    return np.array(missing)


def rows_above_limit(run: Run, limit: Limit) -> list[str]:
    """Every row of steps.csv whose power is above the limit there, or above the limit that was asked for; in words."""
    allowed_kw = np.minimum(run.limit_kw, limit.at(run.time_s) + LIMIT_ROUNDING_KW)
    above = np.flatnonzero(run.power_kw > allowed_kw + POWER_TOLERANCE_KW)
    return [
        f"{run.policy}: {run.power_kw[row]:.4f} kW at {run.time_s[row]:g} s is above the limit of "
        f"{allowed_kw[row]:.4f} kW"
        for row in above
    ]


def measures_of(sessions: list[Session], run: Run, limit: Limit, bound_kwh: float) -> Measures:
    iterations, solve_ms = (run.iterations, run.solve_ms) if run.solves > 0 else (NOTHING_SOLVED, NOTHING_SOLVED)
    return Measures(
        policy=run.policy,
        energy_kwh=run.delivered_kwh,
        share_of_bound_percent=100 * run.delivered_kwh / bound_kwh if bound_kwh > 0 else 100.0,
        sessions=len(sessions),
        satisfied=run.satisfied,
        unserved_kwh=requested_kwh(sessions) - run.delivered_kwh,
        jain_fairness=jain_fairness(energy_shares(sessions, run)),
        peak_kw=run.peak_kw,
        violations=max(run.violations, len(rows_above_limit(run, limit))),
        fallback_ticks=run.fallback_ticks,
        solves=run.solves,
        iterations_p50=iterations.p50,
        iterations_max=iterations.max,
        solve_ms_p50=solve_ms.p50,
        solve_ms_max=solve_ms.max,
        cost=run.cost,
        cost_per_kwh=None if run.cost is None or run.delivered_kwh == 0 else run.cost / run.delivered_kwh,
    )
