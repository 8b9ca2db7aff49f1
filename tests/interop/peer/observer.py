"""Everything that is heard on the bus, in its order: protection, the account, and what goes into the report."""

from collections import Counter

from .account import Account
from .wire import FUNCTIONS_WITHOUT_PROTECTION, GATEWAY_NODE, Receiver, Wire

COMMAND_CHARGE = 1
PILOT_STATES_WITHOUT_VEHICLE = (0,)
MOST_ERRORS_LISTED = 50
ERRORS = ("crc", "repeated", "sequence")


class Observer:
    def __init__(self, wire: Wire, account: Account):
        self.wire = wire
        self.account = account
        self.frames: Counter[str] = Counter()
        self.setpoints: Counter[int] = Counter()
        self.e2e: Counter[str] = Counter({"crc": 0, "repeated": 0, "sequence": 0, "lost": 0, "untrusted": 0})
        self.errors: list[dict] = []
        self.first_s: float | None = None
        self.last_s = 0.0
        self._receivers: dict[int, Receiver] = {}
        self._handlers = {"SETPOINT": self._setpoint, "EVSE_STATUS": self._status, "EVSE_INFO": self._info,
                          "SITE_LIMIT": self._site_limit}

    def hear(self, now_s: float, can_id: int, data: bytes) -> tuple[str, int] | None:
        """Takes one frame. Returns its name and node if it may be used."""
        self.first_s = now_s if self.first_s is None else self.first_s
        self.last_s = now_s
        function, node = can_id >> 6, can_id & 0x3F
        name = self.wire.name.get(function)
        self.frames[name or ("ISO_TP" if function in FUNCTIONS_WITHOUT_PROTECTION else "unknown")] += 1
        used = name is not None and self._sound(now_s, can_id, data)
        if used and name in self._handlers:
            self._handlers[name](now_s, node, data)
        self.account.check(now_s, name or "unknown", can_id, data)
        return (name, node) if used else None

    def _sound(self, now_s: float, can_id: int, data: bytes) -> bool:
        receiver = self._receivers.setdefault(can_id, Receiver())
        verdict, lost = receiver.sort(can_id, data)
        self.e2e["lost"] += lost
        if verdict in ERRORS:
            self.e2e[verdict] += 1
            if len(self.errors) < MOST_ERRORS_LISTED:
                self.errors.append({"time_s": round(now_s - self.first_s, 3), "id": f"{can_id:03X}", "what": verdict})
            return False
        if not receiver.trusted():
            self.e2e["untrusted"] += 1
            return False
        return True

    def _setpoint(self, now_s: float, node: int, data: bytes) -> None:
        command, current_A, validity_s, fallback_A = self.wire.read(
            "SETPOINT", data, "command", "current", "validity", "fallback_current")
        self.setpoints[node] += 1
        if None in (current_A, validity_s, fallback_A):
            return  # a connector refuses the whole frame
        self.account.connector(node).setpoint(now_s, data[1] & 0x0F, current_A if command == COMMAND_CHARGE else 0.0,
                                              validity_s, fallback_A)
        self.account.changed(now_s, node)

    def _status(self, now_s: float, node: int, data: bytes) -> None:
        pilot, echo, phases, present = self.wire.read(
            "EVSE_STATUS", data, "pilot_state", "setpoint_echo", "phases", "ev_present")
        if pilot is not None:
            vehicle = bool(present) and pilot not in PILOT_STATES_WITHOUT_VEHICLE
            self.account.connector(node).status(echo, vehicle, phases)
            self.account.changed(now_s, node)

    def _info(self, now_s: float, node: int, data: bytes) -> None:
        (kind,) = self.wire.read("EVSE_INFO", data, "kind")
        self.account.connector(node).kind = kind
        self.account.changed(now_s, node)

    def _site_limit(self, now_s: float, node: int, data: bytes) -> None:
        if node == GATEWAY_NODE:
            active, *numbers = self.wire.read("SITE_LIMIT", data, "active", "limit", "failsafe_limit", "validity")
            self.account.limit.heard(now_s, bool(active), *numbers)
