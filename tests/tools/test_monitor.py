"""tools/monitor: hand-made frames in, rows and pictures out."""

import pytest
from monitor_bench import (
    DIAG_CRC_ERRORS, DIAG_PLANS, EVENT_CONNECTOR_LOST, GATEWAY, MODE_FAILSAFE, NOON_UNIX_S, REASON_HAND_OVER,
    REASON_SITE_LIMIT, REASON_WAITING, SOURCE_FAILSAFE, Scene)
from taperlib.canbus import Frame, Receiver, checksum, protect
from taperlib.station_screen import columns_for, ordinal

# ---- The bus

def test_the_check_gives_the_golden_frames():
    for text in ("76 10 a0 00 06 0c 07 07", "67 0f 00 00 06 00 07 07"):
        data = bytes.fromhex(text)
        assert checksum(0x0C1, data) == data[0]
        assert protect(0x0C1, data, data[1] & 15) == data


@pytest.mark.parametrize(("counters", "accepted", "checks"), [
    ((3, 4), 2, (0, 0, 0, 0)), ((15, 0), 2, (0, 0, 0, 0)), ((3, 3), 1, (0, 1, 0, 0)), ((3, 6), 2, (0, 0, 2, 0)),
    ((3, 9), 2, (0, 0, 0, 1))])
def test_the_check_counts_what_the_counters_say(counters, accepted, checks):
    receiver = Receiver()
    assert sum(receiver.accepts(0x0C1, protect(0x0C1, bytes(8), counter)) for counter in counters) == accepted
    found = receiver.checks
    assert (found.crc_errors, found.repeated, found.lost, found.out_of_sequence) == checks


def test_corrupt_frames_are_counted_and_not_shown(scene):
    can_id = scene.database.function_of("SETPOINT") << 6 | 1
    scene.hear(can_id, bytes(8))
    assert scene.view.bus(scene.now_s).crc_errors == 1
    assert scene.row().setpoint_a == 16.0


def test_foreign_and_error_frames_are_counted(scene):
    before = scene.view.bus(scene.now_s)
    scene.hear(0x7F0, bytes(8))
    scene.view.hear(Frame(scene.now_s, 0, b"", is_error=True))
    after = scene.view.bus(scene.now_s)
    assert (after.unknown, after.error_frames) == (before.unknown + 1, before.error_frames + 1)


def test_the_rate_is_that_of_the_last_seconds(database):
    scene = Scene(database)
    for index in range(100):
        scene.now_s = 1000 + index / 20
        scene.status(1)
    assert scene.view.bus(1005.0).frames_per_s == pytest.approx(20)


# ---- Rows

def test_a_charging_connector_has_all_its_numbers(scene):
    row = scene.row()
    assert (row.state, row.online, row.session, row.command) == ("ready", True, 7, "charge")
    assert (row.soc_percent, row.soc_age_s, row.target_percent) == (47.5, 2, 80)
    assert (row.setpoint_a, row.validity_left_s, row.fallback_a) == (16.0, 3.0, 0)
    assert row.measured_a == pytest.approx([15.5] * 3)
    assert (row.power_kw, row.energy_kwh, row.need_kwh) == (10.69, 4.0, 20.0)
    assert row.departure_unix_s == NOON_UNIX_S + 7200
    assert row.echo_ok is True


def test_validity_runs_down_and_the_fallback_current_takes_over(scene):
    scene.now_s += 1.0
    assert scene.row().validity_left_s == pytest.approx(2.0)
    assert scene.station.setpoints_kw == pytest.approx(11.04)
    scene.now_s += 2.5
    assert scene.row().validity_left_s == 0
    assert scene.station.setpoints_kw == 0


def test_a_silent_connector_is_offline_after_its_timeout(scene):
    scene.now_s += 0.9
    assert scene.row().state == "ready"
    scene.now_s += 0.2
    row = scene.row()
    assert (row.state, row.online, row.reason, row.echo_ok) == ("offline", False, "offline", None)


def test_an_echo_that_is_late_is_shown(scene):
    scene.setpoint(1, 10.0)
    assert scene.row().echo_ok is True
    scene.now_s += 0.6
    scene.send("EVSE_STATUS", 1, pilot_state=2, ev_present=1, setpoint_echo=0)
    assert scene.row().echo_ok is False


def test_absent_values_stay_absent(scene):
    scene.send("EV_STATUS", 1, soc=127.5, soc_age=255, max_current=6553.5)
    scene.send("EVSE_ELEC", 1, voltage=6553.5, power=655_350, session_energy=655_350)
    row = scene.row()
    assert (row.soc_percent, row.soc_age_s, row.power_kw, row.energy_kwh) == (None, None, None, None)
    assert row.need_kwh is None


def test_need_by_soc_when_no_energy_was_asked_for(scene):
    scene.send("EV_PARAM_C", 1, target_energy=-655_360, revision=7)
    assert scene.row().need_kwh == pytest.approx(0.325 * 60)


def test_parameters_of_different_revisions_are_not_mixed(scene):
    scene.send("EV_PARAM_A", 1, session=8, target_soc=90, revision=8)
    assert (scene.row().session, scene.row().target_percent) == (7, 80)


def test_a_vehicle_that_left_is_forgotten(scene):
    scene.status(1, pilot_state=0, ev_present=0)
    assert (scene.row().session, scene.row().reason) == (None, "no vehicle")
    scene.status(1)
    assert scene.row().session is None
    assert scene.row().reason == "no parameters"


def test_the_controller_s_reason_is_shown_in_words(scene):
    scene.send("PLAN", 2, power_0=4200, power_1=0, power_2=0)
    scene.send("OUTLOOK", 2, reason=REASON_HAND_OVER)
    row = scene.row(2)
    assert (row.reason, row.reason_told, row.planned_kw) == ("hand over", True, 4.2)


def test_what_the_driver_can_expect_is_shown(scene):
    scene.send("OUTLOOK", 2, reason=REASON_WAITING, waiting_place=2, waiting_of=3, soc_estimated=1, soc_at_departure=61.5,
               short_energy=11_100, because=REASON_SITE_LIMIT)
    row = scene.row(2)
    assert (row.reason, row.waiting_place, row.waiting_of) == ("waiting", 2, 3)
    assert (row.expected_soc_percent, row.short_kwh, row.because) == (61.5, 11.1, "site limit")
    line = next(line for line in scene.drawn(160).splitlines() if line.lstrip().startswith("2 "))
    for part in ("~48%", "62%", "11.1", "waiting, 2nd of 3"):
        assert part in line


def test_nothing_is_expected_where_nothing_is_known(scene):
    scene.send("OUTLOOK", 1, reason=REASON_SITE_LIMIT, soc_at_departure=127.5, short_energy=655_350)
    row = scene.row(1)
    assert (row.reason, row.reason_told) == ("site limit", True)
    assert (row.waiting_place, row.expected_soc_percent, row.short_kwh, row.because) == (None, None, None, None)


def test_an_outlook_goes_with_its_vehicle(scene):
    scene.send("OUTLOOK", 2, reason=REASON_WAITING, waiting_place=1, waiting_of=1)
    scene.status(2, pilot_state=0, ev_present=0)
    scene.status(2)
    assert (scene.row(2).reason, scene.row(2).waiting_place) == ("no parameters", None)


@pytest.mark.parametrize(("place", "text"), [(1, "1st"), (2, "2nd"), (3, "3rd"), (4, "4th"), (11, "11th"), (13, "13th")])
def test_places_are_ordinals(place, text):
    assert ordinal(place) == text


@pytest.mark.parametrize(("values", "reason"), [
    ({"complete": 1}, "complete"), ({"pause_requested": 1}, "vehicle pause"), ({"error": 3}, "fault"),
    ({"max_current": 16}, "vehicle limit"), ({}, "planned")])
def test_without_an_outlook_the_reason_is_inferred(scene, values, reason):
    scene.send("EV_STATUS", 1, **{"soc": 47.5, "max_current": 32} | values)
    row = scene.row()
    assert (row.reason, row.reason_told) == (reason, False)


def test_the_site_limit_and_waiting_are_inferred_too(scene):
    scene.gateway(limit_w=11_100)
    assert scene.row(1).reason == "site limit"
    assert scene.row(2).reason == "waiting"


def test_a_fault_and_a_fallback_are_states(scene):
    scene.status(1, fault=1)
    assert (scene.row().state, scene.row().reason) == ("fault", "fault")
    scene.status(1, fallback_active=1)
    assert scene.row().state == "fallback"


# ---- Header, counters, EMCY

def test_the_header_sums_up(scene):
    station = scene.station
    assert (station.mode, station.limit_kw, station.limit_source, station.gateway) == ("plan", 40.0, "gateway", "limit")
    assert (station.active, station.waiting, station.plan_version, station.verdict, station.iterations) == (
        2, 1, 9, "solved", 80)
    assert station.measured_kw == pytest.approx(21.38)
    assert (station.clock_unix_s, station.clock_quality) == (NOON_UNIX_S, 33)


def test_a_silent_gateway_and_a_silent_controller_are_said(scene):
    scene.now_s += 3.1
    assert scene.station.mode == "silent"
    scene.now_s += 2.0
    scene.controller(MODE_FAILSAFE, SOURCE_FAILSAFE)
    station = scene.station
    assert (station.gateway, station.mode, station.limit_kw) == ("silent", "failsafe", 11.0)


def test_other_load_is_shown_per_phase(scene):
    scene.send("SITE_METER", GATEWAY, current_l1=12.5, current_l2=-3, current_l3=-3276.8)
    assert scene.station.other_load_a == [12.5, -3, None]
    assert "other load 12.5/-3.0/- A" in scene.drawn(120)


def test_only_counters_that_are_not_zero_are_shown(scene):
    scene.send("CTRL_DIAG", 0, index=DIAG_CRC_ERRORS, value=0)
    scene.send("CTRL_DIAG", 0, index=DIAG_PLANS, value=321)
    assert scene.view.nonzero_counters() == {"plans": 321}
    assert "counters: plans 321" in scene.drawn(80)


def test_equal_emergencies_are_one_line_with_words(scene):
    for _ in range(3):
        scene.send("EMCY", 0, severity=1, code=EVENT_CONNECTOR_LOST, about=5, reaction=2)
        scene.now_s += 0.02
    scene.send("EMCY", 4, severity=2, code=4711)
    entries = list(scene.view.emergencies.values())
    assert [(entry.what, entry.frames) for entry in entries] == [("connector lost", 3), ("code 4711", 1)]
    assert "controller  warning: connector lost  node 5  connector off  (3 frames)" in scene.drawn(100)


# ---- Pictures

def test_eighty_columns_hold_the_table(scene):
    text = scene.drawn(80)
    assert max(len(line) for line in text.splitlines()) <= 80
    assert "mode plan  setpoints 11.0 kW of 40.0 kW" in text
    charging = next(line for line in text.splitlines() if line.lstrip().startswith("1 "))
    for part in ("ready", "48%", "20.0", "14:00", "16.0", "10.7", "planned?"):
        assert part in charging
    assert "no vehicle" in text and "waiting?" in text


def test_wide_terminals_show_every_column_and_narrow_ones_the_essential():
    assert [column.heading for column in columns_for(160)] == [
        "n", "state", "ses", "SOC", "age s", "to", "need", "until", "set A", "left s", "echo", "is A", "kW", "plan",
        "kWh", "will", "short", "why"]
    assert [column.heading for column in columns_for(30)] == ["n", "state", "why"]


@pytest.mark.parametrize("width", [40, 60, 100])
def test_no_line_is_wider_than_the_terminal(scene, width):
    assert max(len(line) for line in scene.drawn(width).splitlines()) <= width


def test_low_terminals_show_vehicles_first_and_say_what_is_missing(scene):
    for node in range(10, 40):
        scene.status(node, pilot_state=0, ev_present=0)
    text = scene.drawn(80, 20)
    assert len(text.splitlines()) <= 20
    assert "more connectors" in text
    assert "planned?" in text and "waiting?" in text


def test_unequal_phases_are_all_shown(scene):
    scene.status(1, current_l2=0, current_l3=409.5)
    assert "15.5/0.0/-" in scene.drawn(160)
