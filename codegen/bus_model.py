"""The station bus as bus.toml describes it, checked: what this module returns can be written as DBC and as C.

A mistake is told in one line, `bus.toml: MESSAGE.signal: reason`. Physical numbers (step, least, most) are kept in
thousandths, so that 0.1 is exact.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from toml_table import Table, load

FRAME_BITS = 64
PROTECTED_BITS = 12  # CRC and counter of a protected frame
NODE_BITS = 6
MILLI = 1000  # thousandths in one

# How many of the firmware's unit are one unit of the database.
C_UNITS = {("A", "mA"): 1000, ("V", "mV"): 1000, ("kWh", "Wh"): 1000, ("s", "ms"): 1000, ("%", "permille"): 10}
ROUNDINGS = ("down", "up", "nearest")
UNNAMED = ("refused", "unknown", "kept")
_INT32_MAX = 2**31 - 1


@dataclass(frozen=True)
class Node:
    """One node, or a range of equal ones. `c_name` is empty for what the firmware has no constant for."""

    name: str
    first: int
    last: int
    c_name: str
    comment: str

    def is_one(self) -> bool:
        return self.first == self.last


@dataclass(frozen=True)
class Code:
    name: str
    code: int
    comment: str


@dataclass(frozen=True)
class Values:
    """Named values. `prefix` begins the C names after TAPER_; `count` names the number of them, if there is a name."""

    name: str
    c_type: bool
    prefix: str
    count: str
    comment: str
    codes: tuple[Code, ...]


@dataclass(frozen=True)
class Signal:
    """`low`, `high` and `absent` are raw values; `coded`: the codec reads it and writes it."""

    name: str
    start: int
    length: int
    signed: bool
    step: int  # thousandths of the unit
    unit: str
    c_unit: str
    low: int
    high: int
    absent: int | None
    rounding: str
    values: Values | None
    unnamed: str
    coded: bool
    comment: str
    note: str

    @property
    def c_step(self) -> int:
        """Firmware units per raw count."""
        return self.step * C_UNITS.get((self.unit, self.c_unit), 1) // MILLI

    @property
    def absent_hex(self) -> str:
        """The absent code as it is on the wire."""
        assert self.absent is not None
        return f"0x{self.absent % (1 << self.length):X}"


@dataclass(frozen=True)
class Message:
    """`sender` and `receivers` are names of nodes, or "node": the one in the identifier."""

    name: str
    function: int
    nodes: tuple[Node, ...]
    sender: str
    receivers: tuple[str, ...]
    end_to_end: bool
    heartbeat: bool
    cycle_ms: int
    cycle_note: str
    timeout_ms: int
    timeout_note: str
    comment: str
    signals: tuple[Signal, ...]

    def identifier(self, node: int) -> int:
        return self.function << NODE_BITS | node

    def is_one(self) -> bool:
        """Whether there is only one identifier."""
        return len(self.nodes) == 1 and self.nodes[0].is_one()


@dataclass(frozen=True)
class Bus:
    protocol_version: int
    nodes: dict[str, Node]
    values: dict[str, Values]
    messages: tuple[Message, ...]


def read_bus(path: Path, shown: str | None = None) -> Bus:
    """The bus in the file at `path`; raises TomlError, whose text calls the file `shown`."""
    root = load(path, shown or path.name)
    version = root.integer("protocol_version", 0, 15)
    nodes = _nodes(root)
    values = {name: _values(name, table) for name, table in root.named("values").items()}
    messages = tuple(_message(name, table, nodes, values) for name, table in root.named("messages").items())
    root.end()
    bus = Bus(version, nodes, values, messages)
    _check_as_a_whole(root, bus)
    return bus


def _text(table: Table, key: str) -> str:
    """One line that fits into a DBC string, a C comment and a table of the documentation."""
    text = table.string(key, "")
    if not text.isprintable() or not text.isascii() or any(mark in text for mark in ('"', "*/", "/*", "|", "\\")):
        raise table.error(key, "must be one line of plain text without quotes, bars, backslashes and comment marks")
    return text


def _needed_text(table: Table, key: str) -> str:
    if not _text(table, key):
        raise table.error(key, "missing" if not table.has(key) else "is empty")
    return _text(table, key)


def _check_name(table: Table, name: str, pattern: str) -> None:
    if not re.fullmatch(pattern, name):
        raise table.error("", f'"{name}" is not a name here ({pattern})')


def _nodes(root: Table) -> dict[str, Node]:
    nodes: dict[str, Node] = {}
    for name, table in root.named("nodes").items():
        _check_name(table, name, "[A-Z][A-Z0-9]{0,15}")
        first = table.integer("first", 0, (1 << NODE_BITS) - 1)
        last = table.integer("last", first, (1 << NODE_BITS) - 1) if table.has("last") else first
        for other in nodes.values():
            if first <= other.last and other.first <= last:
                raise table.error("", f"has a number of {other.name}")
        nodes[name] = Node(name, first, last, table.string("c_name", ""), _needed_text(table, "comment"))
        table.end()
    return nodes


def _values(name: str, table: Table) -> Values:
    _check_name(table, name, "[a-z][a-z0-9_]*")
    c_type = table.boolean("c_type", True)
    prefix = table.string("prefix", name.upper())
    count = table.string("count", "")
    codes = tuple(_code(code_name, code) for code_name, code in table.named("codes").items())
    for index, code in enumerate(codes):
        if index > 0 and code.code <= codes[index - 1].code:
            raise table.error(code.name, f"code {code.code} is not above the one before it")
    if count and codes[-1].code != len(codes) - 1:
        raise table.error("count", "the codes do not count from 0 without a gap")
    values = Values(name, c_type, prefix, count, _needed_text(table, "comment"), codes)
    table.end()
    return values


def _code(name: str, table: Table) -> Code:
    _check_name(table, name, "[A-Za-z0-9][A-Za-z0-9_]*")
    code = Code(name, table.integer("code", 0, 0xFFFF), _text(table, "comment"))
    table.end()
    return code


def _message(name: str, table: Table, nodes: dict[str, Node], values: dict[str, Values]) -> Message:
    _check_name(table, name, "[A-Z][A-Z0-9_]{0,20}")
    end_to_end = table.boolean("end_to_end", True)
    signals = tuple(_signal(key, one, values) for key, one in table.named("signals").items())
    message = Message(
        name=name,
        function=table.integer("function", 0, 31),
        nodes=tuple(nodes[key] for key in _node_names(table, "nodes", nodes)),
        sender=table.string("sender"),
        receivers=_node_names(table, "receivers", {**nodes, "node": None}),
        end_to_end=end_to_end,
        heartbeat=table.boolean("heartbeat", False),
        cycle_ms=table.integer("cycle_ms", 1, 65535) if table.has("cycle_ms") else 0,
        cycle_note=_text(table, "cycle_note"),
        timeout_ms=table.integer("timeout_ms", 1, 65535) if table.has("timeout_ms") else 0,
        timeout_note=_text(table, "timeout_note"),
        comment=_needed_text(table, "comment"),
        signals=signals,
    )
    table.end()
    _check_sender(table, message, nodes)
    _check_layout(table, message)
    return message


def _node_names(table: Table, key: str, known: dict[str, Node] | dict[str, Node | None]) -> tuple[str, ...]:
    names = table.strings(key)
    for name in names:
        if name not in known:
            raise table.error(key, f'no node named "{name}"')
    return names


def _check_sender(table: Table, message: Message, nodes: dict[str, Node]) -> None:
    if message.sender == "node":
        return
    if message.sender not in nodes:
        raise table.error("sender", f'no node named "{message.sender}"')
    if not nodes[message.sender].is_one():
        raise table.error("sender", f'"{message.sender}" is more than one node; "node" is the one in the identifier')


def _check_layout(table: Table, message: Message) -> None:
    first = PROTECTED_BITS if message.end_to_end else 0
    owner: dict[int, str] = dict.fromkeys(range(first), "CRC and counter")
    for signal in message.signals:
        if signal.start + signal.length > FRAME_BITS:
            last = signal.start + signal.length - 1
            raise table.error(signal.name, f"ends at bit {last}, beyond bit {FRAME_BITS - 1}")
        for bit in range(signal.start, signal.start + signal.length):
            if bit in owner:
                raise table.error(signal.name, f"bit {bit} is already of {owner[bit]}")
            owner[bit] = signal.name


def _signal(name: str, table: Table, values: dict[str, Values]) -> Signal:
    _check_name(table, name, "[a-z][a-z0-9_]*")
    if name in ("e2e_crc", "e2e_counter"):
        raise table.error("", "is made for every protected message")
    start = table.integer("start", 0, FRAME_BITS - 1)
    length = table.integer("length", 1, FRAME_BITS) if table.has("length") else 1
    signed = table.boolean("signed", False)
    step = table.quantity("step", 1, 10**6, MILLI) if table.has("step") else MILLI
    unit = _text(table, "unit")
    c_unit = table.string("c_unit", unit)
    rounding = table.string("round", "")
    named, unnamed = _named_values(table, values)
    absent = _absent(table, length, signed)
    low, high = _range(table, length, signed, step, absent, named if unnamed != "kept" else None)
    signal = Signal(
        name=name,
        start=start,
        length=length,
        signed=signed,
        step=step,
        unit=unit,
        c_unit=c_unit,
        low=low,
        high=high,
        absent=absent,
        rounding=rounding,
        values=named,
        unnamed=unnamed,
        coded=table.boolean("coded", True),
        comment=_text(table, "comment"),
        note=_text(table, "note"),
    )
    table.end()
    _check_number(table, signal)
    _check_values_fit(table, signal)
    return signal


def _named_values(table: Table, values: dict[str, Values]) -> tuple[Values | None, str]:
    if not table.has("values"):
        if table.has("unnamed"):
            raise table.error("unnamed", "is for signals with values")
        return None, ""
    name = table.string("values")
    if name not in values:
        raise table.error("values", f'no values named "{name}"')
    unnamed = table.string("unnamed")
    if unnamed not in UNNAMED:
        raise table.error("unnamed", f"must be one of {', '.join(UNNAMED)}")
    if unnamed == "unknown" and values[name].codes[0].name != "unknown":
        raise table.error("unnamed", f'"{name}" does not begin with a code named "unknown"')
    return values[name], unnamed


def _raw_ends(length: int, signed: bool) -> tuple[int, int]:
    return (-(1 << (length - 1)), (1 << (length - 1)) - 1) if signed else (0, (1 << length) - 1)


def _absent(table: Table, length: int, signed: bool) -> int | None:
    """The raw value of the code, which the file has as it is on the wire."""
    if not table.has("absent"):
        return None
    code = table.integer("absent", 0, (1 << length) - 1)
    return code - (1 << length) if signed and code >> (length - 1) else code


def _range(
    table: Table, length: int, signed: bool, step: int, absent: int | None, named: Values | None
) -> tuple[int, int]:
    """Least and greatest raw value: as the file says, else what the bits hold, but for an absent code at the end."""
    least, most = _raw_ends(length, signed)
    low = least + 1 if absent == least else least
    high = most - 1 if absent == most else most
    if named is not None:
        low, high = named.codes[0].code, named.codes[-1].code
    low = _raw(table, "least", step, least, most, low)
    high = _raw(table, "most", step, least, most, high)
    if low > high:
        raise table.error("least", "above most")
    if absent is not None and low <= absent <= high:
        raise table.error("absent", "is inside the range")
    return low, high


def _raw(table: Table, key: str, step: int, least: int, most: int, default: int) -> int:
    if not table.has(key):
        return default
    thousandths = table.quantity(key, -(10**13), 10**13, MILLI)
    if thousandths % step:
        raise table.error(key, f"is not a multiple of the step {step / MILLI:g}")
    raw = thousandths // step
    if not least <= raw <= most:
        ends = f"{least * step / MILLI:g} to {most * step / MILLI:g}"
        raise table.error(key, f"cannot be represented: the bits hold {ends}")
    return raw


def _check_number(table: Table, signal: Signal) -> None:
    """What has a step, a code for "absent" or a shorter range goes through the codec's field arithmetic."""
    if signal.unit != signal.c_unit and (signal.unit, signal.c_unit) not in C_UNITS:
        raise table.error("c_unit", f'no factor from "{signal.unit}" to "{signal.c_unit}" is known')
    if signal.step * C_UNITS.get((signal.unit, signal.c_unit), 1) % MILLI:
        raise table.error("c_unit", "the step is not a whole number of it")
    is_short = (signal.low, signal.high) != _raw_ends(signal.length, signal.signed) and signal.values is None
    if (signal.step != MILLI or is_short) != bool(signal.rounding):
        reason = "is for what has a step, a range or an absent code" if signal.rounding else "missing"
        raise table.error("round", reason)
    if signal.rounding and signal.rounding not in ROUNDINGS:
        raise table.error("round", f"must be one of {', '.join(ROUNDINGS)}")
    if signal.rounding and (signal.length > 16 or max(-signal.low, signal.high) * signal.c_step > _INT32_MAX):
        raise table.error("", "is too wide for the codec's 32-bit arithmetic")


def _check_values_fit(table: Table, signal: Signal) -> None:
    if signal.values is None:
        return
    if signal.rounding or signal.absent is not None or signal.signed:
        raise table.error("values", "are for plain unsigned signals")
    if signal.values.codes[-1].code >= 1 << signal.length:
        raise table.error("values", f"code {signal.values.codes[-1].code} does not fit into {signal.length} bits")


def _check_as_a_whole(root: Table, bus: Bus) -> None:
    names: dict[str, str] = {}
    functions: dict[int, str] = {}
    for message in bus.messages:
        if message.function in functions:
            raise root.error(message.name, f"has the function code of {functions[message.function]}")
        functions[message.function] = message.name
    for values in bus.values.values():
        used = [f"{m.name}.{s.name}" for m in bus.messages for s in m.signals if s.values is values]
        if not used:
            raise root.error(values.name, "no signal has these values")
        c_names = [f"{values.prefix}_{code.name}".upper() for code in values.codes] if values.c_type else []
        for c_name in [*c_names, values.count] if values.count else c_names:
            if c_name in names:
                raise root.error(values.name, f"TAPER_{c_name} is already in {names[c_name]}")
            names[c_name] = values.name


