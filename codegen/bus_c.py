"""The station bus as C: the header of its numbers, and the fields of the codec."""

from collections.abc import Iterator

from bus_model import Bus, Code, Message, Signal, Values

_HEADER = """\
/**
 * The station bus in numbers: functions, periods, timeouts and named values. Generated from codegen/bus.toml.
 */
#ifndef TAPER_BUS_H
#define TAPER_BUS_H

/** Version of the station bus, told by connectors in EVSE_INFO. */
#define TAPER_PROTOCOL_VERSION {version}

/** Function codes: `id = function << 6 | node`. */
{kinds}

{nodes}

/** Nominal periods [ms]. */
{cycles}

/** Age after which a report counts as absent [ms]. */
{timeouts}

{enums}

#endif
"""

_FIELDS = """\
/** Private to the codec: the numbers on the wire and which values have a name. Generated from codegen/bus.toml. */
#ifndef TAPER_FIELDS_H
#define TAPER_FIELDS_H

/* taper_field_t {{step, low, high, absent, rounding}}: see codec_internal.h, which includes this. */
{fields}

{names}

#endif
"""


def bus_header(bus: Bus) -> str:
    """include/taper/bus.h."""
    return _HEADER.format(
        version=bus.protocol_version,
        kinds=_enum("taper_message_kind_t", [_kind(message) for message in bus.messages]),
        nodes=_defines([(f"TAPER_NODE_{n.c_name}", n.first) for n in bus.nodes.values() if n.c_name]),
        cycles=_defines([(f"TAPER_{m.name}_CYCLE_ms", m.cycle_ms) for m in bus.messages if m.cycle_ms]),
        timeouts=_defines([(f"TAPER_{m.name}_TIMEOUT_ms", m.timeout_ms) for m in bus.messages if m.timeout_ms]),
        enums="\n\n".join(_values_enum(values) for values in bus.values.values() if values.c_type),
    )


def _defines(pairs: list[tuple[str, int]]) -> str:
    width = max(len(name) for name, _ in pairs)
    return "\n".join(f"#define {name:{width}} {value}" for name, value in pairs)


def _kind(message: Message) -> tuple[str, str]:
    comment = "" if message.end_to_end else f"{message.comment}; not end-to-end protected"
    return f"TAPER_MESSAGE_{message.name} = 0x{message.function:02X},", comment


def _enum(name: str, entries: list[tuple[str, str]]) -> str:
    """The typedef; the comments of entries stand below each other."""
    width = max((len(text) for text, comment in entries if comment), default=0)
    lines = [f"    {text:{width}} /**< {comment} */" if comment else f"    {text}" for text, comment in entries]
    return "\n".join(["typedef enum {", *lines, f"}} {name};"])


def _c_name(values: Values, code: Code) -> str:
    return f"TAPER_{values.prefix}_{code.name}".upper()


def _values_enum(values: Values) -> str:
    entries = [(f"{_c_name(values, code)} = {code.code},", code.comment) for code in values.codes]
    if values.count:
        entries.append((f"TAPER_{values.count} = {len(values.codes)},", ""))
    return f"/** {values.comment} */\n{_enum(f'taper_{values.name}_t', entries)}"


def fields_header(bus: Bus) -> str:
    """dbc/taper_fields.h."""
    fields = [_field(message, one) for message in bus.messages for one in message.signals if one.rounding]
    named: dict[str, Values] = {}
    for message in bus.messages:
        for one in message.signals:
            if one.values is not None and one.unnamed in ("refused", "unknown"):
                named[one.values.name] = one.values
    names = "\n\n".join(_is_named(values) for values in named.values())
    return _FIELDS.format(fields="\n".join(fields), names=names)


def _field(message: Message, signal: Signal) -> str:
    absent = "TAPER_FIELD_ALWAYS" if signal.absent is None else signal.absent
    name = f"taper_field_{message.name.lower()}_{signal.name}"
    numbers = f"{signal.c_step}, {signal.low}, {signal.high}, {absent}, TAPER_ROUND_{signal.rounding.upper()}"
    unit = f" /* {signal.c_unit} */" if signal.c_unit else ""
    return f"static const taper_field_t {name} = {{{numbers}}};{unit}"


def _is_named(values: Values) -> str:
    return "\n".join(_is_named_lines(values))


def _is_named_lines(values: Values) -> Iterator[str]:
    yield f"static inline bool taper_{values.name}_is_named(unsigned code) {{"
    yield "    switch (code) {"
    for code in values.codes[:-1]:
        yield f"    case {_c_name(values, code)}:"
    yield f"    case {_c_name(values, values.codes[-1])}: return true;"
    yield "    default: return false;"
    yield "    }"
    yield "}"
