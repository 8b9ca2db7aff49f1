"""What a case of the study is made of: which sessions, which limit.

Recipes are small frozen values that sections and campaigns write down. Only `Inputs` touches files.
"""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from import_acn import REQUEST_COLUMNS, AcnRow, read_acn_csv, round_to_steps, sessions_of
from synthetic import PAPER_SEED, synthetic_day
from taperlib.cases import KW_PER_CAR, shared_kw
from taperlib.curves import dc_day
from taperlib.files import InputError
from taperlib.sessions import Session

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "host_sim" / "data"
STEP_S = 900
STEPS_PER_HOUR = 4
DRAWN_TAPER_SHARE = 0.6  # of import_acn.py: share of the power that is lost between SOC 0 and SOC 1
SOC_AT_ARRIVAL = (0.1, 0.5)  # of the synthetic day: 0.8 to 4 of 8 kWh
SECONDS_PER_DAY, SECONDS_PER_HOUR = 86400, 3600
WORKING_DAYS = 5


@dataclass(frozen=True)
class SyntheticDay:
    """The paper's synthetic day, as tools/synthetic.py makes it."""

    alpha: float
    seed: int = PAPER_SEED


@dataclass(frozen=True)
class DrawnBatteries:
    """Battery and SOC as tools/import_acn.py draws them; each vehicle loses this share of its power until it is full."""

    taper_share: float = DRAWN_TAPER_SHARE


@dataclass(frozen=True)
class EqualBatteries:
    """One size for all, SOC at arrival drawn as in the synthetic day, the request what the data says, up to full.

    alpha is in the paper's units: how much less a vehicle takes in a step [kWh] for each kWh in its battery.
    """

    kwh: float
    alpha: float


@dataclass(frozen=True)
class AcnWeek:
    """A week of ACN-Data. step_s: arrivals are rounded up and departures down to it; None: times to the second."""

    week: str
    batteries: DrawnBatteries | EqualBatteries
    step_s: int | None = STEP_S
    driver_departure: bool = False


@dataclass(frozen=True)
class DcDay:
    """A day of fast charging with the curves of real vehicles (taperlib/curves.py), of which so many pieces are told."""

    seed: int
    pieces: int
    fit: str = "mean"


Sessions = SyntheticDay | AcnWeek | DcDay


@dataclass(frozen=True)
class DailyDrop:
    """Each day between these hours the limit is only this share of itself."""

    from_h: int
    to_h: int
    share: float


@dataclass(frozen=True)
class SiteLimit:
    """One of: kW; a share of what all cars at the busiest moment could draw; the hours in which it serves all that is
    requested on a working day. Perhaps with a drop each day."""

    kw: float | None = None
    share: float | None = None
    hours: float | None = None
    drop: DailyDrop | None = None


def _soc_at_arrival(session_id: str) -> float:
    """Depends on the session alone, so that it is the same for every battery and taper."""
    digest = hashlib.sha256(f"study:{session_id}".encode()).digest()
    low, high = SOC_AT_ARRIVAL
    return low + (high - low) * float(np.random.Generator(np.random.PCG64(int.from_bytes(digest[:16], "big"))).random())


def _with_equal_battery(session: Session, request_kwh: float, batteries: EqualBatteries) -> Session:
    soc = round(_soc_at_arrival(session.session_id), 6)
    taper_kw = batteries.alpha * batteries.kwh * STEPS_PER_HOUR
    if taper_kw > session.max_kw:
        raise InputError(f"alpha {batteries.alpha:g} with {batteries.kwh:g} kWh: no power would be left for a full battery")
    return replace(session, battery_kwh=batteries.kwh, soc_arrival=soc, taper_kw=taper_kw,
                   soc_target=min(round(soc + request_kwh / batteries.kwh, 6), 1.0))


def _week_sessions(recipe: AcnWeek, rows: list[AcnRow]) -> list[Session]:
    batteries = recipe.batteries
    taper_share = batteries.taper_share if isinstance(batteries, DrawnBatteries) else 0.0
    sessions = sessions_of(rows, 0, KW_PER_CAR, taper_share, recipe.driver_departure)
    if isinstance(batteries, EqualBatteries):
        request_kwh = {row.session_id: row.request_kwh for row in rows}
        sessions = [_with_equal_battery(session, request_kwh[session.session_id], batteries) for session in sessions]
    return round_to_steps(sessions, recipe.step_s)[0] if recipe.step_s else sessions


def truth_of(recipe: Sessions) -> Sessions:
    """The same sessions as the clairvoyant bound knows them: without what drivers say, and whatever lines are told."""
    if isinstance(recipe, DcDay):
        return DcDay(recipe.seed, pieces=1)
    return replace(recipe, driver_departure=False) if isinstance(recipe, AcnWeek) else recipe


def working_day_kwh(sessions: list[Session]) -> float:
    """What those that come on one day request, on average over the five days on which that is most."""
    by_day: dict[int, float] = {}
    for session in sessions:
        day = int(session.arrival_s // SECONDS_PER_DAY)
        by_day[day] = by_day.get(day, 0.0) + session.requested_kwh
    busiest = sorted(by_day.values())[-WORKING_DAYS:]
    return sum(busiest) / len(busiest)


def limit_kw(limit: SiteLimit, sessions: list[Session]) -> float:
    """The limit outside of drops [kW]."""
    if limit.hours is not None:
        return round(working_day_kwh(sessions) / limit.hours, 3)
    return limit.kw if limit.kw is not None else shared_kw(limit.share or 0.0, sessions)


def limit_csv(limit: SiteLimit, sessions: list[Session]) -> str:
    """The limit over time, as taper-sim --limit-csv reads it. Second 0 is midnight at the site."""
    kw, drop = limit_kw(limit, sessions), limit.drop
    rows = [f"0,{kw}"]
    if drop is not None:
        days = int(max(session.departure_s for session in sessions) // SECONDS_PER_DAY) + 1
        for day in range(days):
            rows += [f"{SECONDS_PER_DAY * day + SECONDS_PER_HOUR * drop.from_h},{drop.share * kw:g}",
                     f"{SECONDS_PER_DAY * day + SECONDS_PER_HOUR * drop.to_h},{kw}"]
    return "\n".join(["time_s,limit_kw", *rows]) + "\n"


class Inputs:
    """The sessions of recipes. Weeks are acn-*.csv of the project, and of one more folder."""

    def __init__(self, folder: Path | None = None) -> None:
        folders = [DATA] if folder is None else [DATA, folder]
        self._weeks = {path.stem: path for folder in folders for path in sorted(folder.glob("acn-*.csv"))}
        if folder is not None and not any(folder.glob("acn-*.csv")):
            raise InputError(f"{folder}: holds no acn-*.csv")
        self._made: dict[Sessions, list[Session]] = {}

    def weeks(self) -> list[str]:
        return sorted(self._weeks)

    def sessions(self, recipe: Sessions) -> list[Session]:
        if recipe not in self._made:
            self._made[recipe] = self._make(recipe)
        return self._made[recipe]

    def _make(self, recipe: Sessions) -> list[Session]:
        if isinstance(recipe, SyntheticDay):
            return synthetic_day(recipe.alpha, recipe.seed)
        if isinstance(recipe, DcDay):
            return dc_day(recipe.seed, recipe.pieces, fit=recipe.fit)
        if recipe.week not in self._weeks:
            raise InputError(f"week {recipe.week}: there is no {recipe.week}.csv; there are {', '.join(self.weeks())}")
        rows = read_acn_csv(self._weeks[recipe.week], REQUEST_COLUMNS["requested"])
        return _week_sessions(recipe, rows)
