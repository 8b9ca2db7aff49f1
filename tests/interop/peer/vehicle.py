"""Vehicles with a plain battery: P = peak - taper x SOC, filled S times faster than the bus runs."""

import csv
from dataclasses import dataclass
from pathlib import Path

VOLTAGE_V = 230.0
MINUTES_MODULO = 65535


@dataclass
class Visit:
    """One session of one vehicle. Times are world seconds since the start of the run."""
    node: int
    arrival_s: float
    departure_s: float
    battery_kwh: float
    soc_arrival: float
    soc_target: float
    max_kw: float
    taper_kw: float
    phases: int = 3
    session: int = 0
    energy_kwh: float = 0.0

    @property
    def wanted_kwh(self) -> float:
        return (self.soc_target - self.soc_arrival) * self.battery_kwh

    @property
    def soc(self) -> float:
        return self.soc_arrival + self.energy_kwh / self.battery_kwh

    @property
    def complete(self) -> bool:
        return self.energy_kwh >= self.wanted_kwh - 1e-6

    def charge(self, current_A: float, world_s: float) -> float:
        """Draws at most `current_A` per phase for `world_s`; returns the mean power [W]."""
        if world_s <= 0:
            return 0.0
        limit_kw = min(current_A * self.phases * VOLTAGE_V / 1000, max(self.max_kw - self.taper_kw * self.soc, 0.0))
        hours = world_s / 3600
        added_kwh = max(min(limit_kw * hours, self.wanted_kwh - self.energy_kwh), 0.0)
        self.energy_kwh += added_kwh
        return added_kwh / hours * 1000

    def report(self) -> dict:
        return {"node": self.node, "session": self.session, "energy_kwh": round(self.energy_kwh, 3),
                "wanted_kwh": round(self.wanted_kwh, 3), "soc": round(self.soc, 4), "complete": self.complete}


def default_visits(nodes: list[int], world_s: float) -> list[Visit]:
    """Three kinds of vehicles, given to the nodes in turn; all within a run of `world_s`.

    One at 11 kW that is nearly full and tapers, one that takes 22 kW, and one that leaves and comes back.
    """
    visits = []
    for index, node in enumerate(nodes):
        start_s = (0.02 + 0.01 * index) * world_s
        if index % 3 == 0:
            visits.append(Visit(node, start_s, 0.9 * world_s, 40.0, 0.75, 1.0, 11.0, 9.0))
        elif index % 3 == 1:
            visits.append(Visit(node, start_s, 0.8 * world_s, 75.0, 0.2, 0.8, 22.0, 8.0))
        else:
            visits.append(Visit(node, start_s, 0.35 * world_s, 50.0, 0.3, 0.6, 11.0, 4.0))
            visits.append(Visit(node, 0.45 * world_s, 0.95 * world_s, 50.0, 0.4, 0.9, 11.0, 4.0))
    return visits


def read_visits(path: Path, nodes: list[int]) -> list[Visit]:
    """The rows of a sessions CSV (the columns that taper-sim reads, and optionally `phases`) for these nodes."""
    names = ("arrival_s", "departure_s", "battery_kwh", "soc_arrival", "soc_target", "max_kw", "taper_kw")
    visits = []
    with path.open(newline="", encoding="utf-8-sig") as file:
        for row in csv.DictReader(file):
            if row["connector"] and int(row["connector"]) in nodes:
                visits.append(Visit(int(row["connector"]), *(float(row[name]) for name in names),
                                    phases=int(row.get("phases") or 3)))
    return sorted(visits, key=lambda visit: visit.arrival_s)
