"""The daemon on vcan: what it sends, what it tells the service manager, its log, and what it cannot do."""

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

import pytest
from conftest import PATIENCE_S, program, wait_until
from daemon_bench import HUB, ear, end, field, listen, only, station, values  # fixtures among them
from street import CHARGE, CTRL_STATUS, PAUSE, SETPOINT, bits, is_sound

LINE = re.compile(r'^ts=\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z level=(error|warning|info|debug) event=[a-z0-9_-]+'
                  r'( [a-zA-Z0-9_]+=([^" ]+|"([^"\\]|\\.)*"))*$')


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


def test_sigterm_tells_every_connector_three_times_to_use_its_fallback_current(station, field, ear):
    street_ = field()
    running = station()
    # 6 A on three phases are 4140 W: the failsafe limit of 11 kW carries two.
    wait_until(lambda: sum(one.fallback_da for one in street_.connectors) == 120, "fallback currents")
    listen(ear, 0.5)  # what came meanwhile: its socket may be full
    running.process.send_signal(signal.SIGTERM)
    heard = listen(ear, 2)
    assert running.finish() == 0
    told = []
    for node in range(1, HUB + 1):
        last = [data for _, identifier, data in heard if identifier == SETPOINT << 6 | node][-3:]
        told.append({(bits(data, 12, 4), bits(data, 16, 16), bits(data, 40, 8) * 5) for data in last})
        assert [(second[1] - first[1]) % 16 for first, second in pairwise(last)] == [1, 1]
    assert sorted(told, key=str) == [{(PAUSE, 0, 0)}] * 6 + [{(CHARGE, 60, 60)}] * 2
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
    assert int(values(running.wait_for("event=tick_overrun").string)["ms"]) == int(overrun["missed_ticks"]) * 1000
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


def test_a_daemon_that_is_late_with_every_tick_leaves_the_watchdog_to_bite(station, tmp_path):
    with listening(str(tmp_path / "notify")) as manager:
        running = station(before=("env", f"LD_PRELOAD={program('TAPER_LATE_CLOCK')}"),
                          env=os.environ | {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "2000000"})
        for _ in range(4):
            assert int(values(running.wait_for("event=tick_overrun").string)["ms"]) > 500
        running.process.send_signal(signal.SIGTERM)
        assert words_until(manager, "STOPPING=1").count("WATCHDOG=1") <= 2


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


def test_the_log_tells_of_limits_that_flap_or_are_negative(station, field):
    street_ = field(limit_w=60000)
    running = station()
    running.wait_for("event=mode mode=plan")
    street_.limit_w = 40000
    time.sleep(2)
    street_.limit_w = 50000
    running.wait_for("event=limit_flaps bus=0 node=62 before_W=40000$")
    street_.limit_w = (0x10000 - 10) * 100
    running.wait_for("event=limit_negative bus=0 node=62 limit_W=-1000$")


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
        (("--can", "vcan0", "--station", "hub", "--iterations", "0"), 2, "--iterations: not a whole number"),
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
