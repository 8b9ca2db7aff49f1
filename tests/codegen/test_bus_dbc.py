"""The committed database of the whole bus: every identifier, and the same signals for every connector."""

from typing import Any

import pytest
from cantools.database.can import Database, Message
from conftest import CODEGEN

# Frames of the protocol by hand: function code, nodes in the identifier, cycle and timeout in ms (0: none).
CONNECTORS = range(1, 61)
FRAMES = {
    "EMCY": (0x040, [0, *CONNECTORS, 62], 0, 0),
    "SITE_LIMIT": (0x080, [62], 1000, 5000),
    "SETPOINT": (0x0C0, CONNECTORS, 500, 0),
    "EVSE_STATUS": (0x100, CONNECTORS, 200, 1000),
    "EV_STATUS": (0x140, CONNECTORS, 500, 2500),
    "EVSE_ELEC": (0x180, CONNECTORS, 1000, 5000),
    "SITE_METER": (0x1C0, [62], 1000, 3000),
    "TIME_SYNC": (0x200, [62], 1000, 5000),
    "CTRL_STATUS": (0x240, [0], 1000, 3000),
    "EV_PARAM_A": (0x280, CONNECTORS, 2000, 0),
    "EV_PARAM_B": (0x2C0, CONNECTORS, 2000, 0),
    "EV_PARAM_C": (0x300, CONNECTORS, 2000, 0),
    "EVSE_INFO": (0x340, CONNECTORS, 5000, 15000),
    "PLAN": (0x380, CONNECTORS, 1000, 0),
    "OUTLOOK": (0x440, CONNECTORS, 1000, 0),
    "CTRL_DIAG": (0x3C0, [0], 1000, 0),
    "EV_PARAM_D": (0x400, CONNECTORS, 2000, 0),
    "EV_PARAM_E": (0x480, CONNECTORS, 2000, 0),
    "ISOTP_TO": (0x600, [*CONNECTORS, 62, 63], 0, 1000),
    "ISOTP_FROM": (0x640, [*CONNECTORS, 62, 63], 0, 1000),
}
SUFFIXES = {0: "CTRL", 62: "GATEWAY", 63: "TOOL"}


def name_of(frame: str, node: int) -> str:
    """Messages that only one node has carry no suffix."""
    return frame if len(FRAMES[frame][1]) == 1 else f"{frame}_{SUFFIXES.get(node, f'{node:02}')}"


def message_of(database: Database, name: str) -> Message:
    return database.get_message_by_name(name)


def layout(message: Message) -> list[tuple[Any, ...]]:
    """All of the signals that every connector's copy must have in common."""
    return [
        (s.name, s.start, s.length, s.is_signed, s.scale, s.offset, s.minimum, s.maximum, s.unit, s.choices)
        for s in message.signals
    ]


def test_every_identifier_of_the_bus_is_there_and_no_other(full: Database) -> None:
    expected = {base + node: name_of(frame, node) for frame, (base, nodes, *_) in FRAMES.items() for node in nodes}
    assert {message.frame_id: message.name for message in full.messages} == expected


def test_every_message_is_eight_bytes_with_a_comment_a_period_and_a_timeout(full: Database) -> None:
    for frame, (_, nodes, cycle_ms, timeout_ms) in FRAMES.items():
        for node in nodes:
            message = message_of(full, name_of(frame, node))
            assert (message.length, message.is_extended_frame, message.cycle_time or 0) == (8, False, cycle_ms), message
            assert message.comment, message
            assert message.dbc is not None
            timeout = message.dbc.attributes.get("TaperTimeout")
            assert (timeout.value if timeout is not None else 0) == timeout_ms, message


def test_the_messages_of_all_nodes_are_laid_out_alike(full: Database) -> None:
    for frame, (_, nodes, *_) in FRAMES.items():
        first = layout(message_of(full, name_of(frame, nodes[0])))
        for node in nodes:
            assert layout(message_of(full, name_of(frame, node))) == first


def test_the_codec_is_made_from_the_same_layout(full: Database, compact: Database) -> None:
    protected = {frame for frame in FRAMES if not frame.startswith("ISOTP")}
    assert {message.name for message in compact.messages} == protected
    for message in compact.messages:
        same = full.get_message_by_frame_id(message.frame_id)
        assert layout(message) == layout(same)
        assert (message.cycle_time, message.comment) == (same.cycle_time, same.comment)
        assert [s.comment for s in message.signals] == [s.comment for s in same.signals]


def test_every_frame_but_iso_tp_is_protected(full: Database) -> None:
    for message in full.messages:
        signals = {signal.name: (signal.start, signal.length) for signal in message.signals}
        if message.name.startswith("ISOTP"):
            assert signals == {"payload": (0, 64)}
        else:
            assert (signals["e2e_crc"], signals["e2e_counter"]) == ((0, 8), (8, 4))


def test_signals_are_commented_for_connector_1_only(full: Database) -> None:
    commented = [m.name for m in full.messages if any(signal.comment for signal in m.signals)]
    assert "SETPOINT_01" in commented
    assert all(name.endswith("_01") or name in FRAMES for name in commented)
    assert "Signals are commented in the messages of connector 1." in (CODEGEN / "taper.dbc").read_text()


@pytest.mark.parametrize(
    ("name", "senders", "receivers"),
    [
        ("SITE_LIMIT", ["GATEWAY"], {"CTRL"}),
        ("SETPOINT_60", ["CTRL"], {"EVSE60"}),
        ("EVSE_STATUS_07", ["EVSE07"], {"CTRL"}),
        ("EMCY_CTRL", ["CTRL"], {"GATEWAY"}),
        ("EMCY_GATEWAY", ["GATEWAY"], {"CTRL"}),
        ("EMCY_01", ["EVSE01"], {"CTRL", "GATEWAY"}),
        ("TIME_SYNC", ["GATEWAY"], {"CTRL", *(f"EVSE{node:02}" for node in CONNECTORS)}),
        ("ISOTP_TO_TOOL", ["CTRL"], {"TOOL"}),
        ("ISOTP_FROM_GATEWAY", ["GATEWAY"], {"CTRL"}),
    ],
)
def test_senders_and_receivers_are_nodes_of_the_bus(
    full: Database, name: str, senders: list[str], receivers: set[str]
) -> None:
    message = message_of(full, name)
    assert message.senders == senders
    assert message.receivers == receivers


def test_all_nodes_are_declared(full: Database) -> None:
    assert [node.name for node in full.nodes] == ["CTRL", *(f"EVSE{node:02}" for node in CONNECTORS), "GATEWAY", "TOOL"]


@pytest.mark.parametrize(
    ("message", "signal", "code", "name"),
    [
        ("SETPOINT_33", "command", 15, "emergency"),
        ("EVSE_STATUS_60", "pilot_state", 2, "C"),
        ("EMCY_CTRL", "code", 20, "bad_field"),
        ("EMCY_12", "severity", 1, "warning"),
        ("OUTLOOK_05", "reason", 7, "hand_over"),
        ("EVSE_INFO_01", "rotation", 5, "213"),
        ("CTRL_STATUS", "solver_verdict", 5, "not_finite"),
        ("CTRL_DIAG", "index", 3, "crc_errors"),
    ],
)
def test_values_have_their_names(full: Database, message: str, signal: str, code: int, name: str) -> None:
    choices = message_of(full, message).get_signal_by_name(signal).choices
    assert choices is not None
    assert str(choices[code]) == name


def test_a_golden_frame_is_read_as_the_protocol_says(full: Database) -> None:
    decoded = full.decode_message("SETPOINT_01", bytes.fromhex("7610a000060c0707"))
    assert isinstance(decoded, dict)
    assert {name: str(value) for name, value in decoded.items()} == {
        "e2e_crc": str(0x76),
        "e2e_counter": "0",
        "command": "charge",
        "current": "16.0",
        "validity": "3.0",
        "fallback_current": "6.0",
        "phase_mask": "7",
        "ramp": "0",
        "session": "7",
    }
