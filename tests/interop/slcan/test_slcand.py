"""slcand and the kernel's SLCAN driver make a CAN interface of the adapter's terminal. Runs as root of tools/with-vcan's
User-Mode Linux: the driver belongs to the kernel itself, not to a network namespace."""

import os
import subprocess
import time
from pathlib import Path

import can
import pytest
from conftest import PATIENCE_S, frames

MODULE = "/usr/lib/uml/modules/{}/kernel/drivers/net/can/slcan/slcan.ko"
TOOLS = os.environ | {"PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"}


def system(*command):
    subprocess.run(command, check=True, timeout=PATIENCE_S, env=TOOLS)


@pytest.fixture
def interface(echo):
    """slcan0, up, as slcand makes it."""
    if not Path("/sys/module/slcan").exists():
        system("insmod", MODULE.format(os.uname().release))
    daemon = subprocess.Popen(["slcand", "-F", "-o", "-c", "-s6", echo.terminal, "slcan0"], env=TOOLS)
    end = time.monotonic() + PATIENCE_S
    while not Path("/sys/class/net/slcan0").exists():
        assert time.monotonic() < end and daemon.poll() is None, "slcand made no slcan0"
        time.sleep(0.02)
    system("ip", "link", "set", "slcan0", "up")
    yield "slcan0"
    daemon.terminate()
    daemon.wait(PATIENCE_S)


def test_socketcan_programs_reach_the_station_through_slcand(interface, echo):
    with can.Bus(interface="socketcan", channel=interface) as bus:
        for identifier, extended, data in frames():
            bus.send(can.Message(arbitration_id=identifier, is_extended_id=extended, data=data))
            back = bus.recv(PATIENCE_S)
            assert (back.arbitration_id, back.is_extended_id, bytes(back.data)) == (identifier + 1, extended, data)
        for number in range(100):
            bus.send(can.Message(arbitration_id=0x100, is_extended_id=False, data=[number]))
            assert bus.recv(PATIENCE_S).data[0] == number
    assert echo.counters() == {"opens": "1", "bad_lines": "0", "overflows": "0"}
