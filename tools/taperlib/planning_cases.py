"""Planning problems as data: read from what `taper-sim --problems` writes, or drawn at random by stated ranges."""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from pathlib import Path

from .files import InputError, read_text
from .planning_problem import Connector, Demand, Station, read_station

STATIONS = ("hub", "garage", "paper")
KINDS = ("empty", "saturated", "uneven", "nearly full")
LAMBDAS = (1.0, 10.0, 100.0)
SEED = 2022
PHASES_FIELD = 10  # of a demand


@dataclass(frozen=True)
class Case:
    """One planning instant. `limit_W` has all steps of the station, of which the first `horizon_steps` are planned."""

    name: str
    station: Station
    demands: dict[int, Demand]
    limit_W: list[int]
    lambda_per_kWh2: float
    horizon_steps: int
    time_ms: int = 0

    @property
    def planned(self) -> Station:
        return replace(self.station, steps=self.horizon_steps)


# ---- Recorded


@dataclass
class _Recording:
    """What the lines so far have said."""

    station: Station | None = None
    lambda_per_kWh2: float = 0.0
    horizon_steps: int = 0
    time_ms: int = 0


def _demand(fields: list[int]) -> tuple[int, Demand]:
    connector, _, stored_Wh, capacity_Wh, need_Wh, peak_W, taper_W, max_mA, _, departs_in_s = fields[:PHASES_FIELD]
    conductors = fields[PHASES_FIELD].bit_count() if len(fields) > PHASES_FIELD else None
    return connector, Demand(stored_Wh, capacity_Wh, need_Wh, peak_W, taper_W, departs_in_s, conductors, max_mA)


def _begin(recording: _Recording, word: str, fields: list[str]) -> None:
    if word == "station":
        recording.station = read_station(fields[0])
        recording.horizon_steps = recording.station.steps
    elif word == "planning":
        _, lambda_milli, _, horizon = map(int, fields)
        recording.lambda_per_kWh2 = lambda_milli / 1000
        recording.horizon_steps = horizon or recording.station.steps
    elif word == "time":
        recording.time_ms = int(fields[0])
    else:
        raise ValueError(f"'{word}' is not known")


def read_problems(path: Path) -> list[Case]:
    """The problems of a run with vehicles, in order. Raises InputError that names file and line."""
    recording, cases = _Recording(), []
    demands: dict[int, Demand] = {}
    limit_W: list[int] = []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        word, *fields = line.split()
        try:
            if word == "limit":
                limit_W = list(map(int, fields))
            elif word == "demand":
                demands.update([_demand(list(map(int, fields)))])
            elif word == "solve":
                if demands:
                    cases.append(_case_of(recording, demands, limit_W))
                demands = {}
            else:
                _begin(recording, word, fields)
        except (ValueError, IndexError, AttributeError) as error:
            raise InputError(f"{path}, line {number}: cannot be used: {error}") from None
    return cases


def _case_of(recording: _Recording, demands: dict[int, Demand], limit_W: list[int]) -> Case:
    name = f"{recording.station.name} at {recording.time_ms / 3.6e6:.2f} h"
    return Case(name, recording.station, demands, limit_W, recording.lambda_per_kWh2, recording.horizon_steps,
                recording.time_ms)


def evenly(cases: int, count: int) -> list[int]:
    """The places of so many of them, or of all, from the first on."""
    count = min(count, cases)
    return [k * cases // count for k in range(count)]


# ---- Drawn


def _vehicle(rng: random.Random, connector: Connector, soc: tuple[float, float], need: tuple[float, float]) -> Demand:
    """`soc` and `need` are ranges: of the battery, and of what is missing of it."""
    capacity_Wh = rng.choice((8_000, 24_000, 40_000, 60_000, 82_000))
    stored_Wh = int(capacity_Wh * rng.uniform(*soc))
    peak_W = min(rng.choice((2_400, 3_700, 7_200, 11_000, 22_000)), round(connector.max_mA * connector.W_per_A / 1000))
    return Demand(
        stored_Wh=stored_Wh,
        capacity_Wh=capacity_Wh,
        need_Wh=max(50, int((capacity_Wh - stored_Wh) * rng.uniform(*need))),
        peak_W=peak_W,
        taper_W=int(peak_W * rng.uniform(0.1, 0.9)),
        departs_in_s=rng.randrange(900, 30_000),
    )


def _fleet(rng: random.Random, station: Station, kind: str) -> tuple[dict[int, Demand], float]:
    """Vehicles by connector, and the site's limit as a share of what they take at SOC 0."""
    slots = range(station.connectors)
    most = min(station.connectors, 60) if rng.random() < 0.8 else station.connectors
    if kind == "empty":
        chosen, soc, need, share = rng.sample(slots, rng.randint(1, 3)), (0.1, 0.9), (0.2, 1.0), rng.uniform(0.3, 1.5)
    elif kind == "saturated":
        chosen, soc, need, share = rng.sample(slots, most), (0.1, 0.6), (0.5, 1.0), rng.uniform(0.1, 0.4)
    elif kind == "uneven":
        count = rng.randint(max(most // 3, 2), most)
        chosen, soc, need, share = rng.sample(slots, count), (0.0, 0.95), (0.02, 1.0), rng.uniform(0.2, 1.0)
    else:
        count = rng.randint(max(most // 3, 2), most)
        chosen, soc, need, share = rng.sample(slots, count), (0.9, 0.995), (0.3, 1.0), rng.uniform(0.2, 1.0)
    demands = {i: _vehicle(rng, station.connector[i], soc, need) for i in sorted(chosen)}
    if kind == "nearly full":  # the taper is steep: little is left of the peak
        demands = {i: replace(d, taper_W=int(d.peak_W * rng.uniform(0.8, 1.0))) for i, d in demands.items()}
    return demands, share


def draw(number: int, seed: int = SEED) -> Case:
    """Problem `number` of a seed. 72 in a row have every station with every kind, each lambda, with taper and without."""
    rng = random.Random(f"{seed} {number}")
    name, kind = STATIONS[number % 3], KINDS[number % 4]
    block = number // 12
    weight, blind = LAMBDAS[block % 3], (number + block) % 2 == 1
    station = read_station(name)
    demands, share = _fleet(rng, station, kind)
    if blind:
        demands = {i: replace(d, taper_W=0) for i, d in demands.items()}
    limit_W = _course(rng, station, int(share * sum(d.peak_W for d in demands.values())))
    text = f"{number}: {name}, {kind}, lambda {weight:g}, {'without' if blind else 'with'} taper"
    return Case(text, station, demands, limit_W, weight, station.steps)


def _course(rng: random.Random, station: Station, limit_W: int) -> list[int]:
    """Constant, or in one case of four with a drop to a quarter from some step on."""
    drop = rng.randrange(2, station.steps) if rng.random() < 0.25 else station.steps
    return [limit_W if t < drop else limit_W // 4 for t in range(station.steps)]
