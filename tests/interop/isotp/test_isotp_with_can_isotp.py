"""Messages through our ISO-TP and can-isotp, in both directions."""

from __future__ import annotations

import random
import time

import can
import pytest
from conftest import INTERFACE, LONGEST, other_end, running

SEND, RECEIVE = 0x63E, 0x67E  # ours; the other end's are the other way round
LENGTHS = (1, 7, 8, 20, 100, 1000, 4095)


def message(length: int) -> bytes:
    return random.Random(length).randbytes(length)


def echo(block_size=0, separation_ms=0, capacity=LONGEST, hold_ms=0):
    return running("echo", SEND, RECEIVE, block_size, separation_ms, capacity, hold_ms)


def other(**parameters):
    return other_end(RECEIVE, SEND, **parameters)


@pytest.mark.parametrize("separation_ms", (0, 2, 20))
@pytest.mark.parametrize("block_size", (0, 1, 8))
def test_every_length_comes_back_as_it_went(block_size: int, separation_ms: int) -> None:
    """Each end asks the other for the same block size and separation. The longest takes 12 s each way at 20 ms: once."""
    lengths = LENGTHS if separation_ms < 20 or block_size == 8 else LENGTHS[:-1]
    with echo(block_size, separation_ms), other(blocksize=block_size, stmin=separation_ms) as end:
        for length in lengths:
            end.send(message(length))
            assert end.receive() == message(length), f"{length} bytes; {end.errors}"
        assert end.errors == []


def test_separations_below_a_millisecond_and_frames_without_padding_are_understood() -> None:
    with echo(8, 1), other(blocksize=3, stmin=0xF3, tx_padding=None) as end:
        for length in (1, 6, 8, 14, 100):
            end.send(message(length))
            assert end.receive() == message(length)
        assert end.errors == []


def test_a_message_that_comes_too_early_is_told_to_wait_and_none_is_lost() -> None:
    with echo(hold_ms=1200), other() as end:
        end.send(message(100))
        end.send(message(50))
        assert end.receive() == message(100)
        assert end.receive() == message(50)
        assert end.errors == []


def test_a_message_without_room_is_refused_and_the_next_one_comes_back() -> None:
    with echo(capacity=64), other() as end:
        end.send(message(65))
        end.wait_for("OverflowError")
        end.send(message(64))
        assert end.receive() == message(64)


@pytest.mark.parametrize("pause_s", (0, 1.5))
def test_a_sender_that_breaks_off_leaves_room_for_the_next_message(pause_s: float) -> None:
    """At once, or after the timeout."""
    with echo(block_size=2, separation_ms=20), other() as end:
        end.send(message(1000))
        time.sleep(0.3)
        assert end.stack.transmitting()
        end.stack.stop_sending()
        time.sleep(pause_s)
        end.send(message(100))
        assert end.receive() == message(100)


def test_a_receiver_that_falls_silent_leaves_room_for_the_next_message() -> None:
    with echo(), other() as end, can.Bus(INTERFACE, interface="socketcan") as bus:
        bus.send(can.Message(arbitration_id=RECEIVE, data=bytes.fromhex("100a010203040506"), is_extended_id=False))
        time.sleep(0.05)
        bus.send(can.Message(arbitration_id=RECEIVE, data=bytes.fromhex("210708090a"), is_extended_id=False))
        assert end.receive() == bytes(range(1, 11)), "its first frame finds the other end, which takes it"
        end.send(message(20))
        assert end.receive() == message(20)
