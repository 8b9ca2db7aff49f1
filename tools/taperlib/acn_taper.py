"""Taper as a scheduling algorithm of acnportal: a connector of Taper's station `caltech` for each EVSE of its Caltech network.

The station has the limits that the network has at the moment of registration, in mA, rounded down; a limit of power, which the
network has not, is set to what its lines can carry at most.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from taperlib.acn_world import PERIOD_MIN, BaseAlgorithm, ChargingNetwork
from taperlib.files import InputError
from taperlib.scheduler import DEFAULT_LIBRARY, Scheduler, Vehicle

STATION = "caltech"
LINES_OF_ANGLE = {30: 0b011, -90: 0b110, 150: 0b101}  # of a pair's voltage: L1-L2, L2-L3, L3-L1
GROUP_OF_POD = {"AV Pod": 1, "CC Pod": 2}
LINE_CONSTRAINTS = ("Secondary A", "Secondary B", "Secondary C")
DELTA_CONSTRAINTS = ("Primary A", "Primary B", "Primary C")
RATIO = 480 / 120  # of the transformer's windings: the network's "1/4"
OFFER_ABOVE_A = 2.0  # as firmware/allocator/include/taper/draw.h: what is offered beyond what is taken


def _limit(network: ChargingNetwork, names: tuple[str, ...]) -> float:
    return min(float(network.magnitudes[network.constraint_index.index(name)]) for name in names)


def _group_of(network: ChargingNetwork, station: int) -> int:
    for pod, group in GROUP_OF_POD.items():
        if network.constraint_matrix[network.constraint_index.index(pod), station] != 0:
            return group
    return 0


def connectors_of(network: ChargingNetwork, scheduler: Scheduler) -> dict[str, int]:
    """The connector of each EVSE: the next free one between the same lines and in the same group."""
    free = list(range(len(scheduler.connectors)))
    found: dict[str, int] = {}
    for index, station_id in enumerate(network.station_ids):
        wiring = (_group_of(network, index), LINES_OF_ANGLE.get(round(float(network._phase_angles[index]))))
        fitting = [i for i in free if (scheduler.connectors[i].group, scheduler.connectors[i].lines) == wiring]
        if not fitting:
            raise InputError(f"station {STATION}: has no connector left for EVSE {station_id} on group and lines {wiring}")
        found[station_id] = fitting[0]
        free.remove(fitting[0])
    return found


def set_limits(network: ChargingNetwork, scheduler: Scheduler) -> None:
    line_a = _limit(network, LINE_CONSTRAINTS)
    most_kw = math.ceil(math.sqrt(3) * 208 * line_a / 100) / 10  # of the three lines, balanced
    scheduler.set_group(0, limit_kw=most_kw, line_a=line_a, delta_a=RATIO * _limit(network, DELTA_CONSTRAINTS))
    for pod, group in GROUP_OF_POD.items():
        scheduler.set_group(group, line_a=_limit(network, (pod,)))


class TaperScheduling(BaseAlgorithm):
    """
    With `tells_soc` each vehicle tells what it would tell by CAN: capacity, energy stored, most power, and its taper's line.
    ACN-Sim's schedulers are not told that, so it is taken from the simulator's own battery. Without, Taper knows what the
    sorted algorithms know, request and departure; and what a vehicle leaves of its pilot, as the firmware does.
    """

    def __init__(self, *, policy: str = "soc-mpc", tells_soc: bool = True, library: Path = DEFAULT_LIBRARY,
                 **options: float | str | bool) -> None:
        super().__init__()
        self.max_recompute = 1
        self.tells_soc = tells_soc
        self.numbers: dict[str, int] = {}  # of sessions, in the order of coming
        self.caps_a: dict[str, float] = {}
        self.corrected = 0  # schedules that ACN-Sim would have refused; stays 0
        self.scheduler = Scheduler(STATION, policy=policy, period_s=60 * PERIOD_MIN, library=library, **options)

    def close(self) -> None:
        self.scheduler.close()

    def register_interface(self, interface) -> None:
        super().register_interface(interface)
        self.network: ChargingNetwork = interface._simulator.network
        set_limits(self.network, self.scheduler)
        self.connectors = connectors_of(self.network, self.scheduler)
        for station_id, connector in self.connectors.items():
            continuous, rates_a = interface.allowable_pilot_signals(station_id)
            self.scheduler.set_rates(connector, rates_a, continuous=continuous)

    def schedule(self, active_sessions) -> dict[str, list[float]]:
        for connector in self.connectors.values():
            self.scheduler.set_vehicle(connector, None)
        if not self.tells_soc:
            self._watch_draws()
        for session in active_sessions:
            self.scheduler.set_vehicle(self.connectors[session.station_id], self._vehicle(session))
        currents = self.scheduler.plan(60.0 * PERIOD_MIN * self.interface.current_time)
        pilots = {s.station_id: currents[self.connectors[s.station_id]].current_a for s in active_sessions}
        self._never_more_than_wanted(active_sessions, pilots)
        return {station_id: [pilot_a] for station_id, pilot_a in pilots.items()}

    def _vehicle(self, session) -> Vehicle:
        number = self.numbers.setdefault(session.session_id, len(self.numbers) + 1)
        departs_s = 60.0 * PERIOD_MIN * session.estimated_departure
        if not self.tells_soc:
            return Vehicle(number, session.remaining_demand, departs_s, max_a=self.caps_a.get(session.session_id, 0.0))
        battery = self.network.get_ev(session.station_id)._battery
        line_kw = battery._max_power / (1 - battery._transition_soc)
        return Vehicle(number, session.remaining_demand, departs_s, max_kw=battery._max_power,
                       capacity_kwh=battery._capacity, stored_kwh=battery._current_charge,
                       peak_kw=line_kw, taper_kw=line_kw)

    def _watch_draws(self) -> None:
        """Who takes less than his pilot is offered what he takes and 2 A more; all again once he comes close to that."""
        taken_a = self.interface.last_actual_charging_rate
        for session_id, pilot_a in self.interface.last_applied_pilot_signals.items():
            left_a = pilot_a - taken_a.get(session_id, 0.0)
            if left_a > OFFER_ABOVE_A:
                self.caps_a[session_id] = taken_a[session_id] + OFFER_ABOVE_A
            elif left_a < OFFER_ABOVE_A / 2:
                self.caps_a.pop(session_id, None)

    def _never_more_than_wanted(self, active_sessions, pilots: dict[str, float]) -> None:
        """
        Where pilots are continuous, the last one is exactly what is wanted: a setpoint has steps of 0.1 A. A smaller current on
        one pair of lines can be a greater one on the transformer's delta side, so the network is asked.
        """
        exact = dict(pilots)
        for session in active_sessions:
            if self.interface.allowable_pilot_signals(session.station_id)[0]:
                exact[session.station_id] = min(exact[session.station_id], self.interface.remaining_amp_periods(session))
        if self._is_feasible(exact):
            pilots.update(exact)
        elif not self._is_feasible(pilots):
            self.corrected += 1
            pilots.update(dict.fromkeys(pilots, 0.0))

    def _is_feasible(self, pilots: dict[str, float]) -> bool:
        return self.network.is_feasible(np.array([[pilots.get(name, 0.0)] for name in self.network.station_ids]))
