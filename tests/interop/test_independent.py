"""The independent program's account: it finds what it must find, and nothing else. No interface is needed."""

from pathlib import Path

import cantools
import pytest

from peer.account import Account, Limit
from peer.observer import Observer
from peer.wire import GATEWAY_NODE, Receiver, self_check

DBC = Path(__file__).resolve().parents[2] / "codegen" / "taper.dbc"
PAUSE, CHARGE = 0, 1
STATION_W, FAILSAFE_W, GRACE_S = 110_000.0, 11_000.0, 2.0
KW_PER_A = 0.69  # three phases of 230 V


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
