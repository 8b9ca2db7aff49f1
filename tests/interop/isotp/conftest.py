"""Our end of ISO-TP (isotp_peer) on vcan0, and can-isotp as the other one."""

from __future__ import annotations

import binascii
import os
import socket
import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import can
import isotp
import pytest

INTERFACE = "vcan0"
LONGEST = 4095
RECEIVE_BUFFER = 4 << 20  # bytes; vcan does not wait for a reader that is slow


@dataclass
class Peer:
    """isotp_peer as it runs."""

    process: subprocess.Popen

    def line(self) -> str:
        """The next line that it prints."""
        return self.process.stdout.readline().rstrip("\n")


@dataclass
class Other:
    """can-isotp: sends and receives messages, and keeps the names of the errors that it met."""

    stack: isotp.CanStack
    errors: list[str] = field(default_factory=list)

    def send(self, message: bytes) -> None:
        self.stack.send(message)

    def receive(self, timeout_s: float = 120) -> bytes | None:
        got = self.stack.recv(block=True, timeout=timeout_s)
        return None if got is None else bytes(got)

    def wait_for(self, error: str, timeout_s: float = 10) -> None:
        end = time.monotonic() + timeout_s
        while error not in self.errors:
            assert time.monotonic() < end, f"no {error}, but {self.errors}"
            time.sleep(0.01)


@contextmanager
def running(*arguments: object) -> Iterator[Peer]:
    program = os.environ.get("TAPER_ISOTP_PEER")
    assert program, "TAPER_ISOTP_PEER does not say where isotp_peer is: run ctest -R interop.isotp"
    if not Path("/sys/class/net", INTERFACE).exists():
        pytest.fail(f"there is no {INTERFACE}: run this below tools/with-vcan")
    command = [program, INTERFACE, *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            peer = Peer(process)
            assert peer.line() == "ready"
            yield peer
        finally:
            process.kill()


@contextmanager
def other_end(send_id: int, receive_id: int, **parameters: object) -> Iterator[Other]:
    """can-isotp with these identifiers and parameters. Time-outs are generous: the computer may be busy."""
    errors: list[str] = []
    address = isotp.Address(isotp.AddressingMode.Normal_11bits, txid=send_id, rxid=receive_id)
    defaults = {"tx_padding": 0xCC, "wftmax": 10, "rx_flowcontrol_timeout": 5000, "rx_consecutive_frame_timeout": 5000}
    with can.Bus(INTERFACE, interface="socketcan") as bus:
        bus.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        stack = isotp.CanStack(bus, address=address, params=defaults | parameters,
                               error_handler=lambda error: errors.append(type(error).__name__))
        stack.start()
        try:
            yield Other(stack, errors)
        finally:
            stack.stop()


def transfer(kind: int, count: int, items: bytes) -> bytes:
    """The envelope of docs/transfers.md."""
    body = struct.pack("<BBH", 1, kind, count) + items
    return body + struct.pack("<I", binascii.crc32(body))
