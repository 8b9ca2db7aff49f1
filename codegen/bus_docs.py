"""The tables of docs/protocol.md. The page has them between `<!-- bus.toml: NAME -->` and `<!-- end -->`."""

import re
from collections.abc import Iterator

from bus_dbc import FEW_CODES, code_list, decimal, duration, timeout
from bus_model import MILLI, ROUNDINGS, Bus, Message, Node, Signal, Values
from toml_table import TomlError

_BLOCK = re.compile(r"(<!-- bus\.toml: (\S+) -->\n)(.*?)(<!-- end -->\n)", re.DOTALL)
_MARK = re.compile(r"<!-- (?:bus\.toml: .*|end) -->")
_UNNAMED = {
    "refused": "without a name: the frame is refused",
    "unknown": "without a name: as unknown",
    "kept": "without a name: passed on",
}


def with_tables(bus: Bus, page: str, shown: str) -> str:
    """`page` with all tables as `bus` is; raises TomlError, which calls the page `shown`, if one has no place."""
    tables = _tables(bus)
    names = [found[2] for found in _BLOCK.finditer(page)]
    if len(_MARK.findall(page)) != 2 * len(names):
        raise TomlError(shown, "marks", "each <!-- bus.toml: NAME --> needs an <!-- end --> before the next one")
    for name in names:
        if name not in tables or names.count(name) > 1:
            raise TomlError(shown, name, "is there twice" if name in tables else "bus.toml makes no such table")
    for name in tables:
        if name not in names:
            raise TomlError(shown, name, "has no <!-- bus.toml: ... --> to stand at")
    return _BLOCK.sub(lambda found: f"{found[1]}{tables[found[2]]}{found[4]}", page)


def _tables(bus: Bus) -> dict[str, str]:
    tables = {"nodes": _nodes(bus), "frames": _frames(bus), "rounding": _rounding(bus)}
    tables |= {message.name: _signals(message) for message in bus.messages}
    tables |= {f"values.{values.name}": _values(values) for values in bus.values.values()}
    return tables


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [" | ".join(row) for row in [head, ("---",) * len(head), *rows]]
    return "".join(f"| {line} |\n".replace("|  |", "| |").replace("|  |", "| |") for line in lines)


def _nodes(bus: Bus) -> str:
    rows = [(node.name, _span(node), node.comment) for node in bus.nodes.values()]
    return _table(("node", "number", "what it is"), rows)


def _span(node: Node) -> str:
    return str(node.first) if node.is_one() else f"{node.first}..{node.last}"


def _frames(bus: Bus) -> str:
    return _table(("id", "n", "name", "sender", "receivers", "period", "timeout"), [_frame(m) for m in bus.messages])


def _frame(message: Message) -> tuple[str, ...]:
    is_one = message.is_one()
    identifier = message.identifier(message.nodes[0].first if is_one else 0)
    period = " ".join(text for text in (duration(message.cycle_ms), message.cycle_note) if text)
    return (
        f"{identifier:03X}" if is_one else f"{identifier:03X}+n",
        "" if is_one else _numbers(message),
        f"[{message.name}](#{message.name.lower()})",
        _who(message, message.sender) + ("; its heartbeat" if message.heartbeat else ""),
        ", ".join(_who(message, name) for name in message.receivers),
        period,
        timeout(message) or "-",
    )


def _numbers(message: Message) -> str:
    """All numbers of nodes, as "0..60, 62"."""
    spans: list[tuple[int, int]] = []
    for node in message.nodes:
        if spans and spans[-1][1] + 1 == node.first:
            spans[-1] = (spans[-1][0], node.last)
        else:
            spans.append((node.first, node.last))
    return ", ".join(str(first) if first == last else f"{first}..{last}" for first, last in spans)


def _who(message: Message, name: str) -> str:
    """The node's name; "n" where the identifier tells which one."""
    if name != "node":
        return name
    if message.is_one():
        return message.nodes[0].name
    return f"{message.nodes[0].name} n" if len(message.nodes) == 1 else "n"


def _signals(message: Message) -> str:
    head = ("signal", "bits", "scale", "range", "absent", "meaning")
    return f"{message.comment.rstrip('.')}.\n\n" + _table(head, [_signal(one) for one in message.signals])


def _signal(signal: Signal) -> tuple[str, ...]:
    last = signal.start + signal.length - 1
    bits = str(signal.start) if signal.length == 1 else f"{signal.start}..{last}"
    scale = f"{decimal(signal.step)} {signal.unit}".strip() if signal.unit or signal.step != MILLI else ""
    ends = f"{decimal(signal.low * signal.step)}..{decimal(signal.high * signal.step)}" if signal.rounding else ""
    return (
        f"`{signal.name}`" if signal.coded else f"*`{signal.name}`*",
        f"{bits}, signed" if signal.signed else bits,
        scale,
        ends,
        "-" if signal.absent is None else signal.absent_hex,
        _meaning(signal),
    )


def _meaning(signal: Signal) -> str:
    parts = [signal.comment, signal.note]
    if signal.values is not None:
        listed = code_list(signal.values) if len(signal.values.codes) <= FEW_CODES else "values"
        parts += [f"[{listed}](#{signal.values.name})", _UNNAMED[signal.unnamed]]
    text = "; ".join(part for part in parts if part)
    return text[:1].upper() + text[1:]


def _values(values: Values) -> str:
    in_c = f"In C `taper_{values.name}_t`, `TAPER_{values.prefix}_...`. " if values.c_type else ""
    rows = [(str(code.code), f"`{code.name}`", code.comment) for code in values.codes]
    return f"{in_c}{values.comment.rstrip('.')}.\n\n" + _table(("code", "name", "meaning"), rows)


def _rounding(bus: Bus) -> str:
    return _table(("direction", "signals"), [(way, "; ".join(_rounded(bus, way))) for way in ROUNDINGS])


def _rounded(bus: Bus, way: str) -> Iterator[str]:
    for message in bus.messages:
        names = [f"`{one.name}`" for one in message.signals if one.rounding == way]
        if names:
            yield f"{message.name} {', '.join(names)}"
