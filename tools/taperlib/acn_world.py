"""ACN-Sim (the simulator of `acnportal`) as an independent world: its Caltech network, days of sessions, and what a run gave.

acnportal 0.3.3 imports two packages that a simulation does not use: scikit-learn, for fitting its generator of events to data
from its server, and setuptools' pkg_resources, for the version in its JSON files. Where they are missing, empty modules
stand in for them; nothing here calls them.
"""

from __future__ import annotations

import importlib.util
import sys
import types
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

PERIOD_MIN = 5
PERIODS_PER_HOUR = 60 // PERIOD_MIN
PERIODS_PER_DAY = 24 * PERIODS_PER_HOUR
VOLTAGE_V = 208.0
TRANSITION_SOC = 0.8  # acnportal's Linear2StageBattery falls from here to nothing at SOC 1


def _stand_in_for_missing() -> None:
    for name, content in (("sklearn.mixture", {"GaussianMixture": object}), ("pkg_resources", {})):
        package = name.partition(".")[0]
        if package in sys.modules or importlib.util.find_spec(package) is not None:
            continue
        module = types.ModuleType(name)
        vars(module).update(content)
        sys.modules.setdefault(package, types.ModuleType(package))
        sys.modules[name] = module


_stand_in_for_missing()
with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # of its imports: what numpy and pandas say about old ways
    from acnportal.acnsim import EV, EventQueue, Linear2StageBattery, PluginEvent, Simulator
    from acnportal.acnsim.network import ChargingNetwork
    from acnportal.acnsim.network.sites import caltech_acn
    from acnportal import algorithms
    from acnportal.algorithms import BaseAlgorithm


@dataclass(frozen=True)
class Stay:
    """One session: whole periods, energies at the socket, a battery of two stages."""

    session_id: str
    station_id: str
    arrival: int
    departure: int
    request_kwh: float
    capacity_kwh: float
    initial_kwh: float
    max_kw: float


@dataclass(frozen=True)
class Violations:
    """Periods in which a constraint of the network did not hold, and by how much at most."""

    periods: int
    most_a: float


@dataclass(frozen=True)
class Outcome:
    """What one algorithm made of a day."""

    name: str
    delivered_kwh: float  # of what was requested: more than that does not count
    requested_kwh: float
    satisfied: int  # sessions that miss less than ACN-Sim's threshold of a full charge
    sessions: int
    peak_a: float  # greatest sum of all currents drawn
    utilisation: float  # greatest share of a constraint's limit that was drawn
    of_pilots: Violations
    of_rates: Violations
    call_ms: float  # median of the algorithm's calls
    slowest_ms: float

    @property
    def violations(self) -> int:
        return self.of_pilots.periods + self.of_rates.periods


FULL_KWH = 1e-3  # EV.fully_charged of acnportal


def network_of(basic: bool, transformer_kw: float) -> ChargingNetwork:
    """acnportal's Caltech network; `basic`: with continuous EVSEs instead of the real ones' steps."""
    return caltech_acn(basic_evse=basic, voltage=VOLTAGE_V, transformer_cap=transformer_kw)


# ---- Days


BATTERIES_KWH = (24.0, 30.0, 40.0, 50.0, 60.0, 75.0, 82.0, 100.0)
CHARGERS_KW = (3.3, 6.6, 6.6, 6.6)  # on board; a socket has 6.66 kW


def _free_station(stays: Sequence[Stay], stations: Sequence[str], arrival: int, random: np.random.RandomState) -> str | None:
    taken = {stay.station_id for stay in stays if stay.departure > arrival}
    free = [station for station in stations if station not in taken]
    return free[random.randint(len(free))] if free else None


def generated_day(stations: Sequence[str], cars: int, seed: int) -> list[Stay]:
    """
    A busy working day, drawn from the seed alone. Of the cars, 70 % come around 8:30 (deviation 1.2 h), the others around 13:00
    (2 h). They stay 5.5 h on average (2.5 h; 1 to 11 h), and want 14 kWh on average (gamma, 3 to 60 kWh), but no more than
    their charger could give in 90 % of the stay. The battery is one of those of at least 1.25 requests, the SOC at the target
    uniform in 0.7..0.98. Each takes a free socket at random; who finds none drives on.
    """
    random = np.random.RandomState(seed)  # its draws are the same in every version of numpy
    morning = random.random_sample(cars) < 0.7
    hours = np.where(morning, random.normal(8.5, 1.2, cars), random.normal(13.0, 2.0, cars))
    arrivals = np.sort(np.clip(hours, 5.0, 20.0) * PERIODS_PER_HOUR).astype(int)
    stays: list[Stay] = []
    for number, arrival in enumerate(arrivals.tolist()):
        periods = int(np.clip(random.normal(5.5, 2.5), 1.0, 11.0) * PERIODS_PER_HOUR)
        max_kw = CHARGERS_KW[random.randint(len(CHARGERS_KW))]
        most_kwh = 0.9 * max_kw * periods / PERIODS_PER_HOUR
        request_kwh = float(min(np.clip(random.gamma(2.0, 7.0), 3.0, 60.0), most_kwh))
        fitting = [kwh for kwh in BATTERIES_KWH if 1.25 * request_kwh <= kwh]
        capacity_kwh = fitting[random.randint(len(fitting))]
        target_kwh = max(random.uniform(0.7, 0.98) * capacity_kwh, request_kwh)
        station = _free_station(stays, stations, arrival, random)
        if station is not None:
            stays.append(Stay(f"car-{number:03d}", station, arrival, arrival + periods, request_kwh, capacity_kwh,
                              target_kwh - request_kwh, max_kw))
    return stays


def _plug_ins(stays: Sequence[Stay]) -> EventQueue:
    events = []
    for stay in stays:
        battery = Linear2StageBattery(stay.capacity_kwh, stay.initial_kwh, stay.max_kw, transition_soc=TRANSITION_SOC)
        car = EV(stay.arrival, stay.departure, stay.request_kwh, stay.station_id, stay.session_id, battery)
        events.append(PluginEvent(stay.arrival, car))
    return EventQueue(events)


# ---- Runs


def violations_of(network: ChargingNetwork, currents_a: np.ndarray) -> Violations:
    """By the network's own judgement of each period, [stations, periods]."""
    bad = [period for period in range(currents_a.shape[1]) if not network.is_feasible(currents_a[:, period : period + 1])]
    excess_a = np.abs(network.constraint_current(currents_a)) - network.magnitudes[:, np.newaxis]
    return Violations(len(bad), float(excess_a[:, bad].max()) if bad else 0.0)


def run(name: str, algorithm: BaseAlgorithm, network: ChargingNetwork, stays: Sequence[Stay]) -> Outcome:
    """Simulates the stays with fresh vehicles. The network keeps nothing of a run that has ended."""
    simulator = Simulator(network, algorithm, _plug_ins(stays), datetime(2019, 7, 15), period=PERIOD_MIN, verbose=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a schedule is not feasible: it is counted below
        simulator.run()
    return _outcome(name, algorithm, simulator)


def _outcome(name: str, algorithm: BaseAlgorithm, simulator: Simulator) -> Outcome:
    cars = list(simulator.ev_history.values())
    network, rates_a = simulator.network, simulator.charging_rates
    calls_ms = [1000 * call["solve_time"] for call in algorithm.solve_stats]
    shares = np.abs(network.constraint_current(rates_a)) / network.magnitudes[:, np.newaxis]
    return Outcome(
        name=name,
        delivered_kwh=float(sum(min(car.energy_delivered, car.requested_energy) for car in cars)),
        requested_kwh=float(sum(car.requested_energy for car in cars)),
        satisfied=int(sum(car.requested_energy - car.energy_delivered <= FULL_KWH for car in cars)),
        sessions=len(cars),
        peak_a=float(rates_a.sum(axis=0).max()),
        utilisation=float(shares.max()),
        of_pilots=violations_of(network, simulator.pilot_signals),
        of_rates=violations_of(network, rates_a),
        call_ms=float(np.median(calls_ms)),
        slowest_ms=max(calls_ms),
    )
