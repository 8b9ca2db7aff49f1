"""A connector controller (EVSE) with its vehicle: obeys SETPOINT, tells the rest at its nominal periods."""

from .vehicle import MINUTES_MODULO, VOLTAGE_V, Visit
from .wire import Wire

PERIODS_S = {"EVSE_STATUS": 0.2, "EVSE_ELEC": 1.0, "EV_STATUS": 0.5, "EV_PARAM_A": 2.0, "EV_PARAM_B": 2.0,
             "EV_PARAM_C": 2.0, "EV_PARAM_D": 2.0, "EVSE_INFO": 5.0}
PARAMETERS = ("EV_PARAM_A", "EV_PARAM_B", "EV_PARAM_C", "EV_PARAM_D")
CHARGE, PAUSE = 1, 0
PILOT_A, PILOT_B, PILOT_C = 0, 1, 2
MAXIMUM_A, MINIMUM_A = 32.0, 6.0
PROTOCOL_VERSION, KIND_AC3, ROTATION_123 = 1, 2, 1
SESSIONS = 255  # numbered from 1; 0 says "none"


class Connector:
    def __init__(self, node: int, visits: list[Visit]):
        self.node = node
        self.visit: Visit | None = None
        self._visits = list(visits)
        self._session = 0
        self._echo = 0
        self._setpoint_A = self._fallback_A = 0.0
        self._expires_s: float | None = None
        self._fallback_active = False
        self._power_W = 0.0
        self._metered = (0.0, 0.0)  # time and SOC at the last EVSE_ELEC
        self._stepped_s: float | None = None
        self._counter: dict[str, int] = {}
        self._due_s: dict[str, float] = {}
        self._told: tuple | None = None
        self._departure_minute: int | None = None

    def on_setpoint(self, now_s: float, wire: Wire, data: bytes) -> bool:
        """Takes a SETPOINT that the protection has passed. Returns whether it was accepted."""
        command, current_A, validity_s, fallback_A, session = wire.read(
            "SETPOINT", data, "command", "current", "validity", "fallback_current", "session")
        if None in (command, current_A, validity_s, fallback_A):
            return False
        if command == CHARGE and (self.visit is None or session != self.visit.session):
            return False
        self._echo = data[1] & 0x0F
        self._setpoint_A = current_A if command == CHARGE else 0.0
        self._fallback_A = fallback_A if command in (CHARGE, PAUSE) else 0.0
        self._expires_s = now_s + validity_s
        self._fallback_active = False
        return True

    def step(self, now_s: float, world_s: float, time_scale: float, world_zero_unix_s: float | None) -> None:
        """Moves vehicle and battery on to `now_s`, which is `world_s` in the vehicle's world.

        `world_zero_unix_s` is the wall clock at world second 0; None: the clock was not heard yet.
        """
        elapsed_s = 0.0 if self._stepped_s is None else now_s - self._stepped_s
        self._stepped_s = now_s
        self._come_and_go(world_s, world_zero_unix_s)
        if self._expires_s is not None and now_s >= self._expires_s:
            self._setpoint_A, self._expires_s, self._fallback_active = self._fallback_A, None, True
        current_A = min(self._setpoint_A, MAXIMUM_A)
        if self.visit is None or current_A < MINIMUM_A:
            current_A = 0.0
        self._power_W = self.visit.charge(current_A, elapsed_s * time_scale) if self.visit else 0.0

    def due(self, wire: Wire, now_s: float) -> list[tuple[int, bytes]]:
        """The frames to send now."""
        frames = []
        for name, period_s in PERIODS_S.items():
            if name in PARAMETERS and self.visit is None:
                continue
            values = self._values(name, now_s)
            changed = name == "EVSE_STATUS" and self._news(values) != self._told
            if not changed and now_s < self._due_s.get(name, 0.0):
                continue
            if name == "EVSE_STATUS":
                self._told = self._news(values)
            elif name == "EVSE_ELEC":
                self._metered = (now_s, self.visit.soc if self.visit else 0.0)
            self._due_s[name] = now_s + period_s
            self._counter[name] = (self._counter.get(name, -1) + 1) % 16
            frames.append(wire.frame(name, self.node, self._counter[name], values))
        return frames

    @staticmethod
    def _news(values: dict) -> tuple:
        """What of EVSE_STATUS is sent at once; measured currents wait for the period."""
        return tuple(value for name, value in values.items() if not name.startswith("current_"))

    def _come_and_go(self, world_s: float, world_zero_unix_s: float | None) -> None:
        if self.visit is not None:
            if world_s >= self.visit.departure_s:
                self.visit = None
        elif self._visits and world_s >= self._visits[0].arrival_s:
            self.visit = self._visits.pop(0)
            self._session = self._session % SESSIONS + 1
            self.visit.session = self._session
            self._setpoint_A = self._fallback_A = 0.0  # what was told was for the vehicle before
            self._due_s["EVSE_ELEC"] = self._due_s["EV_STATUS"] = 0.0
            self._departure_minute = None
            if world_zero_unix_s is not None:
                self._departure_minute = int((world_zero_unix_s + self.visit.departure_s) // 60) % MINUTES_MODULO
            for name in PARAMETERS:
                self._due_s[name] = 0.0

    def _values(self, name: str, now_s: float) -> dict:
        if name in PARAMETERS:
            return self._parameters(name)
        if name == "EV_STATUS":
            return self._ev_status(now_s)
        return {"EVSE_STATUS": self._status, "EVSE_ELEC": self._elec, "EVSE_INFO": self._info}[name]()

    def _status(self) -> dict:
        visit = self.visit
        phases = visit.phases if visit else 3
        current_A = self._power_W / (phases * VOLTAGE_V)
        pilot = PILOT_A if visit is None else PILOT_B if visit.complete else PILOT_C
        return {"pilot_state": pilot, "current_l1": current_A, "current_l2": current_A if phases > 1 else 0.0,
                "current_l3": current_A if phases > 2 else 0.0, "contactor_closed": int(pilot == PILOT_C),
                "locked": int(visit is not None), "setpoint_echo": self._echo, "phases": phases,
                "fallback_active": int(self._fallback_active), "ev_present": int(visit is not None)}

    def _ev_status(self, now_s: float) -> dict:
        """The SOC is that of the last meter reading, with its age: sped up, half a second is several percent."""
        visit = self.visit
        metered_s, soc = self._metered
        if visit is None:
            return {"soc": None, "soc_age": None, "max_current": None, "time_to_target": None}
        most_A = min(visit.max_kw * 1000 / (visit.phases * VOLTAGE_V), MAXIMUM_A)
        return {"soc": soc * 100, "soc_age": int(now_s - metered_s), "max_current": most_A, "time_to_target": None,
                "complete": int(visit.complete), "ready": int(not visit.complete), "soc_source": 1}

    def _elec(self) -> dict:
        energy_Wh = self.visit.energy_kwh * 1000 if self.visit else 0.0
        return {"voltage": VOLTAGE_V, "power": self._power_W, "session_energy": energy_Wh}

    @staticmethod
    def _info() -> dict:
        return {"protocol_version": PROTOCOL_VERSION, "max_current": MAXIMUM_A, "min_current": MINIMUM_A,
                "kind": KIND_AC3, "rotation": ROTATION_123, "firmware": 0x0100}

    def _parameters(self, name: str) -> dict:
        visit = self.visit
        common = {"revision": visit.session % 16}
        if name == "EV_PARAM_A":
            return common | {"session": visit.session, "capacity": visit.battery_kwh,
                             "target_soc": visit.soc_target * 100, "minimum_soc": None,
                             "plug_in_soc": visit.soc_arrival * 100}
        if name == "EV_PARAM_B":
            return common | {"departure": self._departure_minute, "peak_power": visit.max_kw * 1000,
                             "min_current": MINIMUM_A, "session": visit.session}
        if name == "EV_PARAM_C":
            return common | {"target_energy": visit.wanted_kwh * 1000, "minimum_energy": None,
                             "maximum_energy": (1 - visit.soc_arrival) * visit.battery_kwh * 1000}
        return common | {"taper_power": visit.taper_kw * 1000, "session": visit.session}
