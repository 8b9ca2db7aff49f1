"""The planning problem, stated once more from its mathematics and solved by another solver (Clarabel).

It shares nothing with the firmware: variables are power u and energy x (the firmware keeps the energies only), the
solver is an interior-point method, and the station is read from its TOML file.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from pathlib import Path

import clarabel
import numpy as np
import scipy.sparse as sp

STATIONS = Path(__file__).resolve().parents[2] / "codegen" / "stations"
DISCOUNT = 0.95
CURVATURE = 0.1
LESSER_PAIR = 0.733  # sqrt(3) - 1, as the firmware's rows have it: rounded up to a permille
BALANCED_ON_DELTA = 1.733  # sqrt(3), likewise


@dataclass(frozen=True)
class Demand:
    """One vehicle; the fields of the firmware's taper_demand_t that a plan depends on."""

    stored_Wh: int
    capacity_Wh: int
    need_Wh: int
    peak_W: int
    taper_W: int
    departs_in_s: int
    conductors: int | None = None  # in use, of a socket that has more
    max_mA: int | None = None  # what vehicle and connector allow; None: the connector's
    second_peak_W: int = 0  # of another line of the taper; 0: none
    second_taper_W: int = 0

    @property
    def lines(self) -> list[tuple[float, float]]:
        """Of the taper: power at the present charge [W], and its fall per Wh."""
        told = [(self.peak_W, self.taper_W), (self.second_peak_W, self.second_taper_W)]
        falls = [(peak_W, taper_W / self.capacity_Wh if self.capacity_Wh else 0.0) for peak_W, taper_W in told if peak_W]
        return [(max(peak_W - fall * self.stored_Wh, 0.0), fall) for peak_W, fall in falls] or [(0.0, 0.0)]


@dataclass(frozen=True)
class Group:
    members: frozenset[int]
    limit_W: float | None
    limit_A: float | None  # on each line
    delta_A: float | None  # on each line of the delta side, as the wye side has it
    imbalance_A: float | None  # between two lines


@dataclass(frozen=True)
class Connector:
    max_mA: int
    volts: float
    lines: tuple[int, ...]  # of the supply, 0..2: what its conductors are on
    between: bool  # the two lines
    efficiency: float | None  # of a converter on all lines

    @property
    def W_per_A(self) -> float:
        return self.volts * (1 if self.between or self.efficiency else len(self.lines))


@dataclass(frozen=True)
class Station:
    name: str
    steps: int
    step_s: int
    volts: float  # line to neutral
    connector: list[Connector]
    groups: list[Group]  # the site first

    @property
    def connectors(self) -> int:
        return len(self.connector)

    @property
    def base_W(self) -> float:
        return max(c.max_mA * c.W_per_A for c in self.connector) / 1000


def read_station(name: str, folder: Path = STATIONS) -> Station:
    data = tomllib.loads((folder / f"{name}.toml").read_text())
    owners = [run["group"] for run in data["connectors"] for _ in range(run["count"])]
    connectors = [_connector(run) for run in data["connectors"] for _ in range(run["count"])]
    parents = {group["name"]: group.get("parent") for group in data["groups"]}

    def hangs_below(owner: str | None, group: str) -> bool:
        while owner is not None:
            if owner == group:
                return True
            owner = parents[owner]
        return False

    volts = data["site"].get("voltage_V", 230)
    ordered = sorted(data["groups"], key=lambda group: group.get("parent") is not None)
    groups = [
        _group(group, frozenset(i for i, owner in enumerate(owners) if hangs_below(owner, group["name"])), volts)
        for group in ordered
    ]
    return Station(name, data["horizon"]["steps"], data["horizon"]["step_s"], volts, connectors, groups)


def _group(group: dict, members: frozenset[int], volts: float) -> Group:
    limit_W = group["limit_kW"] * 1000 if "limit_kW" in group else None
    delta_A = group["delta_side_A"] * group["delta_side_V"] / volts if "delta_side_A" in group else None
    return Group(members, limit_W, group.get("limit_A"), delta_A, group.get("imbalance_A"))


def _connector(run: dict) -> Connector:
    max_mA, volts = round(run["max_A"] * 1000), run["voltage_V"]
    if run["kind"] == "DC":
        return Connector(max_mA, volts, (0, 1, 2), False, run.get("efficiency", 0.95))
    three = run.get("rotation", "L1-L2-L3")
    wires = three if run["phases"] == 3 else run.get("between") or run.get("phase", "L1")
    return Connector(max_mA, volts, tuple(int(wire[1]) - 1 for wire in wires.split("-")), "between" in run, None)


@dataclass(frozen=True)
class Draw:
    """How a vehicle's current shows in the supply: on `lines`, or between two of them."""

    W_per_A: float
    supply_W_per_A: float
    share: float  # current on each line for 1 A
    lines: tuple[int, ...]
    between: bool

    @staticmethod
    def of(connector: Connector, conductors: int | None, volts: float) -> Draw:
        if connector.efficiency:
            supply_W = ceil(connector.volts / connector.efficiency)
            return Draw(connector.volts, supply_W, ceil(1000 * supply_W / (3 * volts)) / 1000, (0, 1, 2), False)
        lines = connector.lines[: conductors or len(connector.lines)]
        W_per_A = connector.volts * (1 if connector.between else len(lines))
        return Draw(W_per_A, W_per_A, 1.0, lines, connector.between)

    def on_line(self, line: int, lesser_first: bool) -> float:
        """In a bound of the current of a line. Between lines: one of the two pairs that end there counts less."""
        if line not in self.lines:
            return 0.0
        starts_here = self.between and {line, (line + 1) % 3} == set(self.lines)
        return LESSER_PAIR if self.between and starts_here == lesser_first else self.share

    def on_delta(self, line: int, second: bool) -> float:
        """In a bound of a line of the delta side, which carries what the wye's lines `line` and the one before differ by."""
        before, after = (line + 2) % 3, (line + 1) % 3
        ends = {line, before} & set(self.lines)
        if not self.between:
            return (0.0, 1.0, BALANCED_ON_DELTA)[len(ends)] * self.share
        if len(ends) == 2:
            return 2.0
        return float(set(self.lines) == ({after, before} if second else {line, after}))

    def difference(self, line: int) -> float:
        return float((line in self.lines) - ((line + 1) % 3 in self.lines))


class Problem:
    """Cost 1/2 z'Pz + c'z and rows R z <= b, E z = 0 over z = (u, x), per unit, for the vehicles that are there."""

    def __init__(
        self, station: Station, demands: dict[int, Demand], limit_W: list[int], phase_A: list[float] | None = None
    ):
        self.station, self.connectors = station, sorted(demands)
        count = len(self.connectors) * station.steps
        self._size, self._rows, self._bounds, self._dynamics = 2 * count, [], [], []
        self.quadratic, self.linear = np.zeros(2 * count), np.zeros(2 * count)
        self._draws = [Draw.of(station.connector[i], demands[i].conductors, station.volts) for i in self.connectors]
        self._power_share = np.array(limit_W) / max(*limit_W, 1)
        for chain, connector in enumerate(self.connectors):
            max_mA = demands[connector].max_mA
            allowed_mA = station.connector[connector].max_mA if max_mA is None else max_mA
            allowed_W = allowed_mA * self._draws[chain].W_per_A / 1000
            self._add_vehicle(chain, demands[connector], allowed_W)
        self.first_sum = len(self._rows)  # rows of R from here on are the sums of the feeder tree
        for number, group in enumerate(station.groups):
            self._add_power(group, limit_W if number == 0 else None)
            self._add_lines(group, phase_A if number == 0 else None)
            self._add_delta(group)
            self._add_imbalance(group)
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
        now_W = min(line_W for line_W, _ in demand.lines)
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
            for line_W, fall_per_Wh in demand.lines:
                slope = fall_per_Wh * step_s / 3600
                self._at_most({u: 1.0} | ({before: slope} if t else {}), line_W / base_W)
        self._at_most({self._x(chain, self.station.steps - 1): 1.0}, demand.need_Wh * 3600 / step_s / base_W)

    def _inside(self, group: Group) -> list[int]:
        return [chain for chain, connector in enumerate(self.connectors) if connector in group.members]

    def _add_power(self, group: Group, limit_W: list[int] | None) -> None:
        if group.limit_W is None:
            return
        row = {chain: self._draws[chain].supply_W_per_A / self._draws[chain].W_per_A for chain in self._inside(group)}
        for t in range(self.station.steps):
            self._add_sum(row, t, (group.limit_W if limit_W is None else min(limit_W[t], group.limit_W)))

    def _add_lines(self, group: Group, phase_A: list[float] | None) -> None:
        if group.limit_A is None:
            return
        for line in range(3):
            limit_A = group.limit_A if phase_A is None else min(group.limit_A, phase_A[line])
            for lesser_first in (False, True):
                self._add_current(group, lambda d, line=line, first=lesser_first: d.on_line(line, first), limit_A)

    def _add_delta(self, group: Group) -> None:
        if group.delta_A is None:
            return
        for line in range(3):
            for second in (False, True):
                self._add_current(group, lambda d, line=line, second=second: d.on_delta(line, second), group.delta_A)

    def _add_imbalance(self, group: Group) -> None:
        """Sockets on all lines do not count, even if a vehicle uses one of them: the plan leaves that to the allocator."""
        if group.imbalance_A is None:
            return
        for line in range(3):
            for sign in (1, -1):
                self._add_current(
                    group, lambda d, line=line, sign=sign: sign * d.difference(line), group.imbalance_A, skip_full=True
                )

    def _add_current(
        self, group: Group, weight: Callable[[Draw], float], limit_A: float, skip_full: bool = False
    ) -> None:
        inside = self._inside(group)
        if skip_full:
            inside = [chain for chain in inside if len(self.station.connector[self.connectors[chain]].lines) < 3]
        volts = self.station.volts  # current times this: like a power
        row = {chain: weight(self._draws[chain]) * volts / self._draws[chain].W_per_A for chain in inside}
        for t in range(self.station.steps):
            self._add_sum(row, t, limit_A * volts)

    def _add_sum(self, row: dict[int, float], t: int, bound: float) -> None:
        if row:
            self._at_most({self._u(chain, t): weight for chain, weight in row.items()}, bound / self.station.base_W)

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
