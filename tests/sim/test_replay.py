"""The replay of a recorded bus: what is refused, and what is taken from the recording's companion.

That recordings are reproduced, tests/vcan shows.
"""

import pytest

STATUS = "(1700000000.000000) vcan0 240#0000000000000000"
GIVEN = ("--replay-log", "bus.log", "--station", "hub")
OWN = ("--replay-log", "bus.log")
COMPANION = """format=1
version=0.1.0
station=hub
limit_W=80000
failsafe_W=9000
tick_ms=500
time_scale=60
iterations=70
planner=no
start_us=1699999999500000
bus_0=vcan0
"""


@pytest.fixture
def own(sim):
    """own(OLD, NEW) writes a recording of the station's own, whose companion says NEW instead of OLD."""

    def write(old="", new="", text=f"{STATUS}\n"):
        assert old in COMPANION
        sim.write("bus.log", text)
        sim.write("bus.log.station", COMPANION.replace(old, new) if old else COMPANION)

    return write


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (OWN, "--replay-log needs --station, for there is no bus.log.station"),
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


def test_a_recording_of_the_stations_own_needs_no_other_option(sim, own):
    own()
    run = sim.call(*OWN)
    assert run.code == 4
    # The companion's start is half a second before, which is a tick: the recording misses the first.
    assert run.stdout.startswith("difference at 0.500 s (1700000000.000000): vcan0 id 240, recorded 0000000000000000")
    assert "1 ticks have no CTRL_STATUS" in run.stdout
    assert run.stderr == ""


def test_options_that_agree_with_the_companion_are_taken(sim, own):
    own()
    run = sim.call(*GIVEN, "--limit-kw", "80", "--failsafe-kw", "9", "--tick-ms", "500", "--time-scale", "60",
                   "--iterations", "70", "--no-planner", "--can", "vcan0")
    assert run.stderr == ""
    assert run.stdout.startswith("difference at 0.500 s")


@pytest.mark.parametrize(
    ("arguments", "others"),
    [
        (("--limit-kw", "70"), "limit_W=70000"),
        (("--limit-kw", "7"), "limit_W=7000 failsafe_W=7000"),
        (("--failsafe-kw", "11"), "failsafe_W=11000"),
        (("--time-scale", "1", "--tick-ms", "250"), "tick_ms=250 time_scale=1"),
        (("--iterations", "80"), "iterations=80"),
        (("--can", "vcan0", "--can", "other"), "bus_1=other"),
    ],
)
def test_options_that_do_not_agree_go_before_the_companion_with_a_note(sim, own, arguments, others):
    own()
    run = sim.call(*OWN, *arguments)
    assert run.stderr.splitlines()[0] == f"taper-sim: note: not as bus.log.station says: {others}"


def test_another_interface_goes_before_that_of_the_companion(sim, own):
    own(text=f"{STATUS}\n{STATUS.replace('vcan0', 'other')}\n")
    run = sim.call(*OWN, "--can", "other")
    assert run.stderr == "taper-sim: note: not as bus.log.station says: bus_0=other\n"
    assert "other id 240" in run.stdout


def test_another_station_needs_limits_that_it_can_have(sim, own):
    own("hub\nlimit_W=80000", "garage\nlimit_W=400000")
    run = sim.call(*GIVEN)
    assert run.code == 2
    assert run.stderr == "taper-sim: --limit-kw: above the own limit of station hub, 110 kW\n"
    run = sim.call(*GIVEN, "--limit-kw", "80")
    assert run.code == 4
    assert run.stderr == "taper-sim: note: not as bus.log.station says: station=hub limit_W=80000\n"


def test_a_recording_of_another_version_is_replayed_with_a_note(sim, own):
    own("version=0.1.0", "version=0.0.9")
    run = sim.call(*OWN)
    assert run.code == 4
    assert run.stderr.startswith("taper-sim: note: not as bus.log.station says: version=")


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ("format=1", "format=2", "1: format: 2 is newer than what this program knows, 1: replay it with a newer one"),
        ("format=1\n", "", "1: format: missing: it is the first line"),
        ("version", "colour=red\nversion", "2: colour: unknown key"),
        ("station=hub", "station=hub\nstation=hub", "4: station: given in line 3 before"),
        ("station=hub", "station hub", "3: station hub: not KEY=VALUE"),
        ("limit_W=80000", "limit_W=110001", "4: limit_W: not a whole number in 0..110000: '110001'"),
        ("start_us=1699999999500000\n", "", "11: start_us: missing"),
    ],
)
def test_a_companion_that_cannot_be_right_is_refused(sim, own, old, new, error):
    own(old, new)
    run = sim.call(*OWN)
    assert run.code == 1
    assert run.stderr == f"bus.log.station:{error}\n"
    assert run.stdout == ""


@pytest.mark.parametrize("text", ["x" * 5000, "format=1\n\0"])
def test_a_companion_that_is_something_else_is_refused(sim, text):
    sim.write("bus.log", f"{STATUS}\n")
    sim.write("bus.log.station", text)
    run = sim.call(*GIVEN)
    assert run.code == 1
    assert run.stderr == "bus.log.station: not the companion of a recording\n"


@pytest.mark.parametrize("when", ["1700000000.000500", "1699999999.499000"])
def test_a_companion_of_another_recording_is_refused(sim, own, when):
    own(text=f"{STATUS}\n{STATUS.replace('1700000000.000000', when)}\n")
    run = sim.call(*OWN)
    assert run.code == 1
    assert f"bus.log: ({when}) is no time of the recording that bus.log.station tells about" in run.stderr


@pytest.mark.parametrize("word", ["", " R", " T"])
def test_who_sent_a_frame_is_told_by_its_identifier_whatever_the_log_says(sim, own, word):
    text = f"{STATUS}{word}\n"
    own(text=text)
    assert sim.call(*OWN).stdout.startswith("difference at 0.500 s")
    sim.write("foreign.log", text)
    foreign = sim.call("--replay-log", "foreign.log", "--station", "hub")
    assert foreign.stdout.startswith("difference at 0.000 s")
