"""A hub that charges eight vehicles on vcan0, what can go wrong with it, and a record of the bus with the kernel's times.

The connectors are taper-ev's: they obey validity and fallback current. Connector 3 is a process of its own, which can be
held. The gateway is here, so that it can fall silent.
"""

import signal
import socket
import struct
import threading
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import can
from conftest import PATIENCE_S, program, wait_until
from street import CHARGE, CTRL_STATUS, EVSE_STATUS, GATEWAY, SETPOINT, SITE_LIMIT, TIME_SYNC, Bus, bits, is_sound

NODES = range(1, 9)
ALONE = 3  # the connector with a process of its own
W_PER_dA = 69  # 3 x 230 V x 0.1 A
LIMIT_W = 60_000
FAILSAFE_W = 11_000
FALLBACK_dA = 60
FALLBACKS = 2  # of 4.14 kW each: the failsafe limit has room for so many
FAILSAFE = 3  # mode
ABSENT = 0x8000
WORLD_S = 1_790_000_000
OLDEST_S = 30  # no frame is held back longer
COLUMNS = "session_id,connector,arrival_s,departure_s,battery_kwh,soc_arrival,soc_target,max_kw,taper_kw"


@dataclass(frozen=True)
class Frame:
    time_s: float  # the kernel's, as time.time()
    can_id: int
    data: bytes

    @property
    def function(self):
        return self.can_id >> 6

    @property
    def node(self):
        return self.can_id & 63

    def told_dA(self):
        """Of a SETPOINT: what it lets a vehicle draw."""
        return bits(self.data, 16, 16) if bits(self.data, 12, 4) == CHARGE else 0

    def fallback_dA(self):
        """Of a SETPOINT: what it lets a vehicle draw once it has expired."""
        return bits(self.data, 40, 8) * 5

    def current_dA(self):
        """Of EVSE_STATUS: what the vehicle draws on the first phase."""
        return bits(self.data, 16, 12)

    def has_fallen_back(self):
        """Of EVSE_STATUS."""
        return bits(self.data, 62, 1) == 1


class Recorder:
    """All frames on the interface. While that is down, it waits."""

    def __init__(self, interface):
        self.frames = []
        self._interface = interface
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        with can.Bus(self._interface, interface="socketcan") as bus:
            while not self._ended.is_set():
                try:
                    message = bus.recv(0.1)
                except can.CanOperationError:
                    time.sleep(0.02)
                    continue
                if message is not None and not message.is_error_frame:
                    self.frames.append(Frame(message.timestamp, message.arbitration_id, bytes(message.data)))

    def since(self, time_s, function, nodes=NODES):
        """Frames of one kind from a time on. A medium that delays frames hands on some with an older time."""
        found = []
        for frame in reversed(self.frames):
            if frame.time_s < time_s - OLDEST_S:
                break
            if frame.time_s >= time_s and frame.function == function and frame.node in nodes:
                found.append(frame)
        return found[::-1]

    def last(self, function, node):
        return next(frame for frame in reversed(self.frames) if frame.can_id == function << 6 | node)

    def first(self, time_s, function, condition, what, nodes=NODES, timeout_s=PATIENCE_S):
        """The first frame from a time on that fulfils a condition; waits for it."""
        return wait_until(lambda: next((frame for frame in self.since(time_s, function, nodes) if condition(frame)), None),
                          what, timeout_s)

    def close(self):
        self._ended.set()
        self._thread.join(5)


class Gateway:
    """Clock and limit each second. `says`: "limit", "heartbeat" (without a limit) or nothing, None."""

    def __init__(self, interface):
        self.says = "limit"
        self._bus = Bus(interface)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        began_s = time.monotonic()
        while not self._ended.wait(1):
            if self.says is None:
                continue
            limit = LIMIT_W // 100 if self.says == "limit" else ABSENT
            with suppress(OSError):  # the interface is down, or its queue full
                self._bus.send(SITE_LIMIT, GATEWAY, (12, 1), (16, limit), (32, ABSENT), (48, 0xFF), (56, 5))
                self._bus.send(TIME_SYNC, GATEWAY, (16, WORLD_S + int(time.monotonic() - began_s)), (58, 1))

    def close(self):
        self._ended.set()
        self._thread.join(5)
        self._bus.close()


class Scene:
    """All of it. `start` starts a program in the background."""

    def __init__(self, start, folder):
        self._start = start
        rows = [f"car-{node},{node},{WORLD_S},{WORLD_S + 14_400},60,0.3,0.9,11,0" for node in NODES]
        self._sessions = folder / "sessions.csv"
        self._sessions.write_text("\n".join([COLUMNS, *rows, ""]))
        self.bus = Recorder("vcan0")
        self.gateway = Gateway("vcan0")
        self.alone = self._field(str(ALONE))
        self.others = self._field(f"1-{ALONE - 1},{ALONE + 1}-{max(NODES)}")
        self.station = self.start_station()

    def _field(self, connectors):
        return self._start(program("TAPER_EV"), "--can", "vcan0", "--station", "hub", "--no-gateway", "--stay",
                           "--connectors", connectors, "--sessions", self._sessions)

    def start_station(self):
        return self._start(program("TAPER_STATION"), "--can", "vcan0", "--station", "hub")

    def told_dA(self):
        """What every connector was told last."""
        return {node: self.bus.last(SETPOINT, node).told_dA() for node in NODES}

    def fallback_dA(self):
        """The fallback current that every connector was told last."""
        return {node: self.bus.last(SETPOINT, node).fallback_dA() for node in NODES}

    def current_dA(self):
        """What every vehicle draws."""
        return {node: self.bus.last(EVSE_STATUS, node).current_dA() for node in NODES}

    def wait_until_all_charge(self):
        """Until each has been told a current since the start: there is enough for all."""
        for node in NODES:
            self.bus.first(0, SETPOINT, lambda frame: frame.told_dA() > 0, f"charging of {node}", {node})

    def wait_until_charging(self, since_s=None):
        """Until vehicles draw after a time; not all of them need to, for who was paused stays so for minutes."""
        since_s = time.time() if since_s is None else since_s
        self.bus.first(since_s, EVSE_STATUS, lambda frame: frame.current_dA() > 0 and not frame.has_fallen_back(),
                       "current")

    def modes(self, since_s):
        return [(frame.time_s, bits(frame.data, 12, 4)) for frame in self.bus.since(since_s, CTRL_STATUS, {0})]

    def inject(self, can_id, data=bytes(8)):
        """A frame as it stands: an error frame, for one."""
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
            raw.bind(("vcan0",))
            raw.send(struct.pack("=IB3x8s", can_id, 8, data))

    @contextmanager
    def held(self, running):
        """A program that does nothing for a while."""
        running.process.send_signal(signal.SIGSTOP)
        try:
            yield
        finally:
            running.process.send_signal(signal.SIGCONT)

    def close(self):
        self.gateway.close()
        self.bus.close()


def all_sound(frames):
    return all(is_sound(frame.can_id, frame.data) for frame in frames)
