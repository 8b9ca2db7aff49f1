"""The independent program itself: its account finds what it must find, and nothing else. No interface is needed."""

import json
import threading
import time
from pathlib import Path

import can
import pytest

import independent
from peer.account import Account, Limit
from peer.connector import Connector
from peer.observer import Observer
from peer.vehicle import Visit, default_visits, read_visits
from peer.wire import GATEWAY_NODE, Receiver, Wire, self_check

ROOT = Path(__file__).resolve().parents[2]
DBC = str(ROOT / "codegen/taper.dbc")
PAUSE, CHARGE = 0, 1
STATION_W, FAILSAFE_W, GRACE_S = 110_000.0, 11_000.0, 2.0
KW_PER_A = 0.69  # three phases of 230 V


@pytest.fixture(scope="module")
def wire():
    return Wire(DBC)


class Scene:
    """An observer, and senders with their counters. Frames carry the time of `now_s`."""

    def __init__(self, wire):
        self.wire, self.now_s, self.counters = wire, 100.0, {}
        self.account = Account(Limit(STATION_W, FAILSAFE_W, GRACE_S))
        self.observer = Observer(wire, self.account)

    def send(self, name, node, **values):
        counter = self.counters[name, node] = (self.counters.get((name, node), -1) + 1) % 16
        self.observer.hear(self.now_s, *self.wire.frame(name, node, counter, values))

    def setpoint(self, node, current_A, validity_s=3.0, fallback_A=0.0):
        self.send("SETPOINT", node, command=CHARGE if current_A else PAUSE, current=current_A, validity=validity_s,
                  fallback_current=fallback_A, phase_mask=7, session=1)

    def status(self, node, echo=None, phases=3, pilot=2):
        """By default with the echo of the last SETPOINT."""
        echo = self.counters.get(("SETPOINT", node), 0) if echo is None else echo
        self.send("EVSE_STATUS", node, pilot_state=pilot, ev_present=int(pilot > 0), setpoint_echo=echo, phases=phases)

    def limit(self, limit_kw, active=1, validity_s=5, failsafe_kw=None):
        self.send("SITE_LIMIT", GATEWAY_NODE, active=active, limit=None if limit_kw is None else limit_kw * 1000,
                  failsafe_limit=None if failsafe_kw is None else failsafe_kw * 1000, validity=validity_s)

    @property
    def may_draw_kw(self):
        return self.account.may_draw_W(self.now_s) / 1000

    @property
    def violations(self):
        return self.account.violations


@pytest.fixture
def scene(wire):
    """Two connectors with vehicles, and 22.1 kW for them: 32 A in sum."""
    scene = Scene(wire)
    scene.limit(22.1)
    for node in (1, 2):
        scene.setpoint(node, 0)
        scene.status(node)
        scene.setpoint(node, 0)
        scene.status(node)
    return scene


# ---- Wire

def test_the_golden_frames_come_out():
    self_check()


def test_the_slices_equal_what_cantools_packs(wire):
    import cantools
    database = cantools.database.load_file(DBC)
    values = {"setpoint": ("SETPOINT", {"command": 1, "current": 12.3, "validity": 3.5, "fallback_current": 6,
                                        "phase_mask": 7, "ramp": 5, "session": 200}),
              "limit": ("SITE_LIMIT", {"active": 1, "curve_ok": 0, "grid_emergency": 1, "limit": -4200,
                                       "failsafe_limit": 11000, "failsafe_duration": 120, "validity": 5})}
    for name, signals in values.values():
        can_id, data = wire.frame(name, GATEWAY_NODE if name == "SITE_LIMIT" else 1, 9, signals)
        message = next(message for message in database.messages if message.frame_id == can_id)
        packed = message.encode(signals | {"e2e_crc": data[0], "e2e_counter": 9}, strict=False)
        assert packed == data
        assert wire.read(name, data, *signals) == pytest.approx(list(signals.values()))


def test_absent_is_read_as_none(wire):
    _, data = wire.frame("EV_STATUS", 1, 0, {"soc": None, "max_current": None, "soc_age": 3})
    assert wire.read("EV_STATUS", data, "soc", "max_current", "soc_age") == [None, None, 3]
    _, data = wire.frame("SITE_LIMIT", GATEWAY_NODE, 0, {"limit": None})
    assert wire.read("SITE_LIMIT", data, "limit") == [None]


@pytest.mark.parametrize(("counters", "verdicts"), [
    ([3, 4, 5], ["ok", "ok", "ok"]), ([15, 0], ["ok", "ok"]), ([3, 3], ["ok", "repeated"]),
    ([3, 5, 8], ["ok", "lost", "lost"]), ([3, 7, 8], ["ok", "sequence", "ok"]), ([3, 2], ["ok", "sequence"])])
def test_counters_are_sorted_as_the_protocol_says(wire, counters, verdicts):
    receiver = Receiver()
    frames = [wire.frame("SETPOINT", 1, counter, {"current": 6}) for counter in counters]
    assert [receiver.sort(*frame)[0] for frame in frames] == verdicts


def test_a_flipped_bit_and_a_foreign_identifier_are_crc_errors(wire):
    can_id, data = wire.frame("SETPOINT", 1, 0, {"current": 6})
    assert Receiver().sort(can_id, bytes([*data[:7], data[7] ^ 1])) == ("crc", 0)
    assert Receiver().sort(can_id + 1, data) == ("crc", 0)
    assert Receiver().sort(can_id, data[:7]) == ("crc", 0)


def test_three_errors_in_five_frames_take_away_the_trust(scene, wire):
    for _ in range(3):
        scene.observer.hear(scene.now_s, wire.can_id("SETPOINT", 1), bytes(8))
    scene.setpoint(1, 32)
    assert scene.observer.e2e["crc"] == 3 and scene.observer.e2e["untrusted"] == 1
    assert scene.may_draw_kw == 0


# ---- The account

def test_setpoints_within_the_limit_are_no_violation(scene):
    scene.setpoint(1, 16)
    scene.setpoint(2, 16)
    scene.status(1)
    assert scene.may_draw_kw == pytest.approx(32 * KW_PER_A)
    assert not scene.violations
    assert scene.account.worst_margin_W == pytest.approx(20)


def test_one_step_above_the_limit_is_a_violation_at_that_frame(scene):
    scene.setpoint(1, 16)
    scene.now_s += 0.25
    scene.setpoint(2, 16.1)
    (violation,) = scene.violations
    assert violation.begin_s == scene.now_s
    assert violation.excess_W == pytest.approx(49)
    assert "SETPOINT 0C2" in violation.reason
    assert violation.may_draw_A == {1: 16.0, 2: 16.1}


def test_giving_before_the_other_has_echoed_is_a_violation(scene):
    scene.setpoint(1, 32)
    scene.status(1)
    scene.setpoint(1, 16)
    scene.setpoint(2, 16)
    assert len(scene.violations) == 1
    assert scene.violations[0].excess_W == pytest.approx(48 * KW_PER_A * 1000 - 22_100)


def test_giving_after_the_other_has_echoed_is_none(scene):
    scene.setpoint(1, 32)
    scene.status(1)
    scene.setpoint(1, 16)
    assert scene.may_draw_kw == pytest.approx(32 * KW_PER_A)
    scene.status(1)
    scene.setpoint(2, 16)
    assert scene.may_draw_kw == pytest.approx(32 * KW_PER_A)
    assert not scene.violations


def test_an_echo_of_an_older_setpoint_confirms_nothing(scene):
    scene.setpoint(1, 32)
    old = scene.counters["SETPOINT", 1]
    scene.setpoint(1, 16)
    scene.status(1, echo=old)
    assert scene.may_draw_kw == pytest.approx(32 * KW_PER_A)


def test_an_echo_that_stands_still_confirms_nothing_when_the_counter_comes_round(scene):
    scene.setpoint(1, 32)
    scene.status(1)
    stuck = scene.counters["SETPOINT", 1]
    for _ in range(16):
        scene.setpoint(1, 6)
        scene.status(1, echo=stuck)
    assert scene.may_draw_kw == pytest.approx(32 * KW_PER_A)


def test_giving_after_the_old_setpoint_has_expired_is_none(scene):
    scene.setpoint(1, 32)
    scene.status(1)
    scene.setpoint(1, 0, validity_s=10)
    scene.now_s += 3.0
    scene.setpoint(2, 32)
    assert not scene.violations
    assert scene.may_draw_kw == pytest.approx(32 * KW_PER_A)


def test_an_expired_setpoint_leaves_its_fallback_current(scene):
    scene.setpoint(1, 32, fallback_A=6)
    scene.status(1)
    scene.now_s += 3.5
    assert scene.may_draw_kw == pytest.approx(6 * KW_PER_A)


def test_a_fallback_current_above_the_limit_is_found_without_any_setpoint(scene):
    scene.setpoint(1, 0, validity_s=1, fallback_A=33)
    scene.now_s += 0.9
    scene.limit(22.1)
    assert not scene.violations
    scene.now_s += 0.2
    scene.limit(22.1)
    assert len(scene.violations) == 1


def test_an_empty_connector_draws_nothing(scene):
    scene.setpoint(1, 32)
    scene.status(1, pilot=0)
    scene.setpoint(2, 32)
    assert not scene.violations


def test_one_phase_counts_once(scene):
    scene.status(1, phases=1)
    scene.setpoint(1, 32)
    assert scene.may_draw_kw == pytest.approx(7.36)


def test_a_frame_that_fails_the_end_to_end_check_changes_nothing(scene, wire):
    can_id, data = wire.frame("SETPOINT", 1, scene.counters["SETPOINT", 1] + 1, {"command": 1, "current": 60,
                                                                                   "validity": 3})
    scene.observer.hear(scene.now_s, can_id, data[:7] + b"\xff")
    assert not scene.violations
    assert scene.observer.e2e["crc"] == 1
    assert scene.observer.errors[0]["id"] == "0C1"


# ---- The limit

def test_a_falling_limit_leaves_the_grace_time_and_no_more(scene):
    scene.setpoint(1, 32, validity_s=20)
    scene.limit(10)
    scene.now_s += GRACE_S - 0.1
    scene.limit(10)
    assert not scene.violations
    scene.now_s += 0.2
    scene.limit(10)
    assert len(scene.violations) == 1
    assert scene.violations[0].allowed_W == 10_000


def test_who_follows_within_the_grace_time_is_no_violator(scene):
    scene.setpoint(1, 32)
    scene.status(1)
    scene.limit(10)
    scene.setpoint(1, 14)
    scene.now_s += 0.3
    scene.status(1)
    scene.now_s += GRACE_S
    scene.limit(10)
    assert not scene.violations


def test_a_second_fall_does_not_lengthen_the_grace_of_the_first(scene):
    scene.setpoint(1, 32, validity_s=20)
    scene.limit(12)
    scene.now_s += 1.5
    scene.limit(10)
    scene.now_s += 0.6
    scene.limit(10)
    assert scene.violations[0].allowed_W == 12_000


def test_a_silent_gateway_means_the_failsafe_limit_after_five_seconds(scene):
    scene.setpoint(1, 32, validity_s=60)
    for after_s, expected in ((4.9, 0), (2.0, 0), (0.2, 1)):
        scene.now_s += after_s
        scene.status(1)
        assert len(scene.violations) == expected
    assert scene.violations[0].allowed_W == FAILSAFE_W


def test_the_gateway_s_own_failsafe_limit_and_validity_count(scene):
    scene.limit(22, validity_s=1, failsafe_kw=8)
    scene.now_s += 1.1
    scene.status(1)
    assert scene.account.limit.present_W == 8000


def test_active_without_a_limit_is_a_sign_of_life_only(scene):
    scene.now_s += 4
    scene.limit(None)
    scene.now_s += 1.1
    scene.status(1)
    assert scene.account.limit.present_W == FAILSAFE_W


def test_an_inactive_limit_leaves_the_station_s_own(scene):
    scene.limit(None, active=0)
    assert scene.account.limit.present_W == STATION_W
    scene.limit(-5)
    assert scene.account.limit.present_W == 0


# ---- Connectors and vehicles

def visit(**changes):
    return Visit(**({"node": 1, "arrival_s": 0, "departure_s": 3600, "battery_kwh": 50, "soc_arrival": 0.5,
                     "soc_target": 0.9, "max_kw": 11, "taper_kw": 4} | changes))


def test_a_battery_takes_the_least_of_current_taper_and_need():
    assert visit().charge(6, 1) == pytest.approx(6 * 690)
    assert visit().charge(32, 1) == pytest.approx(9000)
    almost_full = visit(soc_target=0.5001)
    assert almost_full.charge(32, 3600) == pytest.approx(5)
    assert almost_full.complete


def test_a_connector_uses_its_fallback_current_when_the_setpoint_expires(wire):
    connector = Connector(1, [visit()])
    connector.step(0.0, 0.0, 1.0, None)
    _, data = wire.frame("SETPOINT", 1, 5, {"command": 1, "current": 12, "validity": 2, "fallback_current": 6,
                                           "phase_mask": 7, "session": 1})
    assert connector.on_setpoint(0.0, wire, data)
    connector.step(1.0, 1.0, 1.0, None)
    assert connector.visit.energy_kwh == pytest.approx(12 * KW_PER_A / 3600)
    connector.step(2.0, 2.0, 1.0, None)
    frames = dict(connector.due(wire, 2.0))
    status = wire.read("EVSE_STATUS", frames[wire.can_id("EVSE_STATUS", 1)], "current_l1", "fallback_active",
                       "setpoint_echo")
    assert status == pytest.approx([6.0, 1, 5])


def test_a_setpoint_for_another_session_is_refused_unless_it_pauses(wire):
    connector = Connector(1, [visit()])
    connector.step(0.0, 0.0, 1.0, None)
    for command, accepted in ((CHARGE, False), (PAUSE, True)):
        _, data = wire.frame("SETPOINT", 1, 5, {"command": command, "current": 12, "validity": 2, "session": 9})
        assert connector.on_setpoint(0.0, wire, data) is accepted


def test_a_vehicle_that_comes_back_has_a_new_session_and_revision(wire):
    connector = Connector(1, [visit(departure_s=10), visit(arrival_s=10)])
    sessions = []
    for now_s in (0.0, 10.0, 10.1):
        connector.step(now_s, now_s, 1.0, 0.0)
        frames = dict(connector.due(wire, now_s))
        pilot, = wire.read("EVSE_STATUS", frames[wire.can_id("EVSE_STATUS", 1)], "pilot_state")
        parameters = frames.get(wire.can_id("EV_PARAM_A", 1))
        sessions.append((pilot, parameters and wire.read("EV_PARAM_A", parameters, "session", "revision")))
    assert sessions == [(2, [1, 1]), (0, None), (2, [2, 2])]


def test_frames_go_out_at_their_nominal_rates(wire):
    connector = Connector(1, [visit()])
    sent = {}
    for step in range(500):
        connector.step(step / 50, step / 50, 1.0, 0.0)
        for can_id, _ in connector.due(wire, step / 50):
            sent[wire.name[can_id >> 6]] = sent.get(wire.name[can_id >> 6], 0) + 1
    expected = {"EVSE_STATUS": 50, "EV_STATUS": 20, "EVSE_ELEC": 10, "EV_PARAM_A": 5, "EV_PARAM_B": 5, "EV_PARAM_C": 5,
                "EV_PARAM_D": 5, "EVSE_INFO": 2}
    assert sent == pytest.approx(expected, abs=1)


def test_the_default_vehicles_are_three_kinds_and_one_comes_back():
    visits = default_visits([1, 2, 3], 86400)
    assert [entry.node for entry in visits] == [1, 2, 3, 3]
    assert visits[2].departure_s < visits[3].arrival_s


def test_vehicles_come_from_a_sessions_file(tmp_path):
    file = tmp_path / "sessions.csv"
    file.write_text("session_id,connector,arrival_s,departure_s,battery_kwh,soc_arrival,soc_target,max_kw,taper_kw\n"
                    "a,2,600,7200,60,0.2,0.8,11,3\nb,5,0,7200,60,0.2,0.8,11,3\n")
    (only,) = read_visits(file, [1, 2, 3])
    assert (only.node, only.arrival_s, only.wanted_kwh) == (2, 600, pytest.approx(36))


# ---- The whole program, on python-can's virtual bus

class FakeStation(threading.Thread):
    """Gives node 1 a constant setpoint, over a bus of its own."""

    def __init__(self, wire, channel, current_A):
        super().__init__(daemon=True)
        self.wire, self.current_A = wire, current_A
        self.bus = can.Bus(interface="virtual", channel=channel)
        self.over = threading.Event()

    def run(self):
        counter = 0
        while not self.over.wait(0.1):
            can_id, data = self.wire.frame("SETPOINT", 1, counter % 16, {
                "command": CHARGE, "current": self.current_A, "validity": 3, "phase_mask": 7, "session": 1})
            self.bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))
            counter += 1
        self.bus.shutdown()


def run_program(monkeypatch, tmp_path, wire, current_A, limit_kw):
    channel = f"independent-{time.monotonic_ns()}"
    monkeypatch.setattr(independent, "_open", lambda interface: can.Bus(
        interface="virtual", channel=channel, receive_own_messages=True))
    station = FakeStation(wire, channel, current_A)
    station.start()
    code = independent.main(["--nodes", "1", "--seconds", "2.5", "--time-scale", "3600", "--gateway",
                             "--limit-kw", limit_kw, "--grace-ms", "300", "--report", str(tmp_path / "report.json")])
    station.over.set()
    station.join()
    return code, json.loads((tmp_path / "report.json").read_text())


def test_a_run_within_the_limit_charges_and_succeeds(monkeypatch, tmp_path, wire):
    code, report = run_program(monkeypatch, tmp_path, wire, 10, "8")
    assert code == 0 and report["ok"]
    assert report["violations"] == [] and report["e2e"]["crc"] == 0
    assert 0 <= report["worst_margin_W"] <= 1100 + 1
    assert report["energy_kwh"] > 3
    assert report["setpoints"]["1"] > 5
    assert report["frames"]["by_message"]["EVSE_STATUS"] > 10


def test_a_limit_that_the_station_ignores_fails_the_run(monkeypatch, tmp_path, wire, capsys):
    code, report = run_program(monkeypatch, tmp_path, wire, 10, "8,1:4.2")
    assert code == 1 and not report["ok"]
    assert report["violations"][0]["allowed_W"] == 4200
    assert report["violations"][0]["excess_W"] == pytest.approx(2700)
    assert "2700.0 W above" in capsys.readouterr().err


def test_wrong_usage_is_said_in_words(capsys):
    for arguments in (["--nodes", "0"], ["--limit-kw", "20:40,10:30"]):
        with pytest.raises(SystemExit) as stop:
            independent.main(arguments)
        assert stop.value.code == 2
    assert independent.main(["--can", "nocan9"]) == 2
    assert "ip link add dev nocan9 type vcan" in capsys.readouterr().err
