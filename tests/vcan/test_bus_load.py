"""A full bus: 60 connectors at nominal rates lose no frame, and garbage under one identifier reaches nobody else.

tools/bus_load.py measures what it costs.
"""

import sys
import time
from pathlib import Path

import pytest
from conftest import ROOT, program

sys.path.insert(0, str(ROOT / "tools"))
from taperlib.busload import CONNECTORS, FullBus  # noqa: E402  (found by the path above)

DBC = ROOT / "codegen/taper.dbc"
BABBLER = 7
GARBAGE_ID = 0x100 | BABBLER  # its EVSE_STATUS
GARBAGE_RATE = 5000
QUIET_S, GARBAGE_S = 15, 10
EVERYBODY = set(range(1, CONNECTORS + 1))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A quiet time, then one with garbage; there is power for all. What came of it, by name."""
    folder = tmp_path_factory.mktemp("bus")
    bus = FullBus(Path(program("TAPER_STATION")), Path(program("TAPER_EV")), folder, max_kw=7.4, limit_kw=598.0,
                  strange_id=GARBAGE_ID)
    try:
        bus.wait_for("session_begun", CONNECTORS)
        time.sleep(QUIET_S)
        quiet_events, began_s = bus.events(), time.time()
        bus.babbling(GARBAGE_ID, GARBAGE_RATE, GARBAGE_S).join()
        ended_s = time.time()
        bus.wait_for("connector_back")
        time.sleep(2)
        summary = {name: int(value) for name, value in bus.stop_station().items() if value.isdigit()}
    finally:
        bus.stop()
    later = bus.events()[len(quiet_events):]
    return {"summary": summary, "quiet": quiet_events, "later": later, "frames": bus.frames, "heard": bus.heard(DBC),
            "garbage": (began_s, ended_s)}


def charging(run, first_s, last_s):
    """Nodes that were told a current in every setpoint of a time."""
    told = {node: [current for at_s, current in currents if first_s <= at_s <= last_s]
            for node, currents in run["heard"].current_dA.items()}
    return {node for node, currents in told.items() if currents and min(currents) > 0}


def test_every_frame_on_the_interface_is_taken_or_sent_by_the_station(run):
    summary = run["summary"]
    assert summary["frames_received"] + summary["frames_sent"] == run["frames"]
    assert (summary["receive_overflows"], summary["send_refused"], summary["missed_ticks"]) == (0, 0, 0)
    assert summary["frames_received"] > GARBAGE_S * GARBAGE_RATE * 0.8 + (QUIET_S + GARBAGE_S) * 500


def test_a_full_bus_is_no_trouble(run):
    allowed = {"start", "started", "clock_set", "mode", "session_begun"}
    assert {event for event, _ in run["quiet"]} == allowed
    assert {node for event, node in run["quiet"] if event == "session_begun"} == EVERYBODY


def test_no_counter_of_any_other_frame_has_a_gap(run):
    assert len(run["heard"].broken) > CONNECTORS * 8
    assert {can_id: count for can_id, count in run["heard"].broken.items() if count} == {}


def test_exactly_the_node_with_the_garbage_is_lost_and_comes_back(run):
    told = [event for event, node in run["later"] if node == BABBLER]
    assert {"babbling", "connector_lost"} <= set(told)
    assert told[-1] == "connector_back"
    assert [event for event, node in run["later"] if node not in (0, BABBLER)] == []
    assert run["summary"]["frames_babbled"] > GARBAGE_S * GARBAGE_RATE * 0.8


def test_nobody_else_loses_his_current(run):
    began_s, ended_s = run["garbage"]
    assert BABBLER not in charging(run, began_s, ended_s)
    assert charging(run, began_s, ended_s) == EVERYBODY - {BABBLER}


def test_the_node_charges_again(run):
    _, last = run["heard"].current_dA[BABBLER][-4]  # three more say that the station stops
    assert last > 0
