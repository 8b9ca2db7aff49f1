"""The independent program's connectors and vehicles, and the whole of it on python-can's virtual bus."""

import json
import threading
import time

import can
import pytest

import independent
from peer.connector import Connector
from peer.vehicle import Visit, default_visits, read_visits

PAUSE, CHARGE = 0, 1
KW_PER_A = 0.69  # three phases of 230 V


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
