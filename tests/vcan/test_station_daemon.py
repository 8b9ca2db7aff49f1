"""The daemon on vcan: what it sends, what it tells the service manager, its log, its files, and the replay of its recording."""

import os
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from itertools import pairwise
from pathlib import Path

import can
import pytest
import street
from conftest import PATIENCE_S, program, wait_until
from street import CHARGE, CTRL_STATUS, PAUSE, SETPOINT, Bus, Street, bits, is_sound

HUB = 8  # connectors
LINE = re.compile(r'^ts=\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z level=(error|warning|info|debug) event=[a-z0-9_-]+'
                  r'( [a-zA-Z0-9_]+=([^" ]+|"([^"\\]|\\.)*"))*$')


def values(line):
    """The pairs of a line of the log."""
    return {name: value.strip('"') for name, value in re.findall(r'([a-zA-Z0-9_]+)=("(?:[^"\\]|\\.)*"|\S+)', line)}


@pytest.fixture
def station(start):
    """station(OPTION...) starts the daemon as the hub on vcan0."""

    def run(*options, before=(), **settings):
        arguments = (*before, program("TAPER_STATION"), "--can", "vcan0", "--station", "hub", *options)
        return start(*arguments, **settings)

    return run


@pytest.fixture
def field():
    """field(...) puts connectors and a gateway on vcan0 until the end of the test."""
    streets = []

    def run(connectors=HUB, **settings):
        streets.append(Street("vcan0", connectors, **settings))
        return streets[-1]

    yield run
    for one in streets:
        one.close()


@pytest.fixture
def ear():
    bus = Bus("vcan0")
    yield bus
    bus.close()


def listen(bus, seconds):
    """(time, identifier, data) of all that comes in a while."""
    heard = []
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        if frame := bus.receive(left):
            heard.append((time.monotonic(), *frame))
    return heard


def only(heard, function):
    return [frame for frame in heard if frame[1] >> 6 == function]


def replay(log, *options):
    done = subprocess.run([program("TAPER_SIM"), "--replay-log", str(log), *options], capture_output=True, text=True,
                          timeout=PATIENCE_S, check=False)
    return done.returncode, done.stdout, done.stderr


def copy_of(recording, folder, lines):
    """A recording with other lines, and its companion."""
    shutil.copy(f"{recording}.station", folder / "copy.log.station")
    (folder / "copy.log").write_text("".join(lines))
    return folder / "copy.log"


def end(running):
    """SIGTERM, and the exit code."""
    running.process.send_signal(signal.SIGTERM)
    return running.finish()


# What it sends


def test_it_sends_a_setpoint_to_each_connector_twice_a_second_and_its_status_once(station, ear):
    station().wait_for("event=started")
    heard = listen(ear, 6)
    assert all(is_sound(identifier, data) for _, identifier, data in heard)
    for node in range(1, HUB + 1):
        times = [when for when, identifier, _ in heard if identifier == SETPOINT << 6 | node]
        assert 10 <= len(times) <= 14, f"node {node}"
    assert 5 <= len(only(heard, CTRL_STATUS)) <= 7


def test_vehicles_charge_by_its_plans_within_the_limit_of_the_command_line(station, field, ear):
    street_ = field(limit_w=60000)
    running = station("--limit-kw", "22", "--failsafe-kw", "5")
    started = values(running.wait_for("event=start ").string)
    assert (started["limit_W"], started["failsafe_W"]) == ("22000", "5000")
    # 69 W per 0.1 A: three phases of 230 V
    wait_until(lambda: sum(one.told_da for one in street_.connectors) * 69 > 15000, "charging")
    heard = only(listen(ear, 4), CTRL_STATUS)[-3:]
    assert [bits(data, 12, 4) for _, _, data in heard] == [1, 1, 1]  # mode PLAN
    assert sum(one.told_da for one in street_.connectors) * 69 <= 22000


def test_sigterm_tells_every_connector_three_times_to_pause_with_no_fallback_current(station, field, ear):
    street_ = field()
    running = station()
    wait_until(lambda: any(one.told_da for one in street_.connectors), "charging")
    running.process.send_signal(signal.SIGTERM)
    heard = listen(ear, 2)
    assert running.finish() == 0
    for node in range(1, HUB + 1):
        last = [data for _, identifier, data in heard if identifier == SETPOINT << 6 | node][-3:]
        assert [bits(data, 12, 4) for data in last] == [PAUSE] * 3
        assert [bits(data, 16, 16) + bits(data, 40, 8) for data in last] == [0] * 3
        assert [(second[1] - first[1]) % 16 for first, second in pairwise(last)] == [1, 1]
    assert running.lines[-1].endswith("event=stop reason=signal")


def test_sigterm_ends_a_daemon_that_is_late_with_every_call(station):
    running = station(before=("env", f"LD_PRELOAD={program('TAPER_LATE_CLOCK')}"))
    running.wait_for("event=overrun")
    assert end(running) == 0
    assert running.lines[-1].endswith("event=stop reason=signal")


def test_sigint_stops_it_too_and_sighup_does_not(station):
    running = station()
    running.wait_for("event=started")
    running.process.send_signal(signal.SIGHUP)
    time.sleep(0.5)
    assert running.process.poll() is None
    running.process.send_signal(signal.SIGINT)
    assert running.finish() == 0


def test_ticks_that_it_slept_through_are_counted_and_not_made_up_for(station, ear):
    running = station()
    running.wait_for("event=started")
    running.process.send_signal(signal.SIGSTOP)
    time.sleep(3.5)
    listen(ear, 0.1)
    running.process.send_signal(signal.SIGCONT)
    overrun = values(running.wait_for("event=overrun").string)
    assert int(overrun["missed_ticks"]) in (2, 3)
    assert len(only(listen(ear, 0.5), CTRL_STATUS)) <= 2


def test_it_needs_no_rights(station, ear):
    """As nobody, where there is one, and without any capability."""
    folder = Path(tempfile.mkdtemp())
    try:
        folder.chmod(0o777)
        copy = shutil.copy(program("TAPER_STATION"), folder)
        mapped = any(int(line.split()[0]) <= 65534 < int(line.split()[0]) + int(line.split()[2])
                     for line in Path("/proc/self/uid_map").read_text().splitlines())
        nobody = ("--reuid=65534", "--regid=65534", "--clear-groups") if mapped else ()
        running = subprocess.Popen(["setpriv", *nobody, "--no-new-privs", "--inh-caps=-all", "--bounding-set=-all",
                                    copy, "--can", "vcan0", "--station", "hub", "--record", folder / "log", "--store",
                                    folder / "store"])
        try:
            assert only(listen(ear, 3), SETPOINT)
        finally:
            running.terminate()
        assert running.wait(PATIENCE_S) == 0
        assert (folder / "log").stat().st_size > 0
    finally:
        shutil.rmtree(folder)


# The service manager


def listening(address):
    manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    manager.bind(address)
    manager.settimeout(PATIENCE_S)
    return manager


def words_until(manager, wanted):
    words = []
    while not words or not words[-1].startswith(wanted):
        words.append(manager.recv(500).decode())
    return words


@pytest.mark.parametrize("abstract", [False, True])
def test_the_service_manager_hears_of_start_life_and_stop(station, tmp_path, abstract):
    address = f"\0taper-{os.getpid()}" if abstract else str(tmp_path / "notify")
    with listening(address) as manager:
        shown = address.replace("\0", "@")
        running = station(env=os.environ | {"NOTIFY_SOCKET": shown, "WATCHDOG_USEC": "2000000"})
        words = words_until(manager, "READY=1")
        assert "STOPPING=1" not in words
        kicks = []
        while len(kicks) < 4:
            words += words_until(manager, "WATCHDOG=1")
            kicks.append(time.monotonic())
        running.process.send_signal(signal.SIGTERM)
        words += words_until(manager, "STOPPING=1")
        assert running.finish() == 0
    assert any(re.fullmatch(r"STATUS=init, limit 0\.0 kW, 0 active", word) for word in words)
    assert max(after - before for before, after in pairwise(kicks)) < 2.0


def test_a_watchdog_that_is_not_ours_is_not_kicked(station, tmp_path):
    with listening(str(tmp_path / "notify")) as manager:
        running = station(env=os.environ | {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "2000000",
                                            "WATCHDOG_PID": "1"})
        words_until(manager, "READY=1")
        time.sleep(2.5)
        running.process.send_signal(signal.SIGTERM)
        assert "WATCHDOG=1" not in words_until(manager, "STOPPING=1")


# The log


def test_every_line_of_the_log_is_logfmt_and_tells_what_happens(station, field):
    street_ = field(scale=60)
    running = station("--time-scale", "60", "--log-level", "debug")
    running.wait_for("event=mode mode=plan")
    street_.silent = True
    running.wait_for("event=mode mode=failsafe")
    assert end(running) == 0
    assert [line for line in running.lines if not LINE.match(line)] == []
    events = [values(line)["event"] for line in running.lines]
    assert events[:2] == ["start", "started"]
    assert {"session_begun", "gateway_lost", "stopped", "summary"} <= set(events)
    summary = values(running.lines[-2])
    assert summary["guard_violations"] == "0"
    assert int(summary["frames_received"]) > 100


def test_under_journald_each_line_begins_with_its_priority(station):
    running = station(env=os.environ | {"JOURNAL_STREAM": "8:1"})
    running.wait_for("event=started")
    end(running)
    assert [line for line in running.lines if not line.startswith("<6>ts=")] == []


def test_only_lines_up_to_the_level_asked_for_are_written(station, ear):
    running = station("--log-level", "error")
    assert only(listen(ear, 2), SETPOINT)
    assert end(running) == 0
    assert running.lines == []


def test_a_log_that_nobody_reads_does_not_hold_it_up(ear):
    reader, writer = os.pipe()
    try:
        os.set_blocking(writer, False)
        with pytest.raises(BlockingIOError):
            while True:
                os.write(writer, b"x" * 4096)
        os.set_blocking(writer, True)
        running = subprocess.Popen([program("TAPER_STATION"), "--can", "vcan0", "--station", "hub"], stderr=writer)
        assert len(only(listen(ear, 3), CTRL_STATUS)) >= 2
        running.terminate()
        assert running.wait(PATIENCE_S) == 0
    finally:
        os.close(reader)
        os.close(writer)


# What it cannot do


@pytest.mark.parametrize(
    ("options", "code", "reason"),
    [
        (("--station", "hub"), 2, "--can is needed"),
        (("--can", "vcan0"), 2, "--station is needed: one of hub"),
        (("--can", "vcan0", "--station", "moon"), 2, "--station: unknown station 'moon'; there are hub"),
        (("--can", "vcan0", "--can", "vcan1", "--station", "hub"), 2, "--can: station hub has 1 bus, not 2"),
        (("--can", "vcan0", "--can", "vcan0", "--station", "hub"), 2, "--can: 'vcan0' is given twice"),
        (("--can", "a-name-that-is-too-long", "--station", "hub"), 2, "--can: not the name of a network interface"),
        (("--can", "vcan0", "--station", "hub", "--limit-kw", "111"), 2, "--limit-kw: above the own limit"),
        (("--can", "vcan0", "--station", "hub", "--limit-kw", "much"), 2, "--limit-kw: not a number"),
        (("--can", "vcan0", "--station", "hub", "--failsafe-kw", "12"), 2, "--failsafe-kw: above the own failsafe"),
        (("--can", "vcan0", "--station", "hub", "--tick-ms", "10"), 2, "--tick-ms: not a whole number in 20..1000"),
        (("--can", "vcan0", "--station", "hub", "--time-scale", "0"), 2, "--time-scale: not a whole number"),
        (("--can", "vcan0", "--station", "hub", "--iterations", "5"), 2, "--iterations: not a whole number"),
        (("--can", "vcan0", "--station", "hub", "--log-level", "loud"), 2, "--log-level: not one of"),
        (("--can", "vcan0", "--station", "hub", "extra"), 2, "unexpected argument 'extra'"),
        (("--can", "vcan7", "--station", "hub"), 1, "vcan7"),
        (("--can", "vcan0", "--station", "hub", "--record", "no/such/folder"), 1, "--record: no/such/folder: No such"),
    ],
)
def test_what_it_cannot_do_it_says_and_ends(tmp_path, options, code, reason):
    done = subprocess.run([program("TAPER_STATION"), *options], cwd=tmp_path, capture_output=True, text=True,
                          timeout=PATIENCE_S, check=False)
    assert done.returncode == code
    assert reason in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_help_and_version_are_there():
    for option, word in (("--help", "--time-scale"), ("--version", "taper-station ")):
        done = subprocess.run([program("TAPER_STATION"), option], capture_output=True, text=True, timeout=PATIENCE_S,
                              check=True)
        assert word in done.stdout


# Its files


def test_the_store_outlives_it(station, field, tmp_path):
    field()
    starts = []
    for _ in range(2):
        running = station("--store", str(tmp_path / "store"))
        starts.append(int(values(running.wait_for("event=started").string)["starts"]))
        wait_until(lambda: list(tmp_path.iterdir()), "a file of the store")
        end(running)
    assert starts[1] == starts[0] + 1
    assert {path.name for path in tmp_path.iterdir()} <= {"store.0", "store.1"}


def test_a_full_disk_ends_the_recording_and_nothing_else(station, ear):
    running = station("--record", "/dev/full")
    assert "No space left" in running.wait_for("event=record_error").string
    assert len(only(listen(ear, 3), CTRL_STATUS)) >= 2
    assert end(running) == 0
    assert sum("record_error" in line for line in running.lines) == 1
    assert not Path("/dev/full.station").exists()


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Half an hour of vehicles' time with replugging and changing limits: the station's recording and candump's."""
    folder = tmp_path_factory.mktemp("recording")
    options = ("--limit-kw", "80", "--time-scale", "60")
    candump = subprocess.Popen(["candump", "-l", "vcan0"], cwd=folder, stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    partners = Street("vcan0", HUB, scale=60)
    partners.replugs = True
    time.sleep(1.5)
    running = subprocess.Popen([program("TAPER_STATION"), "--can", "vcan0", "--station", "hub", *options, "--record",
                                folder / "own.log"])
    time.sleep(30)
    running.terminate()
    code = running.wait(PATIENCE_S)
    time.sleep(0.5)
    partners.close()
    candump.terminate()
    candump.wait(PATIENCE_S)
    assert code == 0
    (foreign,) = folder.glob("candump-*.log")
    return folder / "own.log", foreign, options


def is_sent(identifier):
    """Whether a frame is the station's, by its identifier."""
    function, node = identifier >> 6, identifier & 63
    return function in (SETPOINT, street.EMCY + 13) or (function in (street.EMCY, CTRL_STATUS) and node == 0)


def test_each_line_of_the_recording_is_one_of_candump(recording):
    lines = recording[0].read_text().splitlines(keepends=True)
    line = re.compile(r"\(\d{10}\.\d{3}000\) vcan0 [0-7][0-9A-F]{2}#([0-9A-F]{2}){0,8}\n")
    assert [wrong for wrong in lines if not line.fullmatch(wrong)] == []


def test_the_companion_tells_the_options_in_force_and_the_start(recording):
    own, _, _ = recording
    lines = Path(f"{own}.station").read_text().splitlines()
    assert lines[0] == "format=1"
    companion = dict(line.split("=", 1) for line in lines)
    version = subprocess.run([program("TAPER_STATION"), "--version"], capture_output=True, text=True, check=True).stdout
    start_us = int(companion.pop("start_us"))
    assert companion == {"format": "1", "version": version.split()[1], "station": "hub", "limit_W": "80000",
                         "failsafe_W": "11000", "tick_ms": "1000", "time_scale": "60", "iterations": "500",
                         "planner": "yes", "bus_0": "vcan0"}
    first = next(line for line in own.read_text().splitlines() if " 240#" in line)
    assert first.split()[0] == f"({start_us // 1000000}.{start_us % 1000000:06})"


def test_python_can_reads_the_recording(recording):
    messages = list(can.CanutilsLogReader(recording[0]))
    assert len(messages) > 1000
    assert {message.channel for message in messages} == {"vcan0"}
    sent = [message for message in messages if is_sent(message.arbitration_id)]
    assert {message.arbitration_id >> 6 for message in sent} >= {SETPOINT, CTRL_STATUS, street.EMCY + 13}
    assert all(is_sound(message.arbitration_id, bytes(message.data)) for message in messages)
    times = [message.timestamp for message in sent]
    assert times == sorted(times)
    status = [message.timestamp for message in sent if message.arbitration_id == 0x240]
    assert {round((when - status[0]) * 1000) % 1000 for when in status} == {0}
    assert any(bits(bytes(message.data), 12, 4) == CHARGE for message in sent
               if message.arbitration_id >> 6 == SETPOINT)


def test_canplayer_plays_the_recording(recording, tmp_path):
    lines = recording[0].read_text().splitlines(keepends=True)[:200]  # as much as a socket's queue holds
    (tmp_path / "begin.log").write_text("".join(lines))
    other = Bus("vcan1")
    try:
        subprocess.run(["canplayer", "-I", tmp_path / "begin.log", "-t", "vcan1=vcan0"], check=True, timeout=PATIENCE_S)
        heard = [f"{identifier:03X}#{data.hex().upper()}" for _, identifier, data in listen(other, 1)]
    finally:
        other.close()
    assert heard == [line.split()[2] for line in lines]


def test_replay_reproduces_the_recording_to_the_bit_and_needs_no_other_option(recording):
    own, _, _ = recording
    code, text, notes = replay(own)
    assert (code, notes) == (0, ""), text
    setpoints = sum(line.split()[2].startswith(("0C", "0D", "0E", "0F")) for line in own.read_text().splitlines())
    assert text.startswith(f"{setpoints} setpoints reproduced, and "), text
    assert setpoints > 400


def test_replay_takes_the_options_of_the_recording_once_more(recording):
    own, _, options = recording
    code, _, notes = replay(own, "--station", "hub", "--can", "vcan0", *options)
    assert (code, notes) == (0, "")


def test_replay_reproduces_what_python_can_made_of_the_recording(recording, tmp_path):
    """Which adds R and T as it thinks."""
    own, _, _ = recording
    with can.CanutilsLogWriter(tmp_path / "copy.log") as writer:
        for message in can.CanutilsLogReader(own):
            writer.on_message_received(message)
    lines = (tmp_path / "copy.log").read_text().splitlines(keepends=True)
    assert all(line.endswith((" R\n", " T\n")) for line in lines)
    code, text, _ = replay(copy_of(own, tmp_path, lines))
    assert code == 0, text


def test_replay_reproduces_a_log_of_candump(recording):
    _, foreign, options = recording
    code, text, _ = replay(foreign, "--station", "hub", *options)
    assert code == 0, text
    assert re.search(r"^\d{3,} setpoints reproduced", text, re.MULTILINE)


def test_replay_tells_the_first_difference(recording, tmp_path):
    own, _, _ = recording
    lines = own.read_text().splitlines(keepends=True)
    at = [number for number, line in enumerate(lines) if " 0C3#" in line][20]
    when, interface, frame = lines[at].split()
    changed = frame[:-1] + ("0" if frame[-1] != "0" else "1")
    lines[at] = f"{when} {interface} {changed}\n"
    code, text, _ = replay(copy_of(own, tmp_path, lines))
    assert code == 4
    assert when in text
    assert f"vcan0 id 0C3, recorded {changed[4:].lower()}, replayed {frame[4:].lower()}" in text


def test_replay_with_another_limit_differs_and_says_that_it_is_another(recording):
    code, text, notes = replay(recording[0], "--limit-kw", "10")
    assert code == 4
    assert text.startswith("difference at ")
    assert notes == f"taper-sim: note: not as {recording[0]}.station says: limit_W=10000 failsafe_W=10000\n"


def test_replay_notes_a_setpoint_that_is_missing_in_the_output(recording, tmp_path):
    """A received frame less is another history."""
    own, _, _ = recording
    kept = [line for line in own.read_text().splitlines(keepends=True) if " 0BE#" not in line]
    assert replay(copy_of(own, tmp_path, kept))[0] == 4


def test_the_recording_of_the_run_before_is_kept_with_its_companion(station, tmp_path):
    (tmp_path / "log").write_text("the run before\n")
    (tmp_path / "log.station").write_text("its companion\n")
    running = station("--record", str(tmp_path / "log"))
    running.wait_for("event=started")
    assert (tmp_path / "log.station").read_text().startswith("format=1\n")
    assert end(running) == 0
    assert (tmp_path / "log.old").read_text() == "the run before\n"
    assert (tmp_path / "log.station.old").read_text() == "its companion\n"
    assert " vcan0 0C1#" in (tmp_path / "log").read_text()
    assert {path.name for path in tmp_path.iterdir()} == {"log", "log.old", "log.station", "log.station.old"}
