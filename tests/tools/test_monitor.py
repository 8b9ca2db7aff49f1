"""tools/monitor: hand-made frames in, rows and pictures out."""

import io
import json
import os
import pty
import subprocess
import sys
from pathlib import Path

import can
import pytest
from rich.console import Console
from taperlib import monitor
from taperlib.canbus import Database, Frame, Receiver, checksum, protect, read_log
from taperlib.files import InputError
from taperlib.monitor import LiveSource, main
from taperlib.station_screen import columns_for, screen
from taperlib.station_view import StationView

ROOT = Path(__file__).resolve().parents[2]
GATEWAY = 62
NOON_UNIX_S = 1_772_366_400  # 2026-03-01 12:00 UTC
DIAG_CRC_ERRORS, DIAG_PLANS = 3, 12
EVENT_CONNECTOR_LOST = 4
REASON_SITE_LIMIT, REASON_HAND_OVER = 4, 7
SOURCE_GATEWAY, SOURCE_FAILSAFE = 1, 3
MODE_PLAN, MODE_FAILSAFE = 1, 3


@pytest.fixture(scope="module")
def database():
    return Database(ROOT / "codegen" / "taper.dbc")


class Scene:
    """A view, and senders with their counters."""

    def __init__(self, database):
        self.database, self.view = database, StationView(database)
        self.now_s, self.counters, self.frames = 1000.0, {}, []

    def send(self, name, node, **values):
        can_id = self.database.function_of(name) << 6 | node
        counter = self.counters[name, node] = (self.counters.get((name, node), -1) + 1) % 16
        self.hear(can_id, protect(can_id, self.database.encode(name, values), counter))

    def hear(self, can_id, data):
        frame = Frame(self.now_s, can_id, data)
        self.frames.append(frame)
        self.view.hear(frame)

    def setpoint(self, node, current, command=1):
        self.send("SETPOINT", node, command=command, current=current, validity=3, fallback_current=0, phase_mask=7)

    def status(self, node, **values):
        echo = self.counters.get(("SETPOINT", node), 0)
        self.send("EVSE_STATUS", node, **{"pilot_state": 2, "ev_present": 1, "phases": 3, "setpoint_echo": echo,
                                          "current_l1": 15.5, "current_l2": 15.5, "current_l3": 15.5} | values)

    def vehicle(self, node, session=7, **values):
        self.send("EV_STATUS", node, **{"soc": 47.5, "soc_age": 2, "max_current": 32} | values)
        self.send("EVSE_ELEC", node, voltage=230, power=10_690, session_energy=4_000)
        self.send("EV_PARAM_A", node, session=session, capacity=60, target_soc=80, minimum_soc=0, plug_in_soc=40,
                  revision=session % 16)
        departure = (NOON_UNIX_S // 60 + 120) % 65535
        self.send("EV_PARAM_B", node, session=session, departure=departure, peak_power=22_000, min_current=6,
                  revision=session % 16)
        self.send("EV_PARAM_C", node, target_energy=24_000, maximum_energy=36_000, revision=session % 16)

    def controller(self, mode=MODE_PLAN, source=SOURCE_GATEWAY):
        self.send("CTRL_STATUS", 0, mode=mode, limit_source=source, solver_verdict=2, iterations=80, active=2, waiting=1,
                  plan_version=9)

    def gateway(self, limit_w=40_000):
        self.send("SITE_LIMIT", GATEWAY, active=1, limit=limit_w, failsafe_limit=11_000, validity=5)
        self.send("TIME_SYNC", GATEWAY, unix_time=NOON_UNIX_S, millisecond=0, quality=33)

    def row(self, node=1):
        return next(row for row in self.view.connectors(self.now_s) if row.node == node)

    @property
    def station(self):
        return self.view.station(self.now_s, self.view.connectors(self.now_s))

    def drawn(self, width, height=None):
        console = Console(file=io.StringIO(), width=width, force_terminal=False)
        console.print(screen(self.view, self.now_s, "vcan0", True, width, height))
        return console.file.getvalue()

    def save_log(self, path):
        path.write_text("".join(f"({frame.time_s:.6f}) vcan0 {frame.can_id:03X}#{frame.data.hex().upper()}\n"
                                for frame in self.frames))
        return path


@pytest.fixture
def scene(database):
    """Connector 1 charges, 2 waits, 3 is free; all were heard just now."""
    scene = Scene(database)
    scene.gateway()
    scene.controller()
    for node, current in ((1, 16.0), (2, 0.0)):
        scene.setpoint(node, current, command=int(current > 0))
        scene.status(node)
        scene.vehicle(node)
    scene.setpoint(3, 0, command=0)
    scene.status(3, pilot_state=0, ev_present=0, current_l1=0, current_l2=0, current_l3=0)
    return scene


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
    scene.send("PLAN", 2, reason=REASON_HAND_OVER, power_0=4200, power_1=0, power_2=0)
    row = scene.row(2)
    assert (row.reason, row.reason_told, row.planned_kw) == ("hand over", True, 4.2)


@pytest.mark.parametrize(("values", "reason"), [
    ({"complete": 1}, "complete"), ({"pause_requested": 1}, "vehicle pause"), ({"error": 3}, "fault"),
    ({"max_current": 16}, "vehicle limit"), ({}, "planned")])
def test_without_a_plan_the_reason_is_inferred(scene, values, reason):
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
        "kWh", "why"]
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


# ---- The command

def test_a_log_is_shown_once(scene, tmp_path, capsys):
    log = scene.save_log(tmp_path / "day.log")
    assert main(["--log", str(log), "--once", "--utc"]) == 0
    output = capsys.readouterr().out
    assert "mode plan" in output and "14:00" in output and "day.log" in output


def test_json_gives_an_object_each_second(scene, tmp_path, capsys):
    for _ in range(25):
        scene.now_s += 0.1
        scene.status(1)
    assert main(["--log", str(scene.save_log(tmp_path / "day.log")), "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(lines) == 2
    assert lines[0]["connectors"][0]["setpoint_a"] == 16.0
    assert lines[1]["time_s"] - lines[0]["time_s"] == pytest.approx(1.0)
    assert lines[0]["station"]["mode"] == "plan" and lines[0]["bus"]["crc_errors"] == 0


def test_seconds_end_it(scene, tmp_path, capsys):
    scene.now_s += 10
    scene.status(2)
    log = scene.save_log(tmp_path / "day.log")
    assert main(["--log", str(log), "--once", "--seconds", "5"]) == 0
    assert f"{len(scene.frames) - 1} frames" in capsys.readouterr().out


def test_on_a_terminal_it_is_live_and_leaves_the_last_picture(scene, tmp_path):
    scene.now_s += 0.5
    scene.status(1)
    master, slave = pty.openpty()
    process = subprocess.Popen([ROOT / "tools" / "monitor", "--log", scene.save_log(tmp_path / "day.log")],
                               stdout=slave, stderr=subprocess.STDOUT, stdin=slave,
                               env=os.environ | {"TERM": "xterm", "COLUMNS": "80", "LINES": "24"})
    os.close(slave)
    output = b""
    try:
        while chunk := os.read(master, 65536):
            output += chunk
    except OSError:
        pass  # the other end was closed
    os.close(master)
    assert process.wait(30) == 0, output
    assert b"\x1b[?1049h" in output and b"\x1b[?1049l" in output
    assert b"planned?" in output.rpartition(b"\x1b[?1049l")[2]


def test_an_empty_log_is_said_with_an_exit_code(tmp_path, capsys):
    (tmp_path / "empty.log").touch()
    assert main(["--log", str(tmp_path / "empty.log"), "--once"]) == 1
    assert "nothing was heard" in capsys.readouterr().err


def test_a_log_keeps_to_one_interface_and_to_frames_of_this_bus(tmp_path):
    log = tmp_path / "mixed.log"
    log.write_text("(1.0) vcan0 101#0011223344556677\n(1.1) vcan1 102#00\n(1.2) vcan0 12345678#00\n"
                   "(1.3) vcan0 20000080#0000000000000000\n(1.4) vcan0 101#R8\n(1.5) vcan0 103#01 R\n(1.6) vcan0 10")
    frames = list(read_log(log, None))
    assert [(frame.can_id, frame.is_error) for frame in frames] == [(0x101, False), (0, True), (0x103, False)]
    assert [frame.can_id for frame in read_log(log, "vcan1")] == [0x102]


def test_what_is_not_a_log_is_refused_with_its_line(tmp_path, capsys):
    (tmp_path / "bad.log").write_text("(1.0) vcan0 101#00\nhello\n")
    assert main(["--log", str(tmp_path / "bad.log"), "--once"]) == 2
    assert "bad.log:2: not a line of candump -l: 'hello'" in capsys.readouterr().err
    assert main(["--log", str(tmp_path / "none.log"), "--once"]) == 2
    assert "No such file" in capsys.readouterr().err


def test_a_bad_database_is_refused(tmp_path):
    (tmp_path / "bad.dbc").write_text("BO_ nonsense\n")
    with pytest.raises(InputError, match="not a CAN database"):
        Database(tmp_path / "bad.dbc")


def test_an_interface_that_is_not_there_is_told_with_the_line_that_mends_it(capsys):
    assert main(["--can", "nocan9", "--once"]) == 2
    assert "tools/with-vcan" in capsys.readouterr().err


class FakeBus:
    """Hands out what a test gives it; an exception is raised."""

    def __init__(self, what):
        self.what = what

    def recv(self, _timeout):
        item = self.what.pop(0)
        if isinstance(item, Exception):
            raise item
        return item

    def shutdown(self):
        pass


def test_an_interface_may_go_down_and_come_back(monkeypatch):
    message = can.Message(arbitration_id=0x101, data=bytes(8), is_extended_id=False, timestamp=5.0)
    what = [message, can.CanOperationError("Network is down"), OSError("No such device"), None, message]
    monkeypatch.setattr(monitor, "REOPEN_S", 0.0)
    monkeypatch.setattr(LiveSource, "_open", lambda self: FakeBus(what))
    source = LiveSource("vcan7")
    frames = source.frames()
    labels = [(next(frames)[1] is not None, source.label) for _ in range(5)]
    assert labels == [(True, "vcan7"), (False, "vcan7 IS DOWN"), (False, "vcan7 IS DOWN"), (False, "vcan7"), (True, "vcan7")]
