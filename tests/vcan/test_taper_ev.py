"""taper-ev: its command line, how it finds the station, and a few hours beside the station's daemon."""

import csv
import json
import re
import signal
import subprocess
import threading

import can
import pytest
from conftest import PATIENCE_S, program

TIME_SCALE = 600
COLUMNS = ("session_id", "connector", "arrival_s", "departure_s", "battery_kwh", "soc_arrival", "soc_target", "max_kw",
           "taper_kw")
TWO_HOURS = [("first", "", 36_030, 43_200, 60, 0.5, 0.6, 11, 0), ("second", 5, 36_300, 43_200, 60, 0.5, 0.7, 22, 10)]
GIVEN = ("--can", "vcan0", "--sessions", "sessions.csv")
SETPOINT = 0x0C0


@pytest.fixture
def folder(tmp_path):
    """A folder with the sessions of two hours."""
    write_sessions(tmp_path, TWO_HOURS)
    return tmp_path


def write_sessions(folder, rows):
    with (folder / "sessions.csv").open("w", newline="") as file:
        csv.writer(file).writerows([COLUMNS, *rows])


def call(folder, *arguments):
    return subprocess.run([program("TAPER_EV"), *arguments], cwd=folder, capture_output=True, text=True, check=False,
                          timeout=PATIENCE_S)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("--sessions", "sessions.csv"), "--can is needed"),
        (("--can", "vcan0"), "--sessions is needed"),
        ((*GIVEN, *("--can", "vcan1") * 4), "--can: more than 4 interfaces"),
        ((*GIVEN, "--station", "moon"), "unknown station 'moon'"),
        ((*GIVEN, "--time-scale", "0"), "--time-scale: not a whole number in 1..1000: '0'"),
        ((*GIVEN, "--limit-kw", "-1"), "--limit-kw: below 0"),
        ((*GIVEN, "--limit-kw", "10", "--limit-csv", "limit.csv"), "exclude each other"),
        ((*GIVEN, "--no-gateway", "--limit-kw", "10"), "--no-gateway: there is nobody then to tell a limit"),
        ((*GIVEN, "--connectors", "0"), "--connectors: not a list"),
        ((*GIVEN, "--connectors", "3-1"), "--connectors: not a list"),
        ((*GIVEN, "--connectors", "1,"), "--connectors: not a list"),
        ((*GIVEN, "--connectors", "1-4x"), "--connectors: not a list"),
        ((*GIVEN, "--connectors", "+1"), "--connectors: not a list"),
        ((*GIVEN, "--connectors", "4-9", "--station", "hub"), "--connectors: station hub has 8 connectors"),
        ((*GIVEN, "extra"), "unexpected argument 'extra'"),
    ],
)
def test_a_bad_command_line_is_refused(folder, arguments, reason):
    run = call(folder, *arguments)
    assert (run.returncode, run.stdout) == (2, "")
    assert reason in run.stderr


def test_help_names_options_units_and_stations():
    run = call(None, "--help")
    text = " ".join(run.stdout.split())
    assert run.returncode == 0
    for word in ("--connectors=LIST", "garage", "[kW]", "TIME SCALE", "EXIT CODE"):
        assert word in text


def test_an_interface_that_is_not_there_is_named(folder):
    run = call(folder, "--can", "can7", "--sessions", "sessions.csv")
    assert run.returncode == 1
    assert "can7" in run.stderr


def test_a_bad_file_is_refused_before_anybody_waits(folder):
    write_sessions(folder, [(*TWO_HOURS[0][:3], "late", *TWO_HOURS[0][4:])])
    run = call(folder, *GIVEN)
    assert run.returncode == 1
    assert run.stderr.startswith("sessions.csv:2: departure_s: ")


class Beside:
    """taper-ev and the station's daemon in one folder."""

    def __init__(self, start, folder):
        self.start = start
        self.folder = folder

    def station(self, name="hub"):
        return self.start(program("TAPER_STATION"), "--can", "vcan0", "--station", name, "--time-scale", TIME_SCALE)

    def ev(self, *arguments):
        running = self.start(program("TAPER_EV"), *GIVEN, "--time-scale", TIME_SCALE, *arguments, cwd=self.folder)
        running.wait_for("^taper-ev: waiting for a controller on vcan0$")
        return running

    def read_csv(self, out, name):
        with (self.folder / out / name).open(newline="") as file:
            return list(csv.DictReader(file))


@pytest.fixture
def beside(start, folder):
    return Beside(start, folder)


def test_it_waits_for_a_controller_and_plays_the_station_that_it_finds(beside):
    ev = beside.ev("--limit-kw", "20", "--out", "out")
    beside.station()
    ev.wait_for("^live, station hub: 18.0 of 18.0 kWh .*2 of 2 sessions satisfied")
    assert ev.finish() == 0
    summary = json.loads((beside.folder / "out/summary.json").read_text())
    assert (summary["station"], summary["satisfied"], summary["limit_violations"]) == ("hub", 2, 0)
    sessions = beside.read_csv("out", "sessions.csv")
    assert [(row["session_id"], row["connector"]) for row in sessions] == [("first", "1"), ("second", "5")]
    steps = beside.read_csv("out", "steps.csv")
    assert int(steps[0]["time_s"]) == 36_000
    assert all(float(row["power_kw"]) <= 20.0 for row in steps)
    assert "plan" in {row["mode"] for row in steps}
    assert {row["connector"] for row in beside.read_csv("out", "connectors.csv")} == {"1", "5"}


def test_the_station_is_told_the_course_of_the_limit(beside):
    (beside.folder / "limit.csv").write_text("time_s,limit_kw\n0,20\n39600,5\n41400,20\n")
    station = beside.station()
    ev = beside.ev("--limit-csv", "limit.csv")
    station.wait_for(r" event=curve_set .*points=3\b")
    assert ev.finish() == 0


def test_two_processes_share_one_field(beside):
    write_sessions(beside.folder, [(TWO_HOURS[0][0], 2, *TWO_HOURS[0][2:]), TWO_HOURS[1]])
    beside.station()
    some = beside.ev("--connectors", "1,2-4", "--limit-kw", "20", "--out", "some")
    others = beside.ev("--connectors", "5-8", "--no-gateway", "--out", "others")
    assert (some.finish(), others.finish()) == (0, 0)
    for out, session_id, connector in (("some", "first", "2"), ("others", "second", "5")):
        (row,) = beside.read_csv(out, "sessions.csv")
        assert (row["session_id"], row["connector"], row["satisfied"]) == (session_id, connector, "1")


@pytest.mark.parametrize("with_signal", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_with_the_results_so_far(beside, with_signal):
    beside.station()
    ev = beside.ev("--limit-kw", "20", "--out", "out", "--stay")
    bus = can.Bus("vcan0", interface="socketcan", can_filters=[{"can_id": 0x101, "can_mask": 0x7FF}])
    with bus:
        assert bus.recv(PATIENCE_S), "connector 1 said nothing"
    ev.process.send_signal(with_signal)
    ev.wait_for("^live, station hub: ")
    assert ev.finish() == 0
    assert len(beside.read_csv("out", "sessions.csv")) == 2


def test_a_signal_ends_the_wait_too(beside):
    ev = beside.ev()
    ev.process.send_signal(signal.SIGTERM)
    assert ev.finish() == 0


def test_a_controller_of_no_station_is_reported(beside):
    ev = beside.ev()
    done = threading.Event()

    def send():
        with can.Bus("vcan0", interface="socketcan") as bus:
            while not done.wait(0.2):
                for node in (1, 2, 3):
                    bus.send(can.Message(arbitration_id=SETPOINT + node, data=bytes(8), is_extended_id=False))

    sender = threading.Thread(target=send)
    sender.start()
    try:
        said = ev.wait_for("^taper-ev: the controller sends setpoints to 3 connectors").string
        assert ev.finish() == 1
    finally:
        done.set()
        sender.join()
    assert re.search(r"there are .*hub \(8\)", said)
