"""A station on the bus, made of frames by hand; for the tests of tools/monitor."""

import io

from rich.console import Console
from taperlib.canbus import Frame, protect
from taperlib.station_screen import screen
from taperlib.station_view import StationView

GATEWAY = 62
NOON_UNIX_S = 1_772_366_400  # 2026-03-01 12:00 UTC
DIAG_CRC_ERRORS, DIAG_PLANS = 3, 12
EVENT_CONNECTOR_LOST = 4
REASON_SITE_LIMIT, REASON_WAITING, REASON_HAND_OVER = 4, 6, 7
SOURCE_GATEWAY, SOURCE_FAILSAFE = 1, 3
MODE_PLAN, MODE_FAILSAFE = 1, 3


class Scene:
    """A view, and senders with their counters."""

    def __init__(self, database):
        self.database, self.view = database, StationView(database)
        self.now_s, self.counters, self.frames = 1000.0, {}, []

    def send(self, name, node, **values):
        can_id = self.database.function_of(name) << 6 | node
        counter = self.counters[name, node] = (self.counters.get((name, node), -1) + 1) % 16
        self.hear(can_id, protect(can_id, self.database.encode(name, values), counter))

    def hear(self, can_id, data):
        frame = Frame(self.now_s, can_id, data)
        self.frames.append(frame)
        self.view.hear(frame)

    def setpoint(self, node, current, command=1):
        self.send("SETPOINT", node, command=command, current=current, validity=3, fallback_current=0, phase_mask=7)

    def status(self, node, **values):
        echo = self.counters.get(("SETPOINT", node), 0)
        self.send("EVSE_STATUS", node, **{"pilot_state": 2, "ev_present": 1, "phases": 3, "setpoint_echo": echo,
                                          "current_l1": 15.5, "current_l2": 15.5, "current_l3": 15.5} | values)

    def vehicle(self, node, session=7, **values):
        self.send("EV_STATUS", node, **{"soc": 47.5, "soc_age": 2, "max_current": 32} | values)
        self.send("EVSE_ELEC", node, voltage=230, power=10_690, session_energy=4_000)
        self.send("EV_PARAM_A", node, session=session, capacity=60, target_soc=80, minimum_soc=0, plug_in_soc=40,
                  revision=session % 16)
        departure = (NOON_UNIX_S // 60 + 120) % 65535
        self.send("EV_PARAM_B", node, session=session, departure=departure, peak_power=22_000, min_current=6,
                  revision=session % 16)
        self.send("EV_PARAM_C", node, target_energy=24_000, maximum_energy=36_000, revision=session % 16)

    def controller(self, mode=MODE_PLAN, source=SOURCE_GATEWAY):
        self.send("CTRL_STATUS", 0, mode=mode, limit_source=source, solver_verdict=2, iterations=80, active=2,
                  waiting=1, plan_version=9)

    def gateway(self, limit_w=40_000):
        self.send("SITE_LIMIT", GATEWAY, active=1, limit=limit_w, failsafe_limit=11_000, validity=5)
        self.send("TIME_SYNC", GATEWAY, unix_time=NOON_UNIX_S, millisecond=0, quality=33)

    def row(self, node=1):
        return next(row for row in self.view.connectors(self.now_s) if row.node == node)

    @property
    def station(self):
        return self.view.station(self.now_s, self.view.connectors(self.now_s))

    def drawn(self, width, height=None):
        console = Console(file=io.StringIO(), width=width, force_terminal=False)
        console.print(screen(self.view, self.now_s, "vcan0", True, width, height))
        return console.file.getvalue()

    def save_log(self, path):
        path.write_text("".join(f"({frame.time_s:.6f}) vcan0 {frame.can_id:03X}#{frame.data.hex().upper()}\n"
                                for frame in self.frames))
        return path


def three_connectors(database):
    """Connector 1 charges, 2 waits, 3 is free; all were heard just now."""
    scene = Scene(database)
    scene.gateway()
    scene.controller()
    for node, current in ((1, 16.0), (2, 0.0)):
        scene.setpoint(node, current, command=int(current > 0))
        scene.status(node)
        scene.vehicle(node)
    scene.setpoint(3, 0, command=0)
    scene.status(3, pilot_state=0, ev_present=0, current_l1=0, current_l2=0, current_l3=0)
    return scene
