"""The planning problem, stated once more from its mathematics and solved by another solver (Clarabel).

It shares nothing with the firmware: variables are power u and energy x (the firmware keeps the energies only), the
solver is an interior-point method, and the station is read from its TOML file.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import clarabel
import numpy as np
import scipy.sparse as sp

STATIONS = Path(__file__).resolve().parents[2] / "codegen" / "stations"
DISCOUNT = 0.95
CURVATURE = 0.1


@dataclass(frozen=True)
class Demand:
    """One vehicle; the fields of the firmware's taper_demand_t that a plan depends on."""

    stored_Wh: int
    capacity_Wh: int
    need_Wh: int
    peak_W: int
    taper_W: int
    departs_in_s: int


@dataclass(frozen=True)
class Group:
    limit_W: float
    members: frozenset[int]


@dataclass(frozen=True)
class Station:
    name: str
    steps: int
    step_s: int
    max_mA: list[int]
    W_per_A: list[int]
    groups: list[Group]  # the site first

    @property
    def connectors(self) -> int:
        return len(self.max_mA)

    @property
    def base_W(self) -> float:
        return max(a * w for a, w in zip(self.max_mA, self.W_per_A)) / 1000


def read_station(name: str) -> Station:
    data = tomllib.loads((STATIONS / f"{name}.toml").read_text())
    owners: list[str] = []
    max_mA: list[int] = []
    W_per_A: list[int] = []
    for run in data["connectors"]:
        owners += [run["group"]] * run["count"]
        max_mA += [round(run["max_A"] * 1000)] * run["count"]
        W_per_A += [run["voltage_V"] * run.get("phases", 1)] * run["count"]
    parents = {group["name"]: group.get("parent") for group in data["groups"]}

    def hangs_below(owner: str | None, group: str) -> bool:
        while owner is not None:
            if owner == group:
                return True
            owner = parents[owner]
        return False

    ordered = sorted(data["groups"], key=lambda group: group.get("parent") is not None)
    groups = [
        Group(group["limit_kW"] * 1000, frozenset(i for i, owner in enumerate(owners) if hangs_below(owner, group["name"])))
        for group in ordered
    ]
    return Station(name, data["horizon"]["steps"], data["horizon"]["step_s"], max_mA, W_per_A, groups)


class Problem:
    """Cost 1/2 z'Pz + c'z and rows R z <= b, E z = 0 over z = (u, x), per unit, for the vehicles that are there."""

    def __init__(self, station: Station, demands: dict[int, Demand], limit_W: list[int]):
        self.station, self.connectors = station, sorted(demands)
        count = len(self.connectors) * station.steps
        self._size, self._rows, self._bounds, self._dynamics = 2 * count, [], [], []
        self.quadratic, self.linear = np.zeros(2 * count), np.zeros(2 * count)
        self._power_share = np.array(limit_W) / max(*limit_W, 1)
        for chain, connector in enumerate(self.connectors):
            self._add_vehicle(chain, demands[connector], station.max_mA[connector] * station.W_per_A[connector] / 1000)
        self._add_sums(limit_W)
        self.R, self.b = self._matrix(self._rows), np.array(self._bounds)
        self.E = self._matrix(self._dynamics)

    def _u(self, chain: int, t: int) -> int:
        return chain * self.station.steps + t

    def _x(self, chain: int, t: int) -> int:
        return self._size // 2 + chain * self.station.steps + t

    def _at_most(self, row: dict[int, float], bound: float) -> None:
        self._rows.append(row)
        self._bounds.append(bound)

    def _weight(self, stay: float, charging: float) -> float:
        """Of a vehicle that stays, and has to charge, so many steps. A step of little power is part of one."""
        there = np.clip(stay - np.arange(self.station.steps), 0, 1)
        there[0] = 1
        useful = there @ self._power_share + max(stay - self.station.steps, 0)
        can = min(useful / charging, 1) if charging > 0 else 1
        return 1 + can**0.25 * (8 / max(useful, 1) + 3 / (max(useful - charging, 0) + 16))

    def _add_vehicle(self, chain: int, demand: Demand, connector_W: float) -> None:
        base_W, step_s = self.station.base_W, self.station.step_s
        fall_per_Wh = demand.taper_W / demand.capacity_Wh if demand.capacity_Wh else 0.0
        now_W = max(demand.peak_W - fall_per_Wh * demand.stored_Wh, 0.0)
        charging = demand.need_Wh * 3600 / min(now_W, connector_W) / step_s if now_W > 0 else 0.0
        weight = self._weight(demand.departs_in_s / step_s, charging)
        for t in range(self.station.steps):
            u, x, before = self._u(chain, t), self._x(chain, t), self._x(chain, t - 1)
            self.quadratic[u] = DISCOUNT ** (t + 1) * CURVATURE
            self.linear[u] = -weight * DISCOUNT ** (t + 1)
            there = 1.0 if t == 0 else min(max(demand.departs_in_s - t * step_s, 0), step_s) / step_s
            self._dynamics.append({x: 1.0, u: -1.0} | ({before: -1.0} if t else {}))
            self._at_most({u: -1.0}, 0.0)
            self._at_most({u: 1.0}, connector_W / base_W * there)
            slope = fall_per_Wh * step_s / 3600
            self._at_most({u: 1.0} | ({before: slope} if t else {}), now_W / base_W)
        self._at_most({self._x(chain, self.station.steps - 1): 1.0}, demand.need_Wh * 3600 / step_s / base_W)

    def _add_sums(self, limit_W: list[int]) -> None:
        for number, group in enumerate(self.station.groups):
            inside = [chain for chain, connector in enumerate(self.connectors) if connector in group.members]
            for t in range(self.station.steps):
                limit = min(limit_W[t], group.limit_W) if number == 0 else group.limit_W
                if inside:
                    self._at_most({self._u(chain, t): 1.0 for chain in inside}, limit / self.station.base_W)

    def _matrix(self, rows: list[dict[int, float]]) -> sp.csc_matrix:
        entries = [(r, c, v) for r, row in enumerate(rows) for c, v in row.items()]
        r, c, v = zip(*entries) if entries else ((), (), ())
        return sp.csc_matrix((v, (r, c)), shape=(len(rows), self._size))

    def least_cost(self) -> float:
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        solver = clarabel.DefaultSolver(
            sp.diags(self.quadratic, format="csc"), self.linear, sp.vstack([self.E, self.R], format="csc"),
            np.concatenate([np.zeros(self.E.shape[0]), self.b]),
            [clarabel.ZeroConeT(self.E.shape[0]), clarabel.NonnegativeConeT(self.R.shape[0])], settings,
        )
        solution = solver.solve()
        assert str(solution.status) == "Solved", solution.status
        return solution.obj_val

    def judge(self, power: np.ndarray) -> tuple[float, float]:
        """Cost of a plan [connectors x steps, per unit], and its worst excess over any row, relative to bounds above 1."""
        u = power[self.connectors]
        z = np.concatenate([u.ravel(), np.cumsum(u, axis=1).ravel()])
        excess = (self.R @ z - self.b) / np.maximum(np.abs(self.b), 1.0)
        return float(z @ (self.quadratic * z) / 2 + self.linear @ z), float(excess.max())
