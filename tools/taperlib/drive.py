"""A station on a board, driven call by call: the simulation's end of firmware/port/slcan/include/taper/drive.h."""

import socket
import struct
from dataclasses import dataclass, field

DRIVE_ID = 0x1FFF0000
SETUP, TIME, STEP, POLL, STOP, LOOK, COUNTER, FIGURE, RESET, EXIT, RESUME = 1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12
DONE, LOOKED, VALUE, HELLO = 0x81, 0x82, 0x83, 0x84
FIGURES = ("iterations", "stack_used_B", "stack_size_B", "slice_iterations", "store_writes", "connectors", "name",
           "has_planner", "frame_mean", "frames_worst")
MODES = ("INIT", "PLAN", "FALLBACK", "FAILSAFE")
POLICIES = ("planner", "edf", "llf")
ABSENT = -0x80000000
STANDARD_DIGITS, EXTENDED_DIGITS = 3, 8
ANSWER_SECONDS = 30.0


class DriveError(Exception):
    """The board does not answer, or not as it should."""


@dataclass(frozen=True)
class Done:
    """A call's answer, with the frames that the station sent."""
    ok: bool
    hands_over: bool
    is_settled: bool
    watchdog_kicked: bool
    planned: bool
    mode: int
    plans: int
    instructions: int
    frames: list[tuple[int, bytes]] = field(default_factory=list)


class Drive:
    """The attached side of a board's SLCAN adapter on a TCP port of this machine. Opens the channel."""

    def __init__(self, port: int, timeout_s: float = ANSWER_SECONDS):
        self._socket = socket.create_connection(("127.0.0.1", port), timeout_s)
        self._buffer = b""
        self._frames: list[tuple[int, bytes]] = []
        self._write("\rC\rS6\rO\r")
        self.wait_for_hello()

    def close(self) -> None:
        """The channel stays open."""
        self._socket.close()

    def __enter__(self) -> "Drive":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # ---- Lines

    def _write(self, text: str) -> None:
        self._socket.sendall(text.encode("ascii"))

    def _read_line(self) -> str:
        """A line without its end; "" for one of an answer that has nothing else."""
        while b"\r" not in self._buffer:
            try:
                data = self._socket.recv(65536)
            except TimeoutError:
                raise DriveError("the board does not answer") from None
            if not data:
                raise DriveError("the emulator is gone")
            self._buffer += data
        line, _, self._buffer = self._buffer.partition(b"\r")
        return line.decode("ascii")

    def send(self, can_id: int, data: bytes) -> None:
        """A frame for the station."""
        self._write(f"t{can_id:03X}{len(data)}{data.hex()}\r")

    def _ask(self, kind: int, index: int = 0, data: bytes = b"") -> None:
        self._write(f"T{DRIVE_ID | kind << 8 | index:08X}{len(data)}{data.hex()}\r")

    def _wait_for(self, *kinds: int) -> tuple[int, int, bytes]:
        """Kind, index and data. Frames of the station that come before are kept."""
        while True:
            line = self._read_line().lstrip("zZ\a")
            if line.startswith("t"):
                self._frames.append((int(line[1:4], 16), bytes.fromhex(line[5:])))
            elif line.startswith("T"):
                can_id, data = int(line[1:9], 16), bytes.fromhex(line[10:])
                kind = can_id >> 8 & 0xFF
                if kind in kinds:
                    return kind, can_id & 0xFF, data
                if kind == HELLO:
                    raise DriveError("the board was reset")

    def frames(self) -> list[tuple[int, bytes]]:
        """What the station has sent before the last answer, identifier and data, and was not handed out yet."""
        frames, self._frames = self._frames, []
        return frames

    # ---- What drive.h knows

    def wait_for_hello(self) -> None:
        self._wait_for(HELLO)

    def _wait_for_done(self) -> Done:
        _, _, data = self._wait_for(DONE)
        instructions, plans, mode, bits = struct.unpack("<IHBB", data)
        return Done(*(bool(bits >> bit & 1) for bit in range(5)), mode, plans, instructions, self.frames())

    def set_up(self, tick_ms: int = 1000, iterations: int = 10, policy: str = "planner", min_mA: int = ABSENT,
               price_weight_permille: int = ABSENT) -> Done:
        self._ask(SETUP, 0, struct.pack("<IHBB", tick_ms, iterations, POLICIES.index(policy), 0))
        self._ask(SETUP, 1, struct.pack("<ii", min_mA, price_weight_permille))
        return self._wait_for_done()

    def set_time(self, now_ms: int) -> None:
        """Reception time of the frames that follow."""
        self._ask(TIME, 0, struct.pack("<I", now_ms))

    def call(self, kind: int, now_ms: int) -> Done:
        """STEP, POLL or STOP."""
        self._ask(kind, 0, struct.pack("<I", now_ms))
        return self._wait_for_done()

    def step(self, now_ms: int) -> Done:
        return self.call(STEP, now_ms)

    def figure(self, name: str) -> int:
        self._ask(FIGURE, FIGURES.index(name))
        return struct.unpack("<I", self._wait_for(VALUE)[2])[0]

    def counter(self, index: int) -> int:
        self._ask(COUNTER, index)
        return struct.unpack("<I", self._wait_for(VALUE)[2])[0]

    def reset(self) -> None:
        self._ask(RESET)
        self.wait_for_hello()

    def resume(self) -> Done:
        self._ask(RESUME)
        return self._wait_for_done()

    def exit(self, status: int) -> None:
        """The emulator ends with this status."""
        self._ask(EXIT, status)
