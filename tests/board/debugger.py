"""As much of gdb's remote protocol as it takes to change an instruction of a running image."""

import re
import socket
import subprocess
from pathlib import Path

PACKET = re.compile(rb"\$([^#]*)#..", re.DOTALL)


class Debugger:
    """Attached to the emulator's stub: the board stands still until the end of the block."""

    def __init__(self, port: int):
        self._socket = socket.create_connection(("127.0.0.1", port), 10.0)
        self._buffer = b""

    def __enter__(self) -> "Debugger":
        return self

    def __exit__(self, *_: object) -> None:
        self._ask("D")
        self._socket.close()

    def _ask(self, command: str) -> str:
        self._socket.sendall(f"${command}#{sum(command.encode()) % 256:02x}".encode())
        while (answer := self._read_packet()).startswith("T"):
            pass  # it tells by itself that the board stands still
        return answer

    def _read_packet(self) -> str:
        while (match := PACKET.search(self._buffer)) is None:
            data = self._socket.recv(4096)
            assert data, "the emulator's stub is gone"
            self._buffer += data
        self._buffer = self._buffer[match.end():]
        self._socket.sendall(b"+")
        return match[1].decode()

    def write(self, address: int, data: bytes) -> None:
        """Anywhere, code too. A reset loads the image's code again."""
        assert self._ask(f"M{address:x},{len(data):x}:{data.hex()}") == "OK"


def address_of(image: Path, function: str) -> int:
    symbols = subprocess.run(["arm-none-eabi-nm", str(image)], check=True, capture_output=True, text=True).stdout
    found = [line.split()[0] for line in symbols.splitlines() if line.split()[-2:] in (["T", function], ["t", function])]
    assert found, f"{image} has no function {function}"
    return int(found[0], 16)


def thumb(*halfwords: int) -> bytes:
    return b"".join(halfword.to_bytes(2, "little") for halfword in halfwords)
