"""The daemon on vcan0 as the tests start and hear it: fixtures and helpers of test_station_daemon.py and test_recording.py."""

import re
import signal
import time

import pytest
from conftest import program
from street import Bus, Street

HUB = 8  # connectors


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


def end(running):
    """SIGTERM, and the exit code."""
    running.process.send_signal(signal.SIGTERM)
    return running.finish()
