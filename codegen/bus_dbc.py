"""The station bus as CAN databases: a compact one for the C codec, one with every connector for people and tools."""

from collections.abc import Iterator
from decimal import Decimal

from bus_model import MILLI, Bus, Message, Node, Signal, Values

_COMPACT_COMMENT = "The Taper station bus. One message for each function, with the identifier of its first connector."
_FULL_COMMENT = (
    "The Taper station bus, protocol version {version}. Made from codegen/bus.toml by codegen/bus.py; do not edit. "
    "Byte 0 and the low nibble of byte 1 are the end-to-end protection, but for ISO-TP. "
    "Signals are commented in the messages of connector 1."
)
_CONNECTOR = 1  # the connector whose messages stand for all
_LONGEST_CYCLE_ms = 65535
FEW_CODES = 7  # so many are listed in a comment; of more, the value table tells


def compact_dbc(bus: Bus) -> str:
    """One message for each protected function: what the codec packs and unpacks."""
    frames = [_Frame(bus, message, *_first_node(message)) for message in bus.messages if message.end_to_end]
    nodes = [(node.name, node.comment) for node in bus.nodes.values()]
    return _database(bus, _COMPACT_COMMENT, nodes, frames, is_full=False)


def full_dbc(bus: Bus) -> str:
    """Every identifier of the bus."""
    frames = [_Frame(bus, m, node, number) for m in bus.messages for node, number in _all_nodes(m)]
    nodes = [
        (_node_name(node, number), node.comment if node.is_one() else f"{node.comment} {number}")
        for node in bus.nodes.values()
        for number in _numbers(node)
    ]
    return _database(bus, _FULL_COMMENT.format(version=bus.protocol_version), nodes, frames, is_full=True)


def _numbers(node: Node) -> range:
    return range(node.first, node.last + 1)


def _all_nodes(message: Message) -> Iterator[tuple[Node, int]]:
    return ((node, number) for node in message.nodes for number in _numbers(node))


def _first_node(message: Message) -> tuple[Node, int]:
    """The connector that stands for all; the only node of a message that connectors do not have."""
    pairs = list(_all_nodes(message))
    return next((pair for pair in pairs if not pair[0].is_one()), pairs[0])


def _node_name(node: Node, number: int) -> str:
    return node.name if node.is_one() else f"{node.name}{number:02}"


class _Frame:
    """A message of one identifier."""

    def __init__(self, bus: Bus, message: Message, node: Node, number: int) -> None:
        self.bus, self.message, self.node, self.number = bus, message, node, number
        self.identifier = message.identifier(number)

    def name(self, is_full: bool) -> str:
        if not is_full or self.message.is_one():
            return self.message.name
        return f"{self.message.name}_{self.node.name if self.node.is_one() else f'{self.number:02}'}"

    def _names(self, name: str, is_full: bool) -> list[str]:
        if name == "node":
            return [_node_name(self.node, self.number) if is_full else self.node.name]
        node = self.bus.nodes[name]
        return [_node_name(node, number) for number in _numbers(node)] if is_full else [name]

    def sender(self, is_full: bool) -> str:
        return self._names(self.message.sender, is_full)[0]

    def receivers(self, is_full: bool) -> str:
        names = [name for key in self.message.receivers for name in self._names(key, is_full)]
        return ",".join(name for name in names if name != self.sender(is_full))

    def is_commented(self) -> bool:
        """Whether its signals are: the node that stands for all has the comments."""
        return (self.node, self.number) == _first_node(self.message)


def _database(bus: Bus, comment: str, nodes: list[tuple[str, str]], frames: list[_Frame], is_full: bool) -> str:
    """The text, in the order in which the format wants its parts."""
    lines = [f'VERSION "{bus.protocol_version}"', "", "NS_ :", "", "BS_:", ""]
    lines += [f"BU_: {' '.join(name for name, _ in nodes)}", ""]
    for frame in frames:
        lines += [*_frame_lines(frame, is_full), ""]
    lines += [f'CM_ "{comment}";', *(f'CM_ BU_ {name} "{text}";' for name, text in nodes)]
    for frame in frames:
        lines += _comment_lines(frame)
    lines += ["", *_attribute_lines(frames), ""]
    for frame in frames:
        lines += [_values_line(frame, one) for one in frame.message.signals if one.values is not None]
    return "\n".join(lines) + "\n"


def _frame_lines(frame: _Frame, is_full: bool) -> Iterator[str]:
    message, receivers = frame.message, frame.receivers(is_full)
    yield f"BO_ {frame.identifier} {frame.name(is_full)}: 8 {frame.sender(is_full)}"
    if message.end_to_end:
        yield f' SG_ e2e_crc : 0|8@1+ (1,0) [0|255] "" {receivers}'
        yield f' SG_ e2e_counter : 8|4@1+ (1,0) [0|15] "" {receivers}'
    for one in message.signals:
        place = f"{one.start}|{one.length}@1{'-' if one.signed else '+'}"
        ends = f"[{decimal(one.low * one.step)}|{decimal(one.high * one.step)}]"
        yield f' SG_ {one.name} : {place} ({decimal(one.step)},0) {ends} "{one.unit}" {receivers}'


def decimal(thousandths: int) -> str:
    """The number without an exponent and without zeros at its end."""
    text = f"{Decimal(thousandths) / MILLI:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _message_comment(message: Message) -> str:
    text = f"{message.comment.rstrip('.')}."
    return f"{text} Timeout {timeout(message)}." if message.timeout_ms else text


def timeout(message: Message) -> str:
    """As "5 s, then held over"; empty without a timeout."""
    return ", ".join(text for text in (duration(message.timeout_ms), message.timeout_note) if text)


def duration(ms: int) -> str:
    """As "200 ms" or "1 s"; empty for 0."""
    if not ms:
        return ""
    return f"{ms} ms" if ms < 1000 else f"{ms / 1000:g} s"


def _signal_comment(signal: Signal) -> str:
    parts = [signal.comment]
    if signal.values is not None and len(signal.values.codes) <= FEW_CODES:
        parts.append(code_list(signal.values))
    if signal.absent is not None:
        parts.append(f"{signal.absent_hex} absent")
    return "; ".join(part for part in parts if part)


def code_list(values: Values) -> str:
    return ", ".join(f"{code.code} {code.name}" for code in values.codes)


def _comment_lines(frame: _Frame) -> Iterator[str]:
    if frame.is_commented():
        for one in frame.message.signals:
            if _signal_comment(one):
                yield f'CM_ SG_ {frame.identifier} {one.name} "{_signal_comment(one)}";'
    yield f'CM_ BO_ {frame.identifier} "{_message_comment(frame.message)}";'


def _attribute_lines(frames: list[_Frame]) -> Iterator[str]:
    for name in ("GenMsgCycleTime", "TaperTimeout"):
        yield f'BA_DEF_ BO_ "{name}" INT 0 {_LONGEST_CYCLE_ms};'
    for name in ("GenMsgCycleTime", "TaperTimeout"):
        yield f'BA_DEF_DEF_ "{name}" 0;'
    for frame in frames:
        if frame.message.cycle_ms:
            yield f'BA_ "GenMsgCycleTime" BO_ {frame.identifier} {frame.message.cycle_ms};'
        if frame.message.timeout_ms:
            yield f'BA_ "TaperTimeout" BO_ {frame.identifier} {frame.message.timeout_ms};'


def _values_line(frame: _Frame, signal: Signal) -> str:
    assert signal.values is not None
    codes = " ".join(f'{code.code} "{code.name}"' for code in signal.values.codes)
    return f"VAL_ {frame.identifier} {signal.name} {codes} ;"
