"""python-can's slcan interface, attached to the adapter's terminal."""

import can
import pytest
from conftest import PATIENCE_S, frames

OPENED_TWICE = "1"  # with a bit rate, python-can opens the channel a second time


@pytest.fixture
def bus(echo):
    with can.Bus(interface="slcan", channel=echo.terminal, bitrate=500000, sleep_after_open=0) as attached:
        yield attached


def answer(bus, message):
    bus.send(message)
    return bus.recv(PATIENCE_S)


def test_every_frame_comes_back_with_its_content(bus, echo):
    for identifier, extended, data in frames():
        back = answer(bus, can.Message(arbitration_id=identifier, is_extended_id=extended, data=data))
        assert (back.arbitration_id, back.is_extended_id, bytes(back.data)) == (identifier + 1, extended, data)
    assert echo.counters() == {"opens": "1", "bad_lines": OPENED_TWICE, "overflows": "0"}


def test_order_is_kept_in_a_burst(bus):
    for number in range(200):
        bus.send(can.Message(arbitration_id=0x100, is_extended_id=False, data=[number]))
    assert [bus.recv(PATIENCE_S).data[0] for _ in range(200)] == list(range(200))


def test_remote_frames_are_not_answered(bus):
    for extended in (False, True):
        bus.send(can.Message(arbitration_id=0x10, is_extended_id=extended, is_remote_frame=True, dlc=4))
    assert answer(bus, can.Message(arbitration_id=0x20, is_extended_id=False)).arbitration_id == 0x21


def test_frames_of_can_fd_are_refused(bus, echo):
    bus.send(can.Message(arbitration_id=0x10, is_extended_id=False, is_fd=True, data=bytes(48)))
    assert answer(bus, can.Message(arbitration_id=0x20, is_extended_id=False)).arbitration_id == 0x21
    assert int(echo.counters()["bad_lines"]) == int(OPENED_TWICE) + 1


def test_version_and_serial_number_are_understood(bus):
    assert bus.get_version(PATIENCE_S) == (10, 13)
    assert bus.get_serial_number(PATIENCE_S) == "TAPR"


def test_who_only_listens_cannot_speak(echo):
    with can.Bus(interface="slcan", channel=echo.terminal, listen_only=True, sleep_after_open=0) as listener:
        listener.send(can.Message(arbitration_id=0x20, is_extended_id=False))
        assert listener.get_version(PATIENCE_S) == (10, 13)  # what was sent before is refused by now
    assert echo.counters() == {"opens": "1", "bad_lines": "1", "overflows": "0"}


def test_another_who_attaches_finds_the_channel_his(echo):
    for _ in range(3):
        with can.Bus(interface="slcan", channel=echo.terminal, sleep_after_open=0) as attached:
            assert answer(attached, can.Message(arbitration_id=0x1, is_extended_id=False)).arbitration_id == 0x2
    assert echo.counters() == {"opens": "3", "bad_lines": "0", "overflows": "0"}
