"""What every connector may draw at most, from the frames on the bus alone, against the limit in force.

A connector may have accepted any SETPOINT since the one it last echoed. So a higher current counts from the moment that
its SETPOINT is on the bus; a lower one when EVSE_STATUS.setpoint_echo confirms it, or when the older ones have expired.
An expired SETPOINT leaves its fallback current.
"""

from collections import deque
from dataclasses import asdict, dataclass, field

VOLTAGE_V = 230.0
GATEWAY_TIMEOUT_S = 5.0
TOLERANCE_W = 1.0
PHASES_OF_KIND = {0: 3, 1: 1, 2: 3, 3: 3}


@dataclass(frozen=True)
class Booked:
    """A SETPOINT that the connector may be following."""
    sequence: int
    current_A: float
    expires_s: float
    fallback_A: float

    def current_at(self, now_s: float) -> float:
        return self.current_A if now_s < self.expires_s else self.fallback_A

    def makes_idle(self, old: "Booked", now_s: float) -> bool:
        """Whether the older one can never again be what counts."""
        in_force = old.expires_s > now_s
        return self.fallback_A >= old.fallback_A and not (
            in_force and (old.current_A > self.current_A or old.expires_s > self.expires_s))


@dataclass
class Connector:
    """Bookings of one connector. Empty: it was never given anything, or has no vehicle."""
    booked: list[Booked] = field(default_factory=list)
    sequence: int = 0
    sequence_of_counter: dict[int, int] = field(default_factory=dict)
    echo: int | None = None
    vehicle: bool | None = None
    phases: int = 0
    kind: int = 0

    def setpoint(self, now_s: float, counter: int, current_A: float, validity_s: float, fallback_A: float) -> None:
        self.sequence += 1
        self.sequence_of_counter[counter] = self.sequence
        if self.vehicle is False:
            return
        new = Booked(self.sequence, current_A, now_s + validity_s, fallback_A)
        self.booked = [old for old in self.booked if not new.makes_idle(old, now_s)] + [new]

    def status(self, echo: int, vehicle: bool, phases: int) -> None:
        self.phases = phases
        self.vehicle = vehicle
        if not vehicle:
            self.booked.clear()
        if self.echo is not None and echo != self.echo:  # the same echo again confirms nothing new
            confirmed = self.sequence_of_counter.get(echo, 0)
            self.booked = [entry for entry in self.booked if entry.sequence >= confirmed]
        self.echo = echo

    def current_A(self, now_s: float) -> float:
        return max((entry.current_at(now_s) for entry in self.booked), default=0.0)

    def next_change_s(self, now_s: float) -> float:
        return min((entry.expires_s for entry in self.booked if entry.expires_s > now_s), default=float("inf"))

    def power_W(self, now_s: float) -> float:
        return self.current_A(now_s) * (self.phases or PHASES_OF_KIND[self.kind]) * VOLTAGE_V


class Limit:
    """The limit in force, with the time that a fall leaves to follow it."""

    def __init__(self, station_W: float, failsafe_W: float, grace_s: float):
        self.station_W, self.failsafe_W, self.grace_s = station_W, failsafe_W, grace_s
        self.present_W = min(station_W, failsafe_W)
        self.fresh_until_s: float | None = None
        self._earlier: deque[tuple[float, float]] = deque()  # (until when, what), all higher than the present one

    def heard(self, now_s: float, active: bool, limit_W: float | None, failsafe_W: float | None,
              validity_s: float | None) -> None:
        self.settle(now_s)
        if failsafe_W is not None:
            self.failsafe_W = max(failsafe_W, 0.0)
        if active and limit_W is None:
            return  # a sign of life only
        self.fresh_until_s = now_s + min(GATEWAY_TIMEOUT_S, GATEWAY_TIMEOUT_S if validity_s is None else validity_s)
        self._change(now_s, min(self.station_W, max(limit_W, 0.0)) if active else self.station_W)

    def settle(self, now_s: float) -> None:
        """Falls back to the failsafe limit when the gateway has been silent for too long."""
        if self.fresh_until_s is not None and now_s > self.fresh_until_s:
            silent_since_s, self.fresh_until_s = self.fresh_until_s, None
            self._change(silent_since_s, min(self.station_W, self.failsafe_W))

    def allowed_W(self, now_s: float) -> float:
        while self._earlier and self._earlier[0][0] < now_s - self.grace_s:
            self._earlier.popleft()
        return max([self.present_W, *(limit_W for _, limit_W in self._earlier)])

    def _change(self, at_s: float, limit_W: float) -> None:
        if limit_W < self.present_W:
            self._earlier.append((at_s, self.present_W))
        self.present_W = limit_W


@dataclass
class Violation:
    """One stretch of time in which more could be drawn than is allowed."""
    begin_s: float
    end_s: float
    frames: int
    excess_W: float
    allowed_W: float
    reason: str
    may_draw_A: dict[int, float]


class Account:
    """The sum over all connectors, checked at every frame."""

    def __init__(self, limit: Limit):
        self.limit = limit
        self.connectors: dict[int, Connector] = {}
        self.violations: list[Violation] = []
        self.worst_margin_W = float("inf")
        self._power_W: dict[int, float] = {}
        self._sum_W = 0.0
        self._sum_until_s = float("inf")
        self._violating = False

    def connector(self, node: int) -> Connector:
        """Whoever changes it says so with changed()."""
        return self.connectors.setdefault(node, Connector())

    def changed(self, now_s: float, node: int) -> None:
        connector = self.connectors[node]
        power_W = connector.power_W(now_s)
        self._sum_W += power_W - self._power_W.get(node, 0.0)
        self._power_W[node] = power_W
        self._sum_until_s = min(self._sum_until_s, connector.next_change_s(now_s))

    def may_draw_W(self, now_s: float) -> float:
        if now_s >= self._sum_until_s:
            self._power_W = {node: connector.power_W(now_s) for node, connector in self.connectors.items()}
            self._sum_W = sum(self._power_W.values())
            self._sum_until_s = min(connector.next_change_s(now_s) for connector in self.connectors.values())
        return self._sum_W

    def check(self, now_s: float, name: str, can_id: int, data: bytes) -> None:
        """The frame is the one that has just been heard; it stands in the reason."""
        self.limit.settle(now_s)
        allowed_W = self.limit.allowed_W(now_s)
        margin_W = allowed_W - self.may_draw_W(now_s)
        self.worst_margin_W = min(self.worst_margin_W, margin_W)
        if margin_W >= -TOLERANCE_W:
            self._violating = False
            return
        if not self._violating:
            self._violating = True
            amperes = {node: round(connector.current_A(now_s), 1) for node, connector in self.connectors.items()}
            reason = f"since {name} {can_id:03X} {bytes(data).hex(' ')}"
            self.violations.append(Violation(now_s, now_s, 0, 0.0, allowed_W, reason, amperes))
        present = self.violations[-1]
        present.end_s = now_s
        present.frames += 1
        present.excess_W = max(present.excess_W, -margin_W)

    def violations_as_dicts(self, origin_s: float) -> list[dict]:
        rows = [asdict(violation) for violation in self.violations]
        for row in rows:
            row["begin_s"] = round(row["begin_s"] - origin_s, 3)
            row["end_s"] = round(row["end_s"] - origin_s, 3)
            row["excess_W"] = round(row["excess_W"], 1)
        return rows
