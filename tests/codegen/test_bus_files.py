"""What else comes from bus.toml: the committed files are fresh, and the C header says what the database says."""

import re
import subprocess
import sys
from pathlib import Path

import bus_docs
import pytest
from bus_c import bus_header, fields_header
from bus_dbc import full_dbc
from bus_model import Bus
from cantools.database.can import Database
from conftest import CODEGEN, ROOT, compile_c
from toml_table import TomlError

PAGE = ROOT / "docs" / "protocol.md"
RENEW = "stale; run: python codegen/bus.py --write"


def test_the_database_is_fresh(bus: Bus) -> None:
    assert (CODEGEN / "taper.dbc").read_text() == full_dbc(bus), f"codegen/taper.dbc is {RENEW}"


def test_the_tables_of_the_protocol_page_are_fresh(bus: Bus) -> None:
    page = PAGE.read_text()
    assert page == bus_docs.with_tables(bus, page, "protocol.md"), f"docs/protocol.md is {RENEW}"


def test_the_check_by_hand_finds_nothing_stale() -> None:
    done = subprocess.run([sys.executable, CODEGEN / "bus.py"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_stale_table_is_made_new_and_the_prose_stays(bus: Bus) -> None:
    page = PAGE.read_text()
    stale = page.replace("| 5 s, then held over |", "| 6 s |")
    assert stale != page
    assert bus_docs.with_tables(bus, stale, "protocol.md") == page


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("<!-- bus.toml: PLAN -->", "<!-- bus.toml: PLANS -->", "PLANS: bus.toml makes no such table"),
        ("<!-- bus.toml: PLAN -->", "<!-- bus.toml: EMCY -->", "EMCY: is there twice"),
        ("<!-- bus.toml: PLAN -->\n", "", "marks: each <!-- bus.toml: NAME --> needs an <!-- end --> before the next one"),
    ],
)
def test_a_page_with_a_wrong_mark_is_refused(bus: Bus, old: str, new: str, reason: str) -> None:
    with pytest.raises(TomlError, match=rf"^page: {re.escape(reason)}$"):
        bus_docs.with_tables(bus, PAGE.read_text().replace(old, new, 1), "page")


def test_a_page_without_a_table_is_refused(bus: Bus) -> None:
    page = re.sub(r"<!-- bus\.toml: PLAN -->.*?<!-- end -->\n", "", PAGE.read_text(), flags=re.DOTALL)
    with pytest.raises(TomlError, match=r"^page: PLAN: has no <!-- bus.toml: ... --> to stand at$"):
        bus_docs.with_tables(bus, page, "page")


def defines(text: str, pattern: str) -> dict[str, int]:
    """Names and values of `#define NAME value` and `NAME = value,` that match."""
    found = re.findall(rf"^(?:#define|   ) ({pattern}) +(?:= )?(\w+),?", text, re.MULTILINE)
    return {name: int(value, 0) for name, value in found}


def test_the_header_has_function_codes_periods_and_timeouts_of_the_database(bus: Bus, full: Database) -> None:
    header = bus_header(bus)
    kinds, cycles, timeouts = {}, {}, {}
    for message in full.messages:
        name = re.sub(r"_(\d\d|CTRL|GATEWAY|TOOL)$", "", message.name)
        kinds[f"TAPER_MESSAGE_{name}"] = message.frame_id >> 6
        if message.cycle_time:
            cycles[f"TAPER_{name}_CYCLE_ms"] = message.cycle_time
        assert message.dbc is not None
        if "TaperTimeout" in message.dbc.attributes:
            timeouts[f"TAPER_{name}_TIMEOUT_ms"] = message.dbc.attributes["TaperTimeout"].value
    assert defines(header, r"TAPER_MESSAGE_\w+") == kinds
    assert defines(header, r"TAPER_\w+_CYCLE_ms") == cycles
    assert defines(header, r"TAPER_\w+_TIMEOUT_ms") == timeouts
    assert defines(header, r"TAPER_NODE_\w+") == {
        "TAPER_NODE_CONTROLLER": 0,
        "TAPER_NODE_GATEWAY": 62,
        "TAPER_NODE_TOOL": 63,
    }


@pytest.mark.parametrize(
    ("message", "signal", "prefix"),
    [
        ("SETPOINT_01", "command", "COMMAND"),
        ("EVSE_STATUS_01", "pilot_state", "PILOT"),
        ("CTRL_STATUS", "mode", "MODE"),
        ("CTRL_STATUS", "limit_source", "LIMIT"),
        ("EVSE_INFO_01", "kind", "KIND"),
        ("EVSE_INFO_01", "rotation", "ROTATION"),
        ("OUTLOOK_01", "reason", "REASON"),
        ("EMCY_01", "severity", "SEVERITY"),
        ("EMCY_01", "code", "EVENT"),
        ("CTRL_DIAG", "index", "COUNTER"),
    ],
)
def test_the_header_names_values_as_the_database_does(
    bus: Bus, full: Database, message: str, signal: str, prefix: str
) -> None:
    choices = full.get_message_by_name(message).get_signal_by_name(signal).choices
    assert choices
    expected = {f"TAPER_{prefix}_{str(name).upper()}": code for code, name in choices.items()}
    assert defines(bus_header(bus), rf"TAPER_{prefix}_\w+") == expected


def test_the_number_of_counters_is_one_more_than_the_last(bus: Bus) -> None:
    counters = defines(bus_header(bus), r"TAPER_COUNTER_\w+")
    assert defines(bus_header(bus), "TAPER_COUNTERS") == {"TAPER_COUNTERS": max(counters.values()) + 1}


def test_the_header_compiles_alone(bus: Bus, tmp_path: Path) -> None:
    (tmp_path / "bus.h").write_text(bus_header(bus))
    (tmp_path / "main.c").write_text(
        '#include "bus.h"\nint main(void) { return TAPER_MESSAGE_CTRL_DIAG - 0x0F + TAPER_REASON_STATION - 14; }\n'
    )
    compile_c([tmp_path / "main.c"], [tmp_path], tmp_path / "main", "-Wpedantic", "-Wconversion")
    assert subprocess.run([tmp_path / "main"], check=False).returncode == 0


def test_a_field_has_its_step_in_the_firmwares_unit_range_absent_code_and_direction(bus: Bus) -> None:
    fields = fields_header(bus)
    for line in (
        "taper_field_site_limit_limit = {100, -32767, 32767, -32768, TAPER_ROUND_DOWN}; /* W */",
        "taper_field_setpoint_validity = {500, 0, 254, TAPER_FIELD_ALWAYS, TAPER_ROUND_DOWN}; /* ms */",
        "taper_field_ev_status_soc = {5, 0, 200, 255, TAPER_ROUND_NEAREST}; /* permille */",
        "taper_field_ev_param_a_capacity = {100, 1, 65534, 65535, TAPER_ROUND_NEAREST}; /* Wh */",
        "taper_field_ctrl_status_iterations = {2, 0, 255, TAPER_FIELD_ALWAYS, TAPER_ROUND_UP};",
    ):
        assert f"static const taper_field_t {line}\n" in fields
