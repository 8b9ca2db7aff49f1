"""The station bus for tools that listen: frames by name and node, their end-to-end check, candump's logs."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cantools

from taperlib.files import InputError, read_text

GATEWAY_NODE = 62
UNPROTECTED = ("ISOTP_TO", "ISOTP_FROM")
COUNTERS = 16
MOST_LOST = 3
ERROR_FLAG = 0x20000000
LONGEST_STANDARD_ID = 3  # hexadecimal digits
NODE_SUFFIX = re.compile(r"_(\d\d|CTRL|GATEWAY)$")
MESSAGE_LINE = re.compile(r"BO_ (\d+) ")
DETAIL_LINE = re.compile(r'(?:VAL_|BA_ "\w+" (?:BO_|SG_)) (\d+) .*;\s*$')  # comments may have more lines, and stay
LOG_LINE = re.compile(r"\((\d+\.\d+)\) (\S+) ([0-9A-Fa-f]{3,8})#(R?[0-9A-Fa-f]*)(?: [RT])?")

Value = float | int | str | None


@dataclass(frozen=True)
class Frame:
    """A classic data frame with an 11-bit identifier, or an error frame."""
    time_s: float
    can_id: int
    data: bytes
    is_error: bool = False


def _one_of_each(dbc: str) -> str:
    """The database with one message of each function, which is read ten times as fast as all."""
    kept: dict[int, int] = {}
    lines = []
    dropping = False
    for line in dbc.splitlines():
        match = MESSAGE_LINE.match(line)
        if match:
            can_id = int(match[1])
            dropping = kept.setdefault(can_id >> 6, can_id) != can_id
        elif not line.startswith(" SG_"):
            match = DETAIL_LINE.match(line)
            dropping = match is not None and int(match[1]) not in kept.values()
        if not dropping:
            lines.append(line)
    return "\n".join(lines)


class Database:
    """The DBC. All nodes of a function have the same layout, so one message stands for all."""

    def __init__(self, path: Path):
        try:
            messages = cantools.database.load_string(_one_of_each(read_text(path)), "dbc").messages
        except (cantools.database.Error, ValueError) as error:
            raise InputError(f"{path}: is not a CAN database: {str(error).splitlines()[0]}") from None
        self._of_function = {}
        self._of_name = {}
        for message in messages:
            name = NODE_SUFFIX.sub("", message.name)
            if name not in self._of_name:
                self._of_name[name] = message
                self._of_function[message.frame_id >> 6] = name

    def name_of(self, can_id: int) -> str | None:
        return self._of_function.get(can_id >> 6)

    def function_of(self, name: str) -> int:
        return self._of_name[name].frame_id >> 6

    def words_of(self, name: str, signal: str) -> dict[int, str]:
        """Names of a signal's values, as people write them."""
        choices = self._of_name[name].get_signal_by_name(signal).choices or {}
        return {value: str(word).replace("_", " ") for value, word in choices.items()}

    def decode(self, name: str, data: bytes) -> dict[str, Value]:
        """Physical values, words for values that have a name, and None for what is absent."""
        message = self._of_name[name]
        values: dict[str, Value] = {}
        for signal, value in message.decode(data, decode_choices=False).items():
            described = message.get_signal_by_name(signal)
            if described.choices and value in described.choices:
                values[signal] = str(described.choices[value]).replace("_", " ")
            else:
                values[signal] = value if _in_range(described, value) else None
        return values

    def encode(self, name: str, values: dict[str, float]) -> bytes:
        """A frame without its protection; signals that are not given are 0. For tests of tools."""
        message = self._of_name[name]
        return message.encode(dict.fromkeys((signal.name for signal in message.signals), 0) | values, strict=False)


def _in_range(signal, value: float) -> bool:
    step = abs(signal.scale) / 2
    above = signal.minimum is None or value > signal.minimum - step
    return above and (signal.maximum is None or value < signal.maximum + step)


def _crc_table() -> bytes:
    def remainder(byte: int) -> int:
        for _ in range(8):
            byte = (byte << 1 ^ 0x2F if byte & 0x80 else byte << 1) & 0xFF
        return byte
    return bytes(remainder(byte) for byte in range(256))


CRC_TABLE = _crc_table()


def _hidden_byte(can_id: int, counter: int) -> int:
    """Entry of the DataIDList, which is never sent."""
    word = can_id << 4 | counter
    word = (word ^ word >> 7) * 0x9E3779B1 & 0xFFFFFFFF
    word = (word ^ word >> 15) * 0x85EBCA6B & 0xFFFFFFFF
    return (word ^ word >> 13) >> 24


def checksum(can_id: int, data: bytes) -> int:
    """CRC-8/8H2F of a frame, as docs/protocol.md says."""
    crc = 0xFF
    for byte in data[1:8]:
        crc = CRC_TABLE[crc ^ byte]
    return CRC_TABLE[crc ^ _hidden_byte(can_id, data[1] & 0x0F)] ^ 0xFF


def protect(can_id: int, data: bytes, counter: int) -> bytes:
    """The frame with counter and CRC. For tests of tools."""
    frame = bytearray(data)
    frame[1] = frame[1] & 0xF0 | counter
    frame[0] = checksum(can_id, frame)
    return bytes(frame)


@dataclass
class Checks:
    """What the end-to-end check found, in frames."""
    crc_errors: int = 0
    repeated: int = 0
    lost: int = 0
    out_of_sequence: int = 0


class Receiver:
    """End-to-end check of all protected identifiers."""

    def __init__(self):
        self.checks = Checks()
        self._counter: dict[int, int] = {}

    def accepts(self, can_id: int, data: bytes) -> bool:
        """Whether the frame says something new. One out of sequence does, to an onlooker: he may have been away."""
        if len(data) != 8 or data[0] != checksum(can_id, data):
            self.checks.crc_errors += 1
            return False
        counter = data[1] & 0x0F
        delta = (counter - self._counter.get(can_id, counter - 1)) % COUNTERS
        self._counter[can_id] = counter
        if delta == 0:
            self.checks.repeated += 1
        elif delta > MOST_LOST:
            self.checks.out_of_sequence += 1
        else:
            self.checks.lost += delta - 1
        return delta != 0


def read_log(path: Path, interface: str | None) -> Iterator[Frame]:
    """Frames of a log of `candump -l` or `-L`, of one interface (the first that occurs). Raises InputError."""
    try:
        with path.open(encoding="ascii", errors="replace") as file:
            yield from _frames_of(path, file, interface)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None


def _frames_of(path: Path, lines: Iterator[str], interface: str | None) -> Iterator[Frame]:
    for number, line in enumerate(lines, 1):
        match = LOG_LINE.fullmatch(line.rstrip())
        if match is None or (len(match[4]) % 2 and not match[4].startswith("R")):
            if not line.endswith("\n"):
                return  # candump was ended in the middle of its last line
            raise InputError(f"{path}:{number}: not a line of candump -l: {line.strip()[:60]!r}")
        time_s, channel, can_id, data = float(match[1]), match[2], int(match[3], 16), match[4]
        interface = interface or channel
        if channel != interface:
            continue
        if len(match[3]) > LONGEST_STANDARD_ID:
            if can_id & ERROR_FLAG:
                yield Frame(time_s, 0, b"", is_error=True)
        elif not data.startswith("R"):
            yield Frame(time_s, can_id, bytes.fromhex(data))
