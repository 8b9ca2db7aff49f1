"""The replay of a recorded bus: what is refused. That recordings are reproduced, tests/vcan shows."""

import pytest

STATUS = "(1700000000.000000) vcan0 240#0000000000000000"
GIVEN = ("--replay-log", "bus.log", "--station", "hub")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("--replay-log", "bus.log"), "--replay-log needs --station"),
        ((*GIVEN, "--policy", "edf"), "--policy and --replay-log exclude each other"),
        ((*GIVEN, "--tick-s", "1"), "--tick-s and --replay-log exclude each other"),
        ((*GIVEN, "--out", "out"), "--out and --replay-log exclude each other"),
        ((*GIVEN, "--limit-kw", "111"), "--limit-kw: above the own limit of station hub, 110 kW"),
        ((*GIVEN, "--failsafe-kw", "12"), "--failsafe-kw: above the own failsafe limit"),
        ((*GIVEN, "--time-scale", "0"), "--time-scale: not a whole number"),
        ((*GIVEN, "--tick-ms", "1001"), "--tick-ms: not a whole number"),
        ((*GIVEN, *("--can", "vcan0") * 5), "--can: more than 4 buses"),
        (("--sessions", "x.csv", "--policy", "edf", "--time-scale", "2"), "--time-scale needs --replay-log"),
        (("--sessions", "x.csv", "--policy", "edf", "--no-planner"), "--no-planner needs --replay-log"),
    ],
)
def test_options_that_make_no_sense_together_are_refused(sim, arguments, reason):
    run = sim.call(*arguments)
    assert run.code == 2
    assert reason in run.stderr
    assert run.stdout == ""


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no CTRL_STATUS"),
        ("(1700000000.000000) vcan0 0C1#0000000000000000\n", "no CTRL_STATUS"),
        (f"{STATUS}\nnot a line\n", "bus.log: line 2 is not one of a CAN log"),
        (f"{STATUS}\n{STATUS.replace('vcan0', 'vcan1')}\n", "more interfaces than the station has buses (1)"),
    ],
)
def test_a_log_that_cannot_be_replayed_is_refused(sim, text, reason):
    sim.write("bus.log", text)
    run = sim.call(*GIVEN)
    assert run.code == 1
    assert reason in run.stderr


def test_a_log_that_is_not_there_is_refused(sim):
    run = sim.call(*GIVEN)
    assert run.code == 1
    assert "bus.log: No such file" in run.stderr


def test_interfaces_that_are_not_the_stations_are_passed_over_if_its_own_are_named(sim):
    sim.write("bus.log", f"{STATUS.replace('vcan0', 'other')}\n{STATUS}\n")
    run = sim.call(*GIVEN, "--can", "vcan0")
    assert run.code == 4
    assert "difference at 0.000 s (1700000000.000000): vcan0 id 240, recorded 0000000000000000, replayed " in run.stdout


def test_a_last_line_that_was_cut_short_is_left_out(sim):
    sim.write("bus.log", f"{STATUS}\n(1700000000.00")
    run = sim.call(*GIVEN)
    assert run.code == 4
    assert "the last line is cut short, and left out" in run.stderr
