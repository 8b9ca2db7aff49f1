"""What a user meets who changes bus.toml: one line for each mistake, with the message and the signal."""

from pathlib import Path

import pytest
from bus_model import Bus, read_bus
from conftest import CODEGEN, Run, content
from toml_table import TomlError

GOOD = """\
protocol_version = 1
nodes.CTRL = { first = 0, c_name = "CONTROLLER", comment = "Controller" }
nodes.EVSE = { first = 1, last = 60, comment = "Connector" }
[messages.STATE]
function = 4
nodes = ["EVSE"]
sender = "node"
receivers = ["CTRL"]
cycle_ms = 200
timeout_ms = 1000
comment = "State"
signals.pilot = { start = 12, length = 4, values = "pilot", unnamed = "refused" }
signals.limit = { start = 16, length = 16, signed = true, step = 100, unit = "W", round = "down", absent = 0x8000 }
signals.soc = { start = 32, length = 8, step = 0.5, unit = "%", c_unit = "permille", round = "up", most = 100, absent = 0xFF }
[messages.RAW]
function = 24
nodes = ["CTRL"]
sender = "CTRL"
receivers = ["EVSE"]
end_to_end = false
comment = "Raw"
signals.payload = { start = 0, length = 64 }
[values.pilot]
comment = "Pilot"
codes.A = { code = 0 }
codes.B = { code = 2, comment = "there" }
"""

# (what to replace in GOOD, by what, the line after "bus.toml: ")
MISTAKES = {
    "overlap": ("start = 32, length = 8", "start = 31, length = 8", "STATE.soc: bit 31 is already of limit"),
    "in the protection": ("start = 12", "start = 11", "STATE.pilot: bit 11 is already of CRC and counter"),
    "beyond the frame": ("start = 32, length = 8", "start = 57, length = 8", "STATE.soc: ends at bit 64, beyond bit 63"),
    "start beyond the frame": ("start = 32", "start = 64", "STATE.soc.start: must be 0 to 63, not 64"),
    "no bits": ("length = 8", "length = 0", "STATE.soc.length: must be 1 to 64, not 0"),
    "most that the bits cannot say": (
        "most = 100",
        "most = 128",
        "STATE.soc.most: cannot be represented: the bits hold 0 to 127.5",
    ),
    "least that the bits cannot say": (
        "most = 100",
        "least = -0.5",
        "STATE.soc.least: cannot be represented: the bits hold 0 to 127.5",
    ),
    "most between steps": ("most = 100", "most = 100.2", "STATE.soc.most: is not a multiple of the step 0.5"),
    "least above most": ("most = 100", "least = 100, most = 99", "STATE.soc.least: above most"),
    "absent inside the range": ("absent = 0xFF", "absent = 0x10", "STATE.soc.absent: is inside the range"),
    "signed absent inside the range": ("absent = 0x8000", "absent = 0xFFFF", "STATE.limit.absent: is inside the range"),
    "absent too wide": ("absent = 0xFF", "absent = 0x100", "STATE.soc.absent: must be 0 to 255, not 256"),
    "step too fine": ("step = 0.5", "step = 0.0001", "STATE.soc.step: must be 0.001 to 1000, not 0.0001"),
    "no direction of rounding": (' round = "up",', "", "STATE.soc.round: missing"),
    "unknown direction": ('round = "up"', 'round = "off"', "STATE.soc.round: must be one of down, up, nearest"),
    "direction for nothing": (
        "length = 64 }",
        'length = 64, round = "up" }',
        "RAW.payload.round: is for what has a step, a range or an absent code",
    ),
    "too wide for the codec": (
        "length = 64 }",
        'length = 32, round = "up", absent = 0xFFFFFFFF }',
        "RAW.payload: is too wide for the codec's 32-bit arithmetic",
    ),
    "unknown unit of the firmware": ('"permille"', '"promille"', 'STATE.soc.c_unit: no factor from "%" to "promille" is known'),
    "step that the firmware cannot say": (
        "step = 100",
        "step = 0.5",
        "STATE.limit.c_unit: the step is not a whole number of it",
    ),
    "no such values": ('values = "pilot"', 'values = "pi"', 'STATE.pilot.values: no values named "pi"'),
    "values without a rule": (', unnamed = "refused"', "", "STATE.pilot.unnamed: missing"),
    "unknown rule": ('"refused"', '"guessed"', "STATE.pilot.unnamed: must be one of refused, unknown, kept"),
    "rule without values": ("length = 64 }", 'length = 64, unnamed = "kept" }', "RAW.payload.unnamed: is for signals with values"),
    "no code for unknown": (
        '"refused"',
        '"unknown"',
        'STATE.pilot.unnamed: "pilot" does not begin with a code named "unknown"',
    ),
    "code that does not fit": ("code = 2,", "code = 16,", "STATE.pilot.values: code 16 does not fit into 4 bits"),
    "values of a signed signal": (
        'values = "pilot"',
        'signed = true, values = "pilot"',
        "STATE.pilot.values: are for plain unsigned signals",
    ),
    "the same code twice": ("code = 2,", "code = 0,", "pilot.B: code 0 is not above the one before it"),
    "the same function twice": ("function = 24", "function = 4", "RAW: has the function code of STATE"),
    "the same signal twice": ("signals.soc", "signals.limit", "line 14: Cannot overwrite a value"),
    "the same message twice": ("[messages.RAW]", "[messages.STATE]", "line 15: Cannot declare ('messages', 'STATE') twice"),
    "names that differ in case only": ("codes.B", "codes.a", "pilot: TAPER_PILOT_A is already in pilot"),
    "values that nobody has": (
        "[values.pilot]",
        '[values.idle]\ncomment = "Idle"\ncodes.none = { code = 0 }\n[values.pilot]',
        "idle: no signal has these values",
    ),
    "codes that cannot be counted": (
        'comment = "Pilot"',
        'comment = "Pilot"\ncount = "PILOTS"',
        "pilot.count: the codes do not count from 0 without a gap",
    ),
    "name of the protection": ("signals.soc", "signals.e2e_crc", "STATE.e2e_crc: is made for every protected message"),
    "signal in capitals": ("signals.soc", "signals.SOC", 'STATE.SOC: "SOC" is not a name here ([a-z][a-z0-9_]*)'),
    "unknown key": ("cycle_ms = 200", "cycle_s = 200", "STATE.cycle_s: unknown key"),
    "unknown key of a signal": ("unit = ", "units = ", "STATE.limit.units: unknown key"),
    "unknown key of a code": ('"there"', '"there", c = 1', "pilot.B.c: unknown key"),
    "unknown section": ("[values.pilot]", "[colours]\n[values.pilot]", "colours: unknown key"),
    "function of six bits": ("function = 24", "function = 32", "RAW.function: must be 0 to 31, not 32"),
    "no comment": ('comment = "Raw"\n', "", "RAW.comment: missing"),
    "comment that ends a C comment": (
        '"Raw"',
        '"Raw */"',
        "RAW.comment: must be one line of plain text without quotes, bars, backslashes and comment marks",
    ),
    "no such receiver": ('["EVSE"]\nend', '["EVS"]\nend', 'RAW.receivers: no node named "EVS"'),
    "no receiver": ('["EVSE"]\nend', "[]\nend", "RAW.receivers: must be an array of different strings, at least one"),
    "no such sender": ('sender = "CTRL"', 'sender = "ME"', 'RAW.sender: no node named "ME"'),
    "many senders": (
        'sender = "CTRL"',
        'sender = "EVSE"',
        'RAW.sender: "EVSE" is more than one node; "node" is the one in the identifier',
    ),
    "nodes that share a number": ("first = 1,", "first = 0,", "EVSE: has a number of CTRL"),
    "no signals": ("signals.payload = { start = 0, length = 64 }\n", "", "RAW.signals: missing"),
    "timeout that the DBC cannot say": (
        "timeout_ms = 1000",
        "timeout_ms = 70000",
        "STATE.timeout_ms: must be 1 to 65535, not 70000",
    ),
}


def read(folder: Path, text: str) -> Bus:
    (folder / "bus.toml").write_text(text, encoding="utf-8")
    return read_bus(folder / "bus.toml")


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_gives_one_line_with_message_signal_and_reason(mistake: str, tmp_path: Path) -> None:
    old, new, line = MISTAKES[mistake]
    assert old in GOOD
    with pytest.raises(TomlError) as error:
        read(tmp_path, GOOD.replace(old, new, 1))
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(f"bus.toml: {line}")


def test_the_good_one_is_read_as_it_stands(tmp_path: Path) -> None:
    state, raw = read(tmp_path, GOOD).messages
    limit, soc = state.signals[1:]
    assert (limit.low, limit.high, limit.absent, limit.absent_hex, limit.c_step) == (-32767, 32767, -32768, "0x8000", 100)
    assert (soc.low, soc.high, soc.absent, soc.c_step) == (0, 200, 255, 5)
    assert (state.signals[0].low, state.signals[0].high) == (0, 2)
    assert (state.identifier(60), raw.identifier(0), raw.is_one(), state.is_one()) == (0x13C, 0x600, True, False)


def test_generating_from_a_bad_description_writes_nothing(generate: Run, tmp_path: Path) -> None:
    (tmp_path / "bus.toml").write_text(GOOD.replace("function = 24", "function = 4"))
    arguments = ("--stations", "hub", "--real", "float", "--no-planner")
    done = generate(*arguments, "--out", tmp_path / "out", "--bus", tmp_path / "bus.toml")
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr == "bus.toml: RAW: has the function code of STATE\n"
    assert set(content(tmp_path)) == {"bus.toml"}


def test_the_description_of_the_repository_is_good() -> None:
    assert len(read_bus(CODEGEN / "bus.toml").messages) == 20
