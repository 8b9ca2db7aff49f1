"""The adapter under test, for every peer."""

import os
import subprocess

import pytest

PATIENCE_S = 30


class Echo:
    """slcan_echo: every frame is answered by one with the next higher identifier."""

    def __init__(self):
        program = os.environ.get("TAPER_SLCAN_ECHO")
        if not program:
            pytest.fail("TAPER_SLCAN_ECHO does not say where the program is; ctest sets it")
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.terminal = self.process.stdout.readline().strip()

    def counters(self):
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return dict(pair.split("=") for pair in self.process.stdout.readline().split())


@pytest.fixture
def echo():
    with_adapter = Echo()
    yield with_adapter
    with_adapter.process.stdin.close()
    assert with_adapter.process.wait(PATIENCE_S) == 0
    with_adapter.process.stdout.close()


def frames():
    """(identifier, extended, data): edges of the ranges, all lengths."""
    identifiers = [(0x000, False), (0x7FE, False), (0x123, False), (0x00000000, True), (0x1FFFFFFE, True)]
    return [(identifier, extended, bytes(range(255 - length, 255)))
            for identifier, extended in identifiers for length in range(9)]
