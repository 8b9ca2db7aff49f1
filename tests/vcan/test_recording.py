"""The daemon's files on vcan: its store, its recordings, and their replay."""

import re
import shutil
import subprocess
import time
from pathlib import Path

import can
import pytest
from conftest import PATIENCE_S, program, wait_until
from daemon_bench import HUB, ear, end, field, listen, only, station, values  # fixtures among them
from street import CHARGE, CTRL_STATUS, EMCY, OUTLOOK, PLAN, SETPOINT, Bus, Street, bits, is_sound


def replay(log, *options):
    done = subprocess.run([program("TAPER_SIM"), "--replay-log", str(log), *options], capture_output=True, text=True,
                          timeout=PATIENCE_S, check=False)
    return done.returncode, done.stdout, done.stderr


def copy_of(recording, folder, lines):
    """A recording with other lines, and its companion."""
    shutil.copy(f"{recording}.station", folder / "copy.log.station")
    (folder / "copy.log").write_text("".join(lines))
    return folder / "copy.log"


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
    return function in (SETPOINT, PLAN, OUTLOOK) or (function in (EMCY, CTRL_STATUS) and node == 0)


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
    assert {message.arbitration_id >> 6 for message in sent} >= {SETPOINT, CTRL_STATUS, PLAN, OUTLOOK}
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
