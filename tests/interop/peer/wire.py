"""Frames from the DBC, by own bit slicing, and end-to-end protection as docs/protocol.md words it."""

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import cantools

GATEWAY_NODE = 62
FUNCTIONS_WITHOUT_PROTECTION = (0x18, 0x19)  # ISO-TP
COUNTERS = 16
WINDOW, WINDOW_ERRORS = 5, 2
MOST_LOST = 3

GOLDEN_ID = 0x0C1
GOLDEN_LIST = "aa c1 4f 65 86 8f df d2 71 bd 8e 17 54 d6 1e 85"
GOLDEN_FRAMES = ("76 10 a0 00 06 0c 07 07", "67 0f 00 00 06 00 07 07")

# "Rounding" in docs/protocol.md; what is not named here goes to the nearest step.
ROUNDED_UP = {"current_l1", "current_l2", "current_l3", "voltage", "power", "max_current", "min_current", "peak_power",
              "target_soc", "minimum_soc", "target_energy", "maximum_energy", "minimum_energy"}
ROUNDED_DOWN = {"limit", "failsafe_limit", "session_energy", "taper_power"}


def _crc_table() -> list[int]:
    table = []
    for byte in range(256):
        for _ in range(8):
            byte = ((byte << 1) ^ 0x2F if byte & 0x80 else byte << 1) & 0xFF
        table.append(byte)
    return table


_CRC_TABLE = _crc_table()


def crc8_8h2f(data: bytes) -> int:
    crc = 0xFF
    for byte in data:
        crc = _CRC_TABLE[crc ^ byte]
    return crc ^ 0xFF


def data_id(can_id: int, counter: int) -> int:
    x = can_id << 4 | counter
    x ^= x >> 7
    x = x * 0x9E3779B1 & 0xFFFFFFFF
    x ^= x >> 15
    x = x * 0x85EBCA6B & 0xFFFFFFFF
    x ^= x >> 13
    return x >> 24


def frame_crc(can_id: int, data: bytes) -> int:
    return crc8_8h2f(bytes(data[1:8]) + bytes([data_id(can_id, data[1] & 0x0F)]))


def self_check() -> None:
    """Raises AssertionError unless the golden frames come out."""
    assert crc8_8h2f(b"123456789") == 0xDF, "CRC-8/8H2F"
    assert bytes(data_id(GOLDEN_ID, c) for c in range(COUNTERS)) == bytes.fromhex(GOLDEN_LIST), "DataIDList"
    for text in GOLDEN_FRAMES:
        data = bytes.fromhex(text)
        assert frame_crc(GOLDEN_ID, data) == data[0], f"golden frame {text}"


@dataclass
class Receiver:
    """Sorts the frames of one identifier."""
    counter: int | None = None
    errors: list[bool] = field(default_factory=list)

    def sort(self, can_id: int, data: bytes) -> tuple[str, int]:
        """What the frame is: "ok", "lost", "repeated", "sequence" or "crc"; and how many were lost before it."""
        if len(data) != 8 or frame_crc(can_id, data) != data[0]:
            self._remember(True)
            return "crc", 0
        counter = data[1] & 0x0F
        delta = 1 if self.counter is None else (counter - self.counter) % COUNTERS
        self.counter = counter
        if delta == 0:
            return "repeated", 0
        self._remember(delta > MOST_LOST)
        if delta > MOST_LOST:
            return "sequence", delta - 1
        return ("ok", 0) if delta == 1 else ("lost", delta - 1)

    def trusted(self) -> bool:
        return sum(self.errors) <= WINDOW_ERRORS

    def _remember(self, error: bool) -> None:
        self.errors = (self.errors + [error])[-WINDOW:]


@dataclass(frozen=True)
class Slot:
    """One signal: where it is and what its number means."""
    name: str
    start: int
    length: int
    signed: bool
    scale: float
    minimum: float
    maximum: float

    def read(self, word: int) -> float | int | None:
        """The physical value, or None where it is outside the DBC's range: that is how "absent" is told."""
        raw = word >> self.start & (1 << self.length) - 1
        if self.signed and raw >> (self.length - 1):
            raw -= 1 << self.length
        value = raw * self.scale
        return value if self.minimum - 1e-6 <= value <= self.maximum + 1e-6 else None

    def place(self, value: float | None) -> int:
        """The bits of a value; None is told as absent."""
        if value is None:
            raw = 1 << (self.length - 1) if self.signed else (1 << self.length) - 1
        else:
            raw = self._round(min(max(value, self.minimum), self.maximum) / self.scale)
        return (raw & (1 << self.length) - 1) << self.start

    def _round(self, steps: float) -> int:
        if self.name in ROUNDED_UP:
            return math.ceil(steps - 1e-6)
        if self.name in ROUNDED_DOWN:
            return math.floor(steps + 1e-6)
        return round(steps)


def _slot(signal) -> Slot:
    if signal.byte_order != "little_endian" or signal.offset != 0:
        raise ValueError(f"signal {signal.name}: only little endian without an offset is known here")
    bits = signal.length
    low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signal.is_signed else (0, (1 << bits) - 1)
    return Slot(signal.name, signal.start, bits, signal.is_signed, signal.scale,
                low * signal.scale if signal.minimum is None else signal.minimum,
                high * signal.scale if signal.maximum is None else signal.maximum)


def _shortened(dbc: str) -> str:
    """The messages alone, and of those that differ only in the node the first: cantools needs a second for all 791."""
    blocks = re.findall(r"^BO_ \d+ .*\n(?: SG_ .*\n)+", dbc, re.MULTILINE)
    first_of_function: dict[int, str] = {}
    for block in blocks:
        first_of_function.setdefault(int(block.split()[1]) >> 6, block)
    senders = sorted({name for block in first_of_function.values() for name in _nodes_of(block)})
    return "\n".join(['VERSION ""', f"BU_: {' '.join(senders)}", "", *first_of_function.values()])


def _nodes_of(block: str) -> set[str]:
    lines = block.splitlines()
    return {lines[0].split()[-1], *(node for line in lines[1:] for node in line.split('"')[-1].strip().split(","))}


class Wire:
    """All messages of the DBC, by function: every node has the same layout."""

    def __init__(self, dbc: str):
        self._slots: dict[str, dict[str, Slot]] = {}
        self.function: dict[str, int] = {}
        self.name: dict[int, str] = {}
        for message in cantools.database.load_string(_shortened(Path(dbc).read_text()), "dbc").messages:
            function = message.frame_id >> 6
            if function in self.name or function in FUNCTIONS_WITHOUT_PROTECTION:
                continue
            name = re.sub(r"_(\d\d|CTRL|GATEWAY)$", "", message.name)
            self.name[function] = name
            self.function[name] = function
            self._slots[name] = {signal.name: _slot(signal) for signal in message.signals}

    def can_id(self, name: str, node: int) -> int:
        return self.function[name] << 6 | node

    def read(self, name: str, data: bytes, *signals: str) -> list:
        """The physical values of the named signals."""
        word = int.from_bytes(data, "little")
        slots = self._slots[name]
        return [slots[signal].read(word) for signal in signals]

    def payload(self, name: str, values: dict) -> int:
        """A frame without its protection, as one number. Signals that are not given are 0."""
        slots = self._slots[name]
        word = 0
        for signal, value in values.items():
            word |= slots[signal].place(value)
        return word

    def frame(self, name: str, node: int, counter: int, values: dict) -> tuple[int, bytes]:
        """Identifier and bytes of a protected frame."""
        can_id = self.can_id(name, node)
        data = bytearray((self.payload(name, values) | counter << 8).to_bytes(8, "little"))
        data[0] = frame_crc(can_id, data)
        return can_id, bytes(data)
