"""A full bus: the station with 60 connectors, its field at nominal rates, and a node that sends garbage."""

import random
import re
import signal
import socket
import struct
import subprocess
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from taperlib.canbus import UNPROTECTED, Database, Receiver, read_log

CONNECTORS = 60
PATIENCE_S = 30
PAUSE_S = 0.5  # with nobody sending, the station has taken all within this
BURST_S = 0.01
CHARGE = 1  # command of SETPOINT
COLUMNS = "session_id,connector,arrival_s,departure_s,battery_kwh,soc_arrival,soc_target,max_kw,taper_kw"
FRAME = struct.Struct("=IB3x8s")


def write_sessions(path: Path, max_kw: float) -> None:
    """A vehicle for each connector, all at once, that stays for hours and has much to charge."""
    rows = [f"van-{k},{k},0,{14_400 + 60 * k},{60 + k % 5 * 10},{0.2 + k % 7 * 0.05:.2f},0.9,{max_kw},2"
            for k in range(1, CONNECTORS + 1)]
    path.write_text("\n".join([COLUMNS, *rows, ""]))


def babble(interface: str, can_id: int, rate: float, seconds: float) -> int:
    """Send random bytes under one identifier, `rate` frames a second in bursts. Returns how many were sent."""
    chance = random.Random(can_id)
    sent = 0
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as can:
        can.bind((interface,))
        began = time.monotonic()
        while (passed := time.monotonic() - began) < seconds:
            for _ in range(min(int(passed * rate) - sent, int(rate * BURST_S * 4))):
                can.send(FRAME.pack(can_id, 8, chance.randbytes(8)))
                sent += 1
            time.sleep(BURST_S)
    return sent


@dataclass
class Heard:
    """What candump's record tells of the bus while the station ran."""
    seconds: float = 0.0
    broken: Counter = field(default_factory=Counter)  # by identifier: frames that the end-to-end check misses or refuses
    current_dA: dict[int, list[tuple[float, int]]] = field(default_factory=dict)  # by node: (time, current told)


class FullBus:
    """Station, field and candump, running. What has the identifier `strange_id`, garbage, candump leaves out."""

    def __init__(self, station: Path, field_program: Path, folder: Path, *, interface: str = "vcan0", max_kw: float = 22.0,
                 limit_kw: float = 400.0, strange_id: int = 0x7FF, options: tuple[str, ...] = ()):
        self.folder, self.interface = folder, interface
        self.frames = 0  # that all sent while the station ran; known when it has stopped
        write_sessions(folder / "sessions.csv", max_kw)
        self.candump = self._start("candump", "candump", "-L", "-r", "8000000", f"{interface},{strange_id:X}~7FF")
        time.sleep(0.5)
        self._frames_before = self._count_frames()
        self.station = self._start("station", station, "--can", interface, "--station", "depot", *options)
        self.field = self._start("field", field_program, "--can", interface, "--sessions", folder / "sessions.csv",
                                 "--limit-kw", limit_kw)

    def _start(self, name: str, *command: object) -> subprocess.Popen:
        with (self.folder / f"{name}.log").open("w") as output:
            return subprocess.Popen([str(part) for part in command], stdout=output, stderr=subprocess.STDOUT)

    def _count_frames(self) -> int:
        return int(Path(f"/sys/class/net/{self.interface}/statistics/tx_packets").read_text())

    def events(self) -> list[tuple[str, int]]:
        """(event, node) of the station's log, 0 for those about no node."""
        text = (self.folder / "station.log").read_text()
        found = re.findall(r"event=(\S+)(.*)", text)
        return [(name, int(node[1]) if (node := re.search(r" node=(\d+)", rest)) else 0) for name, rest in found]

    def wait_for(self, event: str, count: int = 1) -> None:
        """Until the station has told of an event so often; raises RuntimeError with its log if it does not."""
        end = time.monotonic() + PATIENCE_S
        while sum(name == event for name, _ in self.events()) < count:
            if time.monotonic() > end or self.station.poll() is not None:
                tail = "\n".join((self.folder / f"{name}.log").read_text()[-1500:] for name in ("station", "field"))
                raise RuntimeError(f"not {count} times event={event}:\n{tail}")
            time.sleep(0.1)

    def babbling(self, can_id: int, rate: float, seconds: float) -> threading.Thread:
        thread = threading.Thread(target=babble, args=(self.interface, can_id, rate, seconds))
        thread.start()
        return thread

    def stop_station(self) -> dict[str, str]:
        """The last summary. The field is held while the station takes what is there, and then goes on alone."""
        self.field.send_signal(signal.SIGSTOP)
        time.sleep(PAUSE_S)
        self.station.terminate()
        self.station.wait(PATIENCE_S)
        self.frames = self._count_frames() - self._frames_before
        self.field.send_signal(signal.SIGCONT)
        summary = [line for line in (self.folder / "station.log").read_text().splitlines() if "event=summary" in line]
        return dict(re.findall(r"(\w+)=(\S+)", summary[-1]))

    def stop(self) -> None:
        for process in (self.station, self.field, self.candump):
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
                process.send_signal(signal.SIGINT)
                process.wait(PATIENCE_S)

    def heard(self, dbc: Path) -> Heard:
        """The bus up to the station's last setpoint."""
        database = Database(dbc)
        setpoint = database.function_of("SETPOINT")
        frames = list(read_log(self.folder / "candump.log", self.interface))
        last = max(k for k, frame in enumerate(frames) if frame.can_id >> 6 == setpoint)
        heard = Heard(seconds=frames[last].time_s - frames[0].time_s)
        receivers: dict[int, Receiver] = {}
        for frame in frames[:last + 1]:
            if frame.can_id >> 6 == setpoint:
                told = int.from_bytes(frame.data[2:4], "little") if frame.data[1] >> 4 == CHARGE else 0
                heard.current_dA.setdefault(frame.can_id & 63, []).append((frame.time_s, told))
            if database.name_of(frame.can_id) not in UNPROTECTED:
                receivers.setdefault(frame.can_id, Receiver()).accepts(frame.can_id, frame.data)
        for can_id, receiver in receivers.items():
            checks = receiver.checks
            heard.broken[can_id] = checks.crc_errors + checks.repeated + checks.lost + checks.out_of_sequence
        return heard
