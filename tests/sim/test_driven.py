"""A board's end of taper/drive.h, call by call: the twin on the host, which obeys by the boards' own code."""

import struct
import sys
import zlib
from pathlib import Path

import pytest
from conftest import csv_text, session
from test_board import twin

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

from taperlib.drive import (  # noqa: E402
    COUNTER,
    DONE,
    FIGURE,
    FIGURES,
    LOOK,
    LOOKED,
    POLL,
    SETUP,
    STEP,
    STOP,
    VALUE,
    Drive,
)

NOTHING_KNOWN = (0x7FF | 0x1FFFFF << 11).to_bytes(8, "little")
FRAMES_RECEIVED, RECEIVE_OVERFLOWS = 0, 9
STORED_FRAMES = 1024  # TAPER_SLCAN_RECEIVE_DEPTH


@pytest.fixture
def port():
    with twin() as bus:
        yield int(bus.rpartition(":")[2])


@pytest.fixture
def drive(port):
    with Drive(port) as attached:
        yield attached


def ask(drive, kind, index, answer, data=b""):
    """A question that Drive has no name for. Index and data of the answer."""
    drive._ask(kind, index, data)
    _, at, told = drive._wait_for(answer)
    return at, told


def ids(done):
    return [can_id for can_id, _ in done.frames]


@pytest.mark.parametrize("kind", [STEP, POLL, STOP])
def test_without_a_station_nothing_is_called(drive, kind):
    done = drive.call(kind, 1000)
    assert (done.ok, done.instructions, done.frames) == (False, 0, [])
    assert drive.counter(FRAMES_RECEIVED) == 0
    assert ask(drive, LOOK, 0, LOOKED) == (0, NOTHING_KNOWN)


def test_a_set_up_station_speaks_when_it_is_stepped(drive):
    assert drive.set_up().ok
    assert drive.frames() == []
    first, second = drive.step(0), drive.step(1000)
    assert first.ok and second.ok
    assert first.instructions >= 1000
    assert first.frames != second.frames
    assert len(second.frames) > 8


@pytest.mark.parametrize("settings", [{"tick_ms": 0}, {"min_mA": -1}, {"min_mA": 1_000_000}, {"iterations": 0},
                                      {"price_weight_permille": 1001}])
def test_settings_that_the_firmware_refuses_leave_no_station(drive, settings):
    assert drive.set_up().ok
    assert not drive.set_up(**settings).ok
    assert not drive.step(0).ok
    assert drive.set_up().ok
    assert drive.step(0).ok


def test_a_policy_that_is_none_is_refused(drive):
    drive._ask(SETUP, 0, struct.pack("<IHBB", 1000, 10, 3, 0))
    drive._ask(SETUP, 1, struct.pack("<ii", -0x80000000, -0x80000000))
    assert not drive._wait_for_done().ok
    assert not drive.step(0).ok


@pytest.mark.parametrize("part, length", [(0, 7), (1, 7), (2, 8)])
def test_settings_that_are_cut_short_change_nothing(drive, part, length):
    assert drive.set_up().ok
    index, data = ask(drive, SETUP, part, DONE, bytes(length))
    assert (index, data[7] & 1) == (SETUP, 0)
    assert drive.step(0).ok


def test_frames_are_received_at_the_time_told_last(drive):
    """A heartbeat without a vehicle: who hears none in 1 s is lost, and that is told by what the station sends."""
    assert drive.set_up().ok
    drive.step(0)
    before = drive.counter(FRAMES_RECEIVED)
    drive.set_time(1000)
    for _ in range(5):
        drive.send(0x123, bytes(8))
    drive.step(1000)
    assert drive.counter(FRAMES_RECEIVED) == before + 5


def test_a_new_station_hears_nothing_of_what_waited_for_the_last(drive):
    assert drive.set_up().ok
    for _ in range(STORED_FRAMES + 10):
        drive.send(0x123, bytes(8))
    drive.step(0)
    assert drive.counter(RECEIVE_OVERFLOWS) == 10
    drive.send(0x123, bytes(8))
    assert drive.set_up().ok
    drive.step(0)
    assert drive.counter(FRAMES_RECEIVED) == 0
    assert drive.counter(RECEIVE_OVERFLOWS) == 0


def test_two_stations_after_each_other_do_the_same(drive):
    runs = []
    for _ in range(2):
        assert drive.set_up().ok
        runs.append([drive.step(1000 * k).frames for k in range(5)])
    assert runs[0] == runs[1]


def test_a_stopped_station_says_its_last(drive):
    assert drive.set_up().ok
    drive.step(0)
    done = drive.call(STOP, 50)
    assert done.ok
    assert len(done.frames) == 8


@pytest.mark.parametrize("connector", [8, 200, 255])
def test_nothing_is_known_of_connectors_that_are_not_there(drive, connector):
    assert drive.set_up().ok
    drive.step(0)
    assert ask(drive, LOOK, connector, LOOKED) == (connector, NOTHING_KNOWN)
    assert ask(drive, COUNTER, connector + 50, VALUE)[1] == bytes(4)
    assert ask(drive, FIGURE, connector, VALUE) == (connector, bytes(4))


def test_the_board_tells_what_it_is(drive):
    assert drive.figure("connectors") == 8
    assert drive.figure("name") == zlib.crc32(b"hub")
    assert (drive.figure("stack_used_B"), drive.figure("stack_size_B")) == (1234, 8192)
    assert len(FIGURES) == 10


def test_strange_messages_are_passed_over(drive):
    assert drive.set_up().ok
    for kind in (0, 2, 0x0D, 0x7F, 0x81, 0x84, 0xFF):
        drive._ask(kind, 3, b"abc")
    drive._write("T1FFE04004000000000\rR1FFF04000\rT000000010\r")
    assert drive.step(0).ok


def test_a_reset_board_greets_and_resumes_with_the_settings_of_before(drive):
    assert drive.set_up(min_mA=6000, policy="edf").ok
    first = drive.step(0)
    drive.reset()
    assert not drive.step(1000).ok
    assert drive.resume().ok
    again = drive.step(0)
    assert ids(again) == ids(first)


def test_a_board_that_never_had_settings_cannot_resume(drive):
    assert not drive.resume().ok
    assert not drive.step(0).ok


def test_everyone_who_opens_the_channel_is_greeted(port):
    for _ in range(3):
        with Drive(port) as attached:
            assert attached.figure("connectors") == 8


def test_whoever_comes_after_one_that_broke_off_can_go_on(port, sim):
    with Drive(port) as first:
        assert first.set_up().ok
        first._write("T1FFF0400400000000\rt1238AABB")
    sim.write("cars.csv", csv_text([session("a"), session("b", arrival_s=600)]))
    common = ["--sessions", "cars.csv", "--policy", "edf", "--station", "hub", "--frames"]
    here = sim.call(*common, "here.log")
    there = sim.call(*common, "there.log", "--bus", f"slcan:127.0.0.1:{port}")
    assert (here.code, there.code) == (0, 0), there.stderr
    assert (sim.folder / "here.log").read_bytes() == (sim.folder / "there.log").read_bytes()
