"""An image of firmware/mps2 in QEMU: its CAN (SLCAN on UART0) on a TCP port, and what it reports (UART1) as text."""

import contextlib
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

PROGRAM = "qemu-system-arm"
IMAGE_NAME = re.compile(r"taper-(mps2-\w+)\.elf")
PROMPT = b"(qemu) "
END_SECONDS = 10.0


class EmulatorError(Exception):
    """QEMU is not there, does not start, or does not end. The text is for the user."""


class Emulator:
    """A running image. Its clock counts instructions (one is a nanosecond), so what it does repeats exactly.

    A TCP client is the attached side of the SLCAN adapter: one at a time, and another when it has gone. The power is on
    until `stop()`.
    """

    def __init__(self, image: Path, *, debug: bool = False):
        self._folder = Path(tempfile.mkdtemp(prefix="taper-board-"))
        self._text, self._errors = self._folder / "uart1", self._folder / "stderr"
        try:
            self._process = self._start(image, debug)
            self._ports = self._ask_ports()
        except BaseException:
            self.stop()
            raise

    def _start(self, image: Path, debug: bool) -> subprocess.Popen:
        command = command_line(image, self._text)
        if debug:
            command += [*_server("gdb"), "-gdb", "chardev:gdb"]
        try:
            with self._errors.open("wb") as errors:
                return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors)
        except FileNotFoundError:
            raise EmulatorError(f"{PROGRAM} is not installed: sudo apt-get install qemu-system-arm") from None

    def _ask_ports(self) -> dict[str, int]:
        """QEMU picks free ports itself, so nobody can take them first."""
        self._read_to_prompt()
        devices = re.findall(r"(\w+): filename=disconnected:tcp:127\.0\.0\.1:(\d+)", self._tell("info chardev"))
        return {name: int(port) for name, port in devices}

    def _tell(self, command: str) -> str:
        """One command of QEMU's monitor for people. The one for programs has a thread that slows every byte of a UART."""
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(f"{command}\n".encode())
            self._process.stdin.flush()
        return self._read_to_prompt()

    def _read_to_prompt(self) -> str:
        answer = b""
        while not answer.endswith(PROMPT):
            byte = self._process.stdout.read(1)
            if not byte:
                self._process.wait(END_SECONDS)
                raise EmulatorError(f"{PROGRAM} ended with status {self._process.returncode}: {self.errors().strip()}")
            answer += byte
        return answer.decode(errors="replace")

    @property
    def port(self) -> int:
        """Of the CAN: --bus slcan:127.0.0.1:PORT, or python-can's slcan interface on socket://127.0.0.1:PORT."""
        return self._ports["can"]

    @property
    def debug_port(self) -> int:
        """Of the stub for gdb, if `debug`."""
        return self._ports["gdb"]

    def text(self) -> str:
        """What the image has reported so far."""
        return self._text.read_text(encoding="ascii", errors="replace") if self._text.exists() else ""

    def errors(self) -> str:
        """What QEMU has complained of so far."""
        return self._errors.read_text(errors="replace") if self._errors.exists() else ""

    def press_reset(self) -> None:
        """The board's reset button: all is reset but the contents of its memory."""
        self._tell("system_reset")

    def wait(self, timeout_s: float = END_SECONDS) -> int:
        """The status that the image ended the emulator with."""
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            raise EmulatorError(f"the image still runs after {timeout_s:g} s") from None

    def stop(self) -> None:
        """The power goes off."""
        process = getattr(self, "_process", None)
        if process is not None:
            process.kill()
            process.wait()
            process.stdin.close()
            process.stdout.close()
        shutil.rmtree(self._folder, ignore_errors=True)


def machine_of(image: Path) -> str:
    """QEMU's name of the board that an image is for, from the image's."""
    match = IMAGE_NAME.fullmatch(image.name)
    if match is None or not image.is_file():
        raise EmulatorError(f"{image}: is not an image taper-BOARD.elf; build one with: tools/dev board cm7-hub")
    return match[1]


def _server(name: str) -> list[str]:
    return ["-chardev", f"socket,id={name},host=127.0.0.1,port=0,server=on,wait=off,nodelay=on"]


def command_line(image: Path, text: Path) -> list[str]:
    """QEMU with its monitor on standard input and output."""
    return [PROGRAM, "-M", machine_of(image), "-nodefaults", "-display", "none", "-icount", "shift=0",
            *_server("can"), "-serial", "chardev:can", "-serial", f"file:{text}", "-monitor", "stdio",
            "-semihosting-config", "enable=on,target=native", "-kernel", str(image)]


@contextlib.contextmanager
def emulated(image: Path, *, debug: bool = False) -> Iterator[Emulator]:
    """The image, running until the end of the block."""
    emulator = Emulator(image, debug=debug)
    try:
        yield emulator
    finally:
        emulator.stop()
