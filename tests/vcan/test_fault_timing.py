"""Faults whose reaction is a matter of time (docs/protocol.md), with the daemon on vcan.

Upper bounds are generous, for the machine may be busy. Lower ones are exact: a reservation that ends early is a fault. One
station goes through all of them; each test begins with vehicles that charge. Fault 16 is in test_bus_load.py.
"""

import signal
import socket
import time
from itertools import pairwise

import pytest
from conftest import PATIENCE_S, Running, medium, system, wait_until
from scene import ALONE, FAILSAFE, FAILSAFE_W, FALLBACK_dA, FALLBACKS, LIMIT_W, NODES, W_PER_dA, Frame, Scene, all_sound
from street import CTRL_STATUS, EVSE_STATUS, GATEWAY, SETPOINT, SITE_LIMIT

LATE_S = 2.0  # for a busy machine
TICK_S = 1.0
VALIDITY_S = 3.0
QUEUE_S = 0.5  # which a setpoint may have waited: the station counts its validity from then
REACTION_S = 5.0  # of a vehicle
SETPOINT_S = 0.5  # period
ERROR_BUSOFF = socket.CAN_ERR_FLAG | 0x40
OTHERS = [node for node in NODES if node != ALONE]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    running = []

    def start(*arguments):
        running.append(Running(arguments))
        return running[-1]

    one = Scene(start, tmp_path_factory.mktemp("scene"))
    try:
        one.wait_until_all_charge()
        yield one
    finally:
        one.close()
        for program in reversed(running):
            program.stop()


def sums(scene, nodes, since_s, what=Frame.told_dA):
    """(time, sum of what these connectors were told [0.1 A]) after each setpoint."""
    told = dict.fromkeys(nodes, 0)
    found = []
    for frame in scene.bus.since(since_s - 2 * SETPOINT_S, SETPOINT, nodes):
        told[frame.node] = what(frame)
        if frame.time_s >= since_s:
            found.append((frame.time_s, sum(told.values())))
    return found


def test_row_11_a_connector_that_falls_silent_keeps_its_reservation_until_it_has_expired(scene):
    with scene.held(scene.alone):
        silent_s = scene.bus.last(EVSE_STATUS, ALONE).time_s
        scene.station.wait_for(f"event=connector_lost bus=0 node={ALONE}")
        assert time.time() - silent_s < 1 + TICK_S + LATE_S
        last = [frame for frame in scene.bus.since(silent_s - 1, SETPOINT, {ALONE}) if frame.told_dA() > 0][-1]
        spare_dA = LIMIT_W // W_PER_dA - last.told_dA()
        taken_s = wait_until(lambda: next((at_s for at_s, sum_dA in sums(scene, OTHERS, silent_s) if sum_dA > spare_dA), None),
                             "what the lost connector had, given to others")
        held_s = VALIDITY_S + REACTION_S
        assert held_s <= taken_s - last.time_s <= held_s + QUEUE_S + 3 * TICK_S + LATE_S
        assert scene.told_dA()[ALONE] == 0
        kept_dA = LIMIT_W // W_PER_dA - last.fallback_dA()
        assert max(sum_dA for _, sum_dA in sums(scene, OTHERS, silent_s)) <= kept_dA
        back_s = time.time()
    scene.station.wait_for(f"event=connector_back bus=0 node={ALONE}")
    scene.bus.first(back_s, EVSE_STATUS, lambda frame: not frame.has_fallen_back(), "its acceptance of a setpoint", {ALONE})
    scene.wait_until_charging(back_s)


def test_row_10_delayed_frames_count_when_they_come_and_silence_before_as_a_timeout(scene):
    delay_s = 2.0
    with medium("netem", "delay", f"{delay_s:g}s", "limit", "100000"):
        began_s = time.time()
        for _ in NODES:
            scene.station.wait_for("event=connector_lost")
        assert time.time() - began_s < 1 + TICK_S + LATE_S
        for _ in NODES:
            scene.station.wait_for("event=connector_back")
        assert time.time() - began_s > delay_s
    scene.wait_until_charging()


@pytest.mark.parametrize("way", ["bus-off", "interface down"])
def test_row_17_off_the_bus_it_sends_nothing_and_comes_back_by_itself(scene, way):
    began_s = time.time()
    if way == "bus-off":
        scene.inject(ERROR_BUSOFF)
    else:
        system("ip", "link", "set", "vcan0", "down")
    scene.station.wait_for("event=bus_off")
    off_s = time.time()
    if way == "interface down":
        time.sleep(1)
        system("ip", "link", "set", "vcan0", "up")
    scene.station.wait_for("event=bus_back")
    wait_until(lambda: scene.bus.since(off_s, CTRL_STATUS, {0}), "its status")
    times = [frame.time_s for frame in scene.bus.since(0, SETPOINT)]
    assert max(after - before for before, after in pairwise(times) if after > began_s) >= 0.9  # the first pause is 1 s
    scene.wait_until_charging()


def test_row_18_on_a_bus_that_takes_no_frames_it_gives_up_and_what_comes_later_is_new(scene):
    with medium("tbf", "rate", "1kbit", "burst", "100", "limit", "1mb"):
        blocked_s = time.time()
        scene.station.wait_for("event=send_blocked")
        assert time.time() - blocked_s > 1
    free_s = time.time()
    scene.station.wait_for("event=bus_back")
    scene.wait_until_charging(free_s)
    for node in NODES:  # nothing that waited was sent late: counters go on by one
        counters = [frame.data[1] & 15 for frame in scene.bus.since(free_s + 0.1, SETPOINT, {node})]
        assert {(second - first) % 16 for first, second in pairwise(counters)} <= {1}


def test_row_13_and_14_a_silent_gateway_means_failsafe_until_there_is_a_limit_again(scene):
    scene.gateway.says = None
    last_s = scene.bus.last(SITE_LIMIT, GATEWAY).time_s
    failsafe = scene.bus.first(last_s, CTRL_STATUS, lambda frame: frame.data[1] >> 4 == FAILSAFE, "failsafe", {0})
    assert 5 < failsafe.time_s - last_s <= 5 + TICK_S + LATE_S
    wait_until(lambda: sum(scene.told_dA().values()) * W_PER_dA <= FAILSAFE_W, "currents within the failsafe limit")
    scene.gateway.says = "heartbeat"
    beats_s = time.time()
    time.sleep(4)
    assert {mode for _, mode in scene.modes(beats_s)} == {FAILSAFE}
    assert max(sum_dA for _, sum_dA in sums(scene, NODES, beats_s)) * W_PER_dA <= FAILSAFE_W
    assert scene.bus.since(beats_s, SITE_LIMIT, {GATEWAY})
    scene.gateway.says = "limit"
    limit_s = time.time()
    scene.bus.first(limit_s, CTRL_STATUS, lambda frame: frame.data[1] >> 4 != FAILSAFE, "the end of failsafe", {0})
    wait_until(lambda: sum(scene.told_dA().values()) * W_PER_dA > FAILSAFE_W, "more than the failsafe limit")


def test_row_20_two_controllers_stop_charging_and_the_one_that_stays_resumes(scene):
    second = scene.start_station()
    scene.station.wait_for("event=two_controllers")
    second.wait_for("event=two_controllers")
    both_s = time.time() + SETPOINT_S + 0.2
    time.sleep(3)
    second.process.send_signal(signal.SIGKILL)
    ended_s = time.time()
    told = [frame for frame in scene.bus.since(both_s, SETPOINT) if frame.time_s < ended_s]
    assert len(told) > 2 * len(NODES) * 2 and all_sound(told)
    assert {frame.told_dA() for frame in told} == {0}
    resumed = scene.bus.first(ended_s, SETPOINT, lambda frame: frame.told_dA() > 0, "charging")
    assert resumed.time_s - ended_s > 4  # the other may only be slow


def test_row_12_without_a_controller_every_connector_falls_back_when_its_setpoint_ends(scene):
    wait_until(lambda: sum(scene.fallback_dA().values()) == FALLBACKS * FALLBACK_dA, "as many fallback currents as can be")
    scene.station.process.send_signal(signal.SIGKILL)
    scene.station.process.wait(PATIENCE_S)
    for node in NODES:
        last_s = scene.bus.last(SETPOINT, node).time_s
        fallen = scene.bus.first(last_s, EVSE_STATUS, lambda frame: frame.has_fallen_back(), f"fallback of {node}", {node})
        assert VALIDITY_S - 0.1 <= fallen.time_s - last_s <= VALIDITY_S + 0.5 + LATE_S
        assert [frame.time_s for frame in scene.bus.since(last_s, SETPOINT, {node})] == [last_s]
    wait_until(lambda: scene.current_dA() == scene.fallback_dA(), "fallback currents, each what it was told last")
    assert sum(scene.current_dA().values()) == FALLBACKS * FALLBACK_dA
    assert max(sum_dA for _, sum_dA in sums(scene, NODES, 0, Frame.fallback_dA)) * W_PER_dA <= FAILSAFE_W


def test_row_29_a_controller_that_is_back_charges_within_ten_seconds_and_not_before_it_knows_the_limit(scene):
    began_s = time.time()
    scene.station = scene.start_station()
    charging = scene.bus.first(began_s, SETPOINT, lambda frame: frame.told_dA() > 0, "charging")
    heard = [frame.time_s for frame in scene.bus.since(began_s, SITE_LIMIT, {GATEWAY})]
    assert heard[0] < charging.time_s <= began_s + 10
    for node in NODES:
        scene.bus.first(began_s, SETPOINT, lambda frame: frame.told_dA() > 0, f"charging of {node}", {node})
    assert scene.modes(began_s)[0][1] == 0  # INIT
