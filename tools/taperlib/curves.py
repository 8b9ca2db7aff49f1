"""Charging curves of real vehicles: what few straight lines make of them, and days of fast charging with them.

A vehicle tells the greatest power of its curve as a flat limit, and 0, 1 or 2 lines (kW at SOC 0, fall until SOC 1) beside
it: the least of these is what the station takes for its curve. Two ways to choose the lines, both concave by nature:

  mean   least squares over SOC. Errs to both sides; where it is too low, the station offers less than the vehicle takes.
  above  least squares among the lines that are nowhere below the curve: never holds a vehicle back, and promises too much.

Where power is scarce, room that is kept for a vehicle and not used costs more than what is not offered to it; where there
is plenty, it is the other way round.
"""

import csv
import io
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from .charge_curve import MOST_KW, Curve, Line, capped, check_curve, hull_lines, hull_points, most_kw, power_kw
from .files import InputError, number_at, read_text
from .sessions import Session

VEHICLES_CSV = Path(__file__).resolve().parents[2] / "host_sim" / "data" / "ev-dc-charging-curves.csv"
COLUMNS = ("vehicle_id", "brand", "model", "variant", "release_year", "usable_battery_kwh", "soc_percent", "power_kw")
LEAST_KW = 1.0  # three points of the data say 0 kW before the battery is full: it would never get there
PIECES = (1, 2, 3)  # told: the flat limit alone, with one line, with two
FITS = ("mean", "above")

_SOC = np.linspace(0.0, 1.0, 201)
_HINGES = np.arange(99) / 100.0  # where a line may begin to count
_SLOPES = 120  # of lines that touch the curve from above, besides those of its hull


@dataclass(frozen=True)
class Vehicle:
    vehicle_id: str
    name: str
    battery_kwh: float
    curve: Curve


def read_vehicles(path: Path = VEHICLES_CSV) -> list[Vehicle]:
    """All vehicles, in the order of the file. Raises InputError that names file, line, column and reason."""
    reader = csv.DictReader(io.StringIO(read_text(path)))
    missing = [name for name in COLUMNS if name not in (reader.fieldnames or [])]
    if missing:
        raise InputError(f"{path}, line 1: the header lacks {', '.join(missing)}")
    vehicles: dict[str, tuple[str, float, list[tuple[float, float]]]] = {}
    for row in reader:
        where = f"{path}, line {reader.line_num}"
        soc, kw, battery_kwh = (number_at(row[name], f"{where}, column {name}")
                                for name in ("soc_percent", "power_kw", "usable_battery_kwh"))
        words = (row[name] for name in ("brand", "model", "variant", "release_year"))
        name = " ".join(word for word in words if word)
        _, _, points = vehicles.setdefault(row["vehicle_id"], (name, battery_kwh, []))
        points.append((round(soc / 100, 6), max(kw, LEAST_KW)))
    if not vehicles:
        raise InputError(f"{path}: holds no vehicles")
    found = [Vehicle(key, name, kwh, tuple(points)) for key, (name, kwh, points) in vehicles.items()]
    for vehicle in found:
        check_curve(vehicle.curve, f"{path}, vehicle {vehicle.vehicle_id} ({vehicle.name})")
    return found


# ---- Lines

def told_kw(curve: Curve, lines: tuple[Line, ...], soc: np.ndarray) -> np.ndarray:
    """What the station takes for the curve."""
    return np.min([np.full(soc.shape, most_kw(curve)), *(at_0 - fall * soc for at_0, fall in lines)], axis=0)


@lru_cache(maxsize=None)
def fit_lines(curve: Curve, count: int, fit: str = "mean") -> tuple[Line, ...]:
    """At most `count` (0..2) lines, flatter ones first, each with 0 <= fall <= kW at SOC 0 <= MOST_KW."""
    if count == 0:
        return ()
    lines = _fit_above(curve, count) if fit == "above" else _fit_mean(curve, count)
    return tuple((round(at_0, 3), round(min(fall, at_0), 3)) for at_0, fall in lines)


def _fit_above(curve: Curve, count: int) -> list[Line]:
    """Every slope has one line that touches the concave hull: the best one of them, or pair of them."""
    edges = [fall for _, fall in hull_lines(curve) if fall > 0]
    falls = np.unique([0.0, *edges, *np.linspace(0.0, max(edges, default=0.0), _SLOPES)])
    corners = np.array(hull_points(curve))
    at_0 = np.max(corners[:, 1] + falls[:, None] * corners[:, 0], axis=1)
    usable = (at_0 <= MOST_KW) & (falls <= at_0)
    falls, at_0 = falls[usable], at_0[usable]
    told = np.minimum(most_kw(curve), at_0[:, None] - falls[:, None] * _SOC)
    real = power_kw(curve, _SOC)
    if count == 1:
        best = [int(np.argmin(((told - real) ** 2).sum(axis=1)))]
    else:
        errors = [((np.minimum(one, told) - real) ** 2).sum(axis=1) for one in told]
        best = sorted(np.unravel_index(np.argmin(errors), (len(falls), len(falls))))
    return [(float(at_0[k]), float(falls[k])) for k in dict.fromkeys(best)]


def _fit_mean(curve: Curve, count: int) -> list[Line]:
    """The flat limit less a_k max(SOC - hinge_k, 0): for every hinge, or pair of them, a linear least squares problem."""
    flat = most_kw(curve)
    missing = flat - power_kw(curve, _SOC)
    bends = np.maximum(_SOC - _HINGES[:, None], 0.0)
    gram, moment = bends @ bends.T, bends @ missing
    steepest = np.minimum(flat / (1 - _HINGES), np.divide(MOST_KW - flat, _HINGES, where=_HINGES > 0, out=np.full(99, np.inf)))
    one = np.clip(moment / gram.diagonal(), 0.0, steepest)
    error = one * (one * gram.diagonal() - 2 * moment)
    best = int(np.argmin(error))
    if count == 2:
        pair = _best_pair(flat, gram, moment)
        if pair is not None and pair[0] < error[best]:
            return _lines(flat, *pair[1:])
    return _lines(flat, [best], [float(one[best])])


def _best_pair(flat: float, gram: np.ndarray, moment: np.ndarray) -> tuple[float, list[int], list[float]] | None:
    """Error, hinges and bends of the best two lines; None where no pair gives lines that can be told."""
    i, j = np.triu_indices(_HINGES.size, 1)
    a, b, c = gram[i, i], gram[i, j], gram[j, j]
    determinant = a * c - b * b
    first = (c * moment[i] - b * moment[j]) / determinant
    second = (a * moment[j] - b * moment[i]) / determinant
    steep_at_0 = flat + first * _HINGES[i] + second * _HINGES[j]
    possible = (first > 0) & (second > 0) & (steep_at_0 <= MOST_KW) & (first + second <= steep_at_0)
    if not possible.any():
        return None
    error = np.where(possible, -(first * moment[i] + second * moment[j]), np.inf)
    k = int(np.argmin(error))
    return float(error[k]), [int(i[k]), int(j[k])], [float(first[k]), float(second[k])]


def _lines(flat: float, hinges: list[int], bends: list[float]) -> list[Line]:
    at_0, fall = flat, 0.0
    lines = []
    for hinge, bend in zip(hinges, bends, strict=True):
        at_0, fall = at_0 + bend * float(_HINGES[hinge]), fall + bend
        lines.append((at_0, fall))
    return lines


@dataclass(frozen=True)
class FitError:
    """Of what is told against the curve, over SOC 0 to 1. Shares are of the curve's greatest power, or of its mean."""

    rms_share: float
    worst_share: float
    above_share: float  # mean power promised and not taken
    below_share: float  # mean power that the station does not offer


def fit_error(curve: Curve, lines: tuple[Line, ...]) -> FitError:
    real = power_kw(curve, _SOC)
    gap = told_kw(curve, lines, _SOC) - real
    return FitError(
        float(np.sqrt((gap**2).mean()) / most_kw(curve)),
        float(np.abs(gap).max() / most_kw(curve)),
        float(np.maximum(gap, 0).mean() / real.mean()),
        float(np.maximum(-gap, 0).mean() / real.mean()),
    )


def told_lines(curve: Curve, pieces: int, fit: str = "mean") -> dict[str, float]:
    """The columns of a session that say what its vehicle tells."""
    lines = fit_lines(curve, pieces - 1, fit) or ((most_kw(curve), 0.0),)
    names = (("max_kw", "taper_kw"), ("second_max_kw", "second_taper_kw"))
    return {name: value for pair, line in zip(names, lines, strict=False) for name, value in zip(pair, line, strict=True)}


# ---- A day

# Our own choice, of a place on a main road: relative number of arrivals in each hour of the day.
HOURLY = (2, 1, 1, 1, 2, 4, 8, 11, 12, 12, 12, 13, 14, 14, 14, 14, 15, 16, 15, 13, 10, 8, 5, 3)
STAY_MIN = (20, 90)
SOC_ARRIVAL = (0.1, 0.6)
SOC_TARGET = (0.8, 1.0)


@lru_cache(maxsize=1)
def _vehicles() -> tuple[Vehicle, ...]:
    return tuple(read_vehicles())


def dc_day(
    seed: int, pieces: int = 3, cars: int = 200, connectors: int = 12, fit: str = "mean", cap_kw: float = 150.0
) -> list[Session]:
    """A day of fast charging, sorted by arrival; who finds all connectors taken drives on, and is no session.

    Curves are capped at `cap_kw`, what a connector can give, so that the clairvoyant bound knows of it. `cars` come at minutes drawn by HOURLY; each is one of the 113 vehicles, stays STAY_MIN minutes, and comes and wants to
    leave with a SOC of SOC_ARRIVAL and SOC_TARGET, all drawn uniformly. What is drawn depends on `seed` and `cars` alone.
    """
    rng = np.random.default_rng(seed)
    weight = np.repeat(np.array(HOURLY, dtype=float), 60)
    minutes = np.sort(rng.choice(weight.size, cars, p=weight / weight.sum()))
    vehicle_of = rng.integers(len(_vehicles()), size=cars)
    stays = rng.integers(STAY_MIN[0], STAY_MIN[1] + 1, cars)
    arrivals, targets = rng.uniform(*SOC_ARRIVAL, cars).round(3), rng.uniform(*SOC_TARGET, cars).round(3)
    sessions: list[Session] = []
    taken_until: list[int] = []
    for car in range(cars):
        minute = int(minutes[car])
        taken_until = [end for end in taken_until if end > minute]
        if len(taken_until) == connectors:
            continue
        taken_until.append(minute + int(stays[car]))
        vehicle = _vehicles()[vehicle_of[car]]
        curve = capped(vehicle.curve, cap_kw)
        sessions.append(Session(
            session_id=f"car-{car:03d}",
            arrival_s=60 * minute,
            departure_s=60 * taken_until[-1],
            battery_kwh=vehicle.battery_kwh,
            soc_arrival=float(arrivals[car]),
            soc_target=float(targets[car]),
            curve=curve,
            **told_lines(curve, pieces, fit),
        ))
    return sessions
