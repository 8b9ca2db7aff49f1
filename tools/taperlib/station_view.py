"""A station as its bus shows it: frames in, rows for people out. Knows no terminal and no interface."""

from collections import OrderedDict
from dataclasses import asdict, dataclass, field

from taperlib.canbus import GATEWAY_NODE, UNPROTECTED, Database, Frame, Receiver

EVSE_STATUS_TIMEOUT_S = 1.0
CTRL_STATUS_TIMEOUT_S = 3.0
SITE_LIMIT_TIMEOUT_S = 5.0
PLAN_TIMEOUT_S = 90.0  # PLAN and OUTLOOK, round robin: with sixty connectors each is told once a minute
ECHO_TIME_S = 0.5  # for a connector to echo a new setpoint
RATE_WINDOW_S = 5
MOST_EMCY = 20
MINUTES_MODULO = 65535
NOMINAL_V = 230.0
NEARLY = 0.97
PARAMETERS = ("EV_PARAM_A", "EV_PARAM_B", "EV_PARAM_C")
STATES = {"A": "free", "B": "plugged", "C": "ready", "D": "ready, vent", "E": "no supply", "F": "fault"}


@dataclass
class Station:
    """What concerns all connectors. None: not heard."""
    mode: str = "not heard"
    limit_kw: float | None = None
    limit_source: str | None = None
    gateway: str = "not heard"
    failsafe_kw: float | None = None
    setpoints_kw: float = 0.0
    measured_kw: float = 0.0
    active: int | None = None
    waiting: int | None = None
    plan_version: int | None = None
    verdict: str | None = None
    iterations: int | None = None
    clock_unix_s: float | None = None
    clock_quality: int | None = None
    other_load_a: list[float | None] | None = None


@dataclass
class Connector:
    """One row. None: absent, or not heard."""
    node: int
    state: str
    online: bool
    vehicle: bool
    reason: str
    reason_told: bool
    phases: int = 3
    session: int | None = None
    soc_percent: float | None = None
    soc_age_s: float | None = None
    target_percent: float | None = None
    need_kwh: float | None = None
    departure_unix_s: float | None = None
    command: str | None = None
    setpoint_a: float | None = None
    fallback_a: float | None = None
    validity_left_s: float | None = None
    measured_a: list[float | None] = field(default_factory=list)
    power_kw: float | None = None
    energy_kwh: float | None = None
    echo_ok: bool | None = None
    planned_kw: float | None = None
    waiting_place: int | None = None
    waiting_of: int | None = None
    soc_estimated: bool = False
    expected_soc_percent: float | None = None
    short_kwh: float | None = None
    because: str | None = None


@dataclass
class Emergency:
    """EMCY frames of one kind, from one node, about one thing."""
    first_s: float
    last_s: float
    frames: int
    node: int
    severity: str
    what: str
    about: int
    session: int
    reaction: str
    data: int


@dataclass
class Bus:
    frames: int = 0
    frames_per_s: float = 0.0
    error_frames: int = 0
    unknown: int = 0
    crc_errors: int = 0
    repeated: int = 0
    lost: int = 0
    out_of_sequence: int = 0


class StationView:
    """Keeps the newest sound frame of each kind and node; decodes when somebody looks."""

    def __init__(self, database: Database):
        self.database = database
        self.emergencies: OrderedDict[tuple, Emergency] = OrderedDict()
        self.counters: dict[str, int] = {}
        self._newest: dict[tuple[str, int], tuple[float, bytes]] = {}
        self._parameters: dict[int, dict[str, bytes]] = {}
        self._receiver = Receiver()
        self._frames = self._error_frames = self._unknown = 0
        self._of_second: OrderedDict[int, int] = OrderedDict()
        self._counter_words = database.words_of("CTRL_DIAG", "index")

    # ---- Frames in

    def hear(self, frame: Frame) -> None:
        if frame.is_error:
            self._error_frames += 1
            return
        self._count(frame.time_s)
        name, node = self.database.name_of(frame.can_id), frame.can_id & 0x3F
        if name is None:
            self._unknown += 1
        elif name not in UNPROTECTED and self._receiver.accepts(frame.can_id, frame.data):
            self._newest[name, node] = (frame.time_s, frame.data)
            if name in PARAMETERS:
                self._take_parameters(node)
            elif name == "EVSE_STATUS":
                self._forget_departed(node, frame.data)
            elif name == "EMCY":
                self._take_emergency(frame.time_s, node, frame.data)
            elif name == "CTRL_DIAG":
                values = self.database.decode(name, frame.data)
                self.counters[values["index"]] = values["value"]

    def _count(self, time_s: float) -> None:
        self._frames += 1
        second = int(time_s)
        self._of_second[second] = self._of_second.get(second, 0) + 1
        while len(self._of_second) > RATE_WINDOW_S + 1:
            self._of_second.popitem(last=False)

    def _take_parameters(self, node: int) -> None:
        """A set counts once A, B and C have one revision, and A and B one session."""
        frames = [self._newest.get((name, node)) for name in PARAMETERS]
        if None in frames or len({data[1] >> 4 for _, data in frames}) > 1:
            return
        decoded = [self.database.decode(name, data) for name, (_, data) in zip(PARAMETERS, frames)]
        if decoded[0]["session"] == decoded[1]["session"]:
            self._parameters[node] = decoded[1] | decoded[2] | decoded[0]

    def _forget_departed(self, node: int, data: bytes) -> None:
        if node in self._parameters and not _has_vehicle(self.database.decode("EVSE_STATUS", data)):
            for name in (*PARAMETERS, "PLAN", "OUTLOOK"):
                self._newest.pop((name, node), None)
            del self._parameters[node]

    def _take_emergency(self, time_s: float, node: int, data: bytes) -> None:
        values = self.database.decode("EMCY", data)
        key = (node, *(values[name] for name in ("code", "about", "session", "data")))
        entry = self.emergencies.get(key)
        if entry is None:
            code = values["code"]
            what = code if isinstance(code, str) else f"code {code}"
            if what == "mode":
                what = f"mode {self.database.words_of('CTRL_STATUS', 'mode').get(values['data'], values['data'])}"
            reaction = values["reaction"]
            entry = self.emergencies[key] = Emergency(
                time_s, time_s, 0, node, str(values["severity"]), what, values["about"], values["session"],
                reaction if isinstance(reaction, str) else f"reaction {reaction}", values["data"])
        entry.last_s = time_s
        entry.frames += 1
        self.emergencies.move_to_end(key)
        while len(self.emergencies) > MOST_EMCY:
            self.emergencies.popitem(last=False)

    # ---- Rows out

    def _values(self, name: str, node: int, now_s: float, timeout_s: float = float("inf")) -> dict:
        """The newest frame, decoded; empty if there is none, or none young enough."""
        time_s, data = self._newest.get((name, node), (0.0, None))
        if data is None or now_s - time_s > timeout_s:
            return {}
        return self.database.decode(name, data)

    def _age_s(self, name: str, node: int, now_s: float) -> float:
        return now_s - self._newest[name, node][0]

    def nodes(self) -> list[int]:
        return sorted({node for name, node in self._newest if name in ("EVSE_STATUS", "SETPOINT")})

    def station(self, now_s: float, connectors: list[Connector]) -> Station:
        station = Station()
        status = self._values("CTRL_STATUS", 0, now_s)
        if status:
            silent = self._age_s("CTRL_STATUS", 0, now_s) > CTRL_STATUS_TIMEOUT_S
            station.mode = "silent" if silent else str(status["mode"])
            station.limit_source = status["limit_source"]
            station.active, station.waiting = status["active"], status["waiting"]
            station.plan_version, station.verdict = status["plan_version"], status["solver_verdict"]
            station.iterations = status["iterations"]
        self._add_gateway(station, now_s)
        station.setpoints_kw = sum(self._setpoint_kw(row) for row in connectors)
        station.measured_kw = sum(row.power_kw or 0.0 for row in connectors if row.online)
        return station

    def _add_gateway(self, station: Station, now_s: float) -> None:
        limit = self._gateway("SITE_LIMIT", now_s)
        if limit:
            fresh = self._gateway("SITE_LIMIT", now_s, SITE_LIMIT_TIMEOUT_S)
            station.gateway = "silent" if not fresh else "limit" if limit["active"] else "no limit"
            station.failsafe_kw = _kilo(limit["failsafe_limit"])
            station.limit_kw = _kilo(limit["limit"]) if fresh and limit["active"] else None
        if station.limit_source == "failsafe":
            station.limit_kw = station.failsafe_kw
        clock = self._gateway("TIME_SYNC", now_s)
        if clock:
            station.clock_quality = clock["quality"]
            if clock["quality"]:
                station.clock_unix_s = clock["unix_time"] + (clock["millisecond"] or 0) / 1000
        meter = self._gateway("SITE_METER", now_s, 3.0)
        if meter:
            station.other_load_a = [meter[f"current_l{phase}"] for phase in (1, 2, 3)]

    def _gateway(self, name: str, now_s: float, timeout_s: float = float("inf")) -> dict:
        return self._values(name, GATEWAY_NODE, now_s, timeout_s)

    @staticmethod
    def _setpoint_kw(row: Connector) -> float:
        current_a = row.setpoint_a if row.validity_left_s else row.fallback_a
        return (current_a or 0.0) * row.phases * NOMINAL_V / 1000

    def connectors(self, now_s: float) -> list[Connector]:
        rows = [self._connector(node, now_s) for node in self.nodes()]
        station = self.station(now_s, rows)
        for row in rows:
            self._add_reason(row, station, now_s)
        return rows

    def _connector(self, node: int, now_s: float) -> Connector:
        status = self._values("EVSE_STATUS", node, now_s)
        online = bool(status) and self._age_s("EVSE_STATUS", node, now_s) <= EVSE_STATUS_TIMEOUT_S
        pilot = status.get("pilot_state")
        vehicle = _has_vehicle(status)
        state = STATES.get(pilot, "?") if online else "offline"
        if online and status["fault"]:
            state = "fault"
        elif online and status["fallback_active"] and vehicle:
            state = "fallback"
        row = Connector(node, state, online, vehicle, "", False)
        if status:
            row.phases = int(status["phases"]) or row.phases
            row.measured_a = [status[f"current_l{phase}"] for phase in (1, 2, 3)]
        self._add_setpoint(row, status, now_s)
        if vehicle:
            self._add_vehicle(row, now_s)
        return row

    def _add_setpoint(self, row: Connector, status: dict, now_s: float) -> None:
        setpoint = self._values("SETPOINT", row.node, now_s)
        if not setpoint:
            return
        age_s = self._age_s("SETPOINT", row.node, now_s)
        row.command = setpoint["command"]
        row.setpoint_a = setpoint["current"] if setpoint["command"] == "charge" else 0.0
        row.fallback_a = setpoint["fallback_current"]
        row.validity_left_s = max((setpoint["validity"] or 0.0) - age_s, 0.0)
        if row.online:
            behind = (setpoint["e2e_counter"] - status["setpoint_echo"]) % 16
            row.echo_ok = behind == 0 or (behind == 1 and age_s < ECHO_TIME_S)

    def _add_vehicle(self, row: Connector, now_s: float) -> None:
        report = self._values("EV_STATUS", row.node, now_s)
        meter = self._values("EVSE_ELEC", row.node, now_s)
        parameters = self._parameters.get(row.node, {})
        row.session = parameters.get("session")
        row.soc_percent = report.get("soc")
        if row.soc_percent is not None and report["soc_age"] is not None:
            row.soc_age_s = report["soc_age"] + self._age_s("EV_STATUS", row.node, now_s)
        row.power_kw, row.energy_kwh = _kilo(meter.get("power")), _kilo(meter.get("session_energy"))
        row.target_percent = parameters.get("target_soc")
        row.need_kwh = _need_kwh(row, parameters)
        row.departure_unix_s = self._departure(parameters.get("departure"), now_s)

    def _departure(self, minute: float | None, now_s: float) -> float | None:
        """Minutes modulo 65535, taken to be near the station's clock, or ours as long as that is not set."""
        if minute is None:
            return None
        clock = self._gateway("TIME_SYNC", now_s)
        near = int((clock["unix_time"] if clock.get("quality") else now_s) // 60)
        ahead = (int(minute) - near) % MINUTES_MODULO
        return 60.0 * (near + ahead - (MINUTES_MODULO if ahead > MINUTES_MODULO // 2 else 0))

    # ---- Why

    def _add_reason(self, row: Connector, station: Station, now_s: float) -> None:
        plan = self._values("PLAN", row.node, now_s, PLAN_TIMEOUT_S)
        outlook = self._values("OUTLOOK", row.node, now_s, PLAN_TIMEOUT_S)
        row.planned_kw = _kilo(plan.get("power_0")) if row.vehicle else None
        seen = self._seen_reason(row, now_s)
        if seen:
            row.reason = seen
        elif isinstance(outlook.get("reason"), str) and outlook["reason"] != "no vehicle":
            row.reason, row.reason_told = outlook["reason"], True
            _add_outlook(row, outlook)
        else:
            row.reason = self._inferred_reason(row, station, now_s)

    @staticmethod
    def _seen_reason(row: Connector, now_s: float) -> str | None:
        """What the connector itself shows, newer than any outlook."""
        if not row.online:
            return "offline"
        return None if row.vehicle else "no vehicle"

    def _inferred_reason(self, row: Connector, station: Station, now_s: float) -> str:
        report = self._values("EV_STATUS", row.node, now_s)
        info = self._values("EVSE_INFO", row.node, now_s)
        setpoint_a = row.setpoint_a or 0.0
        if row.state in ("fault", "no supply") or report.get("error"):
            return "fault"
        if report.get("complete"):
            return "complete"
        if report.get("stop_requested") or report.get("pause_requested"):
            return "vehicle pause"
        if row.node not in self._parameters:
            return "no parameters"
        if station.mode in ("init", "silent", "not heard"):
            return f"station {station.mode}"
        if setpoint_a == 0:
            return "waiting"
        for reason, limit_a in (("vehicle limit", report.get("max_current")),
                                ("connector limit", info.get("max_current"))):
            if limit_a is not None and setpoint_a >= NEARLY * limit_a:
                return reason
        full = station.limit_kw is not None and station.setpoints_kw >= NEARLY * station.limit_kw
        return "site limit" if full else "planned"

    # ---- The bus

    def bus(self, now_s: float) -> Bus:
        complete = [count for second, count in self._of_second.items() if now_s - RATE_WINDOW_S <= second < int(now_s)]
        rate = sum(complete) / len(complete) if complete else float(sum(self._of_second.values()))
        return Bus(self._frames, round(rate, 1), self._error_frames, self._unknown, **asdict(self._receiver.checks))

    def nonzero_counters(self) -> dict[str, int]:
        return {str(name): value for name, value in self.counters.items() if value}

    def as_dict(self, now_s: float) -> dict:
        """All of it, for JSON."""
        connectors = self.connectors(now_s)
        return {"time_s": round(now_s, 3), "station": _rounded(asdict(self.station(now_s, connectors))),
                "connectors": [_rounded(asdict(row)) for row in connectors], "counters": self.nonzero_counters(),
                "emcy": [asdict(entry) for entry in self.emergencies.values()], "bus": asdict(self.bus(now_s))}


def _has_vehicle(status: dict) -> bool:
    return bool(status.get("ev_present")) and status["pilot_state"] != "A"


def _add_outlook(row: Connector, outlook: dict) -> None:
    if outlook["waiting_place"]:
        row.waiting_place, row.waiting_of = outlook["waiting_place"], outlook["waiting_of"]
    row.soc_estimated = bool(outlook["soc_estimated"])
    row.expected_soc_percent = outlook["soc_at_departure"]
    row.short_kwh = _kilo(outlook["short_energy"])
    if row.short_kwh:
        row.because = str(outlook["because"])


def _kilo(value: float | None) -> float | None:
    return None if value is None else value / 1000


def _need_kwh(row: Connector, parameters: dict) -> float | None:
    """Energy still wanted: by what was asked for since plug-in, else by the target SOC."""
    target_wh, capacity_kwh = parameters.get("target_energy"), parameters.get("capacity")
    if target_wh is not None and row.energy_kwh is not None:
        return max(target_wh / 1000 - row.energy_kwh, 0.0)
    if None in (row.target_percent, row.soc_percent, capacity_kwh):
        return None
    return max((row.target_percent - row.soc_percent) / 100 * capacity_kwh, 0.0)


def _rounded(values: dict) -> dict:
    return {name: round(value, 3) if isinstance(value, float) else value for name, value in values.items()}
