"""The command line of tools/monitor: where frames come from, and how often what is shown."""

import argparse
import errno
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import can
from rich.console import Console
from rich.live import Live

from taperlib.canbus import Database, Frame, read_log
from taperlib.files import InputError
from taperlib.numbers import positive
from taperlib.station_screen import screen
from taperlib.station_view import StationView

ROOT = Path(__file__).resolve().parents[2]
REFRESH_S = 0.25
REOPEN_S = 0.5
JSON_PERIOD_S = 1.0
ONCE_S = 3.0
EXIT_NOTHING_HEARD, EXIT_USAGE = 1, 2

DESCRIPTION = """Shows a charging station as its CAN bus shows it: limits, connectors, and why each has the current that
it has. Only listens, never sends; needs no root. On a terminal the table is live until Ctrl-C; elsewhere it is
printed once. A reason with a question mark is inferred, because no OUTLOOK frame told it."""
EPILOG = "Exit code: 0 good; 1 nothing was heard (--once); 2 wrong usage, or an interface or file that cannot be used."


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="tools/monitor", description=DESCRIPTION, epilog=EPILOG)
    parser.add_argument("--can", metavar="IFACE",
                        help="SocketCAN interface (default vcan0; with --log: the log's first)")
    parser.add_argument("--log", type=Path, metavar="FILE", help="a log of `candump -l` instead, at its own pace")
    parser.add_argument("--dbc", type=Path, default=ROOT / "codegen" / "taper.dbc",
                        help="CAN database (default codegen/taper.dbc)")
    parser.add_argument("--seconds", type=positive, metavar="N",
                        help=f"end after N seconds of the bus (default: never; --once: {ONCE_S:.0f}, or the whole log)")
    parser.add_argument("--utc", action="store_true", help="times in UTC instead of local time")
    output = parser.add_mutually_exclusive_group()
    output.add_argument("--once", action="store_true", help="listen, print the table once, and end")
    output.add_argument("--json", action="store_true", help="one JSON object per second of the bus, each on a line")
    return parser


class LiveSource:
    """Frames of an interface. None says that a moment passed without any. Survives that the interface goes down."""

    def __init__(self, interface: str):
        self.interface = interface
        self.is_up = True
        self._bus = self._open()
        self._next_try_s = 0.0

    def _open(self) -> can.BusABC:
        return can.Bus(interface="socketcan", channel=self.interface)

    @property
    def label(self) -> str:
        return self.interface if self.is_up else f"{self.interface} IS DOWN"

    def frames(self) -> Iterator[tuple[float, Frame | None]]:
        """(time now, frame) without an end."""
        while True:
            message = self._receive()
            if message is None:
                yield time.time(), None
            elif message.is_error_frame:
                yield message.timestamp, Frame(message.timestamp, 0, b"", is_error=True)
            elif not message.is_extended_id and not message.is_remote_frame:
                yield message.timestamp, Frame(message.timestamp, message.arbitration_id, bytes(message.data))

    def _receive(self) -> can.Message | None:
        try:
            if self._bus is None:
                self._bus = self._open()
            message = self._bus.recv(REFRESH_S / 2)
            self.is_up = True  # a socket on an interface that is down says so at once
            return message
        except (can.CanError, OSError):
            self.is_up = False
            self.close()
            time.sleep(REOPEN_S)
            return None

    def close(self) -> None:
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = None


class LogSource:
    """Frames of a recorded log, as fast as they are read, or at the pace at which they were recorded."""

    def __init__(self, path: Path, interface: str | None, paced: bool):
        self.label = path.name
        self._frames, self._paced = read_log(path, interface), paced

    def frames(self) -> Iterator[tuple[float, Frame | None]]:
        offset_s = None
        for frame in self._frames:
            offset_s = time.time() - frame.time_s if offset_s is None else offset_s
            while self._paced and (ahead_s := frame.time_s + offset_s - time.time()) > 0:
                time.sleep(min(ahead_s, REFRESH_S))
                yield min(time.time() - offset_s, frame.time_s), None
            yield frame.time_s, frame

    def close(self) -> None:
        self._frames.close()


def _advice(interface: str, error: OSError) -> InputError:
    if error.errno == errno.EAFNOSUPPORT:
        return InputError(f"{interface}: this kernel has no CAN. Run it as: tools/with-vcan tools/monitor ...")
    if error.errno == errno.ENODEV:
        return InputError(f"{interface}: there is no such interface. A virtual one: sudo ip link add dev {interface} "
                          f"type vcan && sudo ip link set {interface} up; without root: tools/with-vcan -i "
                          f"{interface} COMMAND")
    return InputError(f"{interface}: {error.strerror or error}")


def _source(options: argparse.Namespace, paced: bool) -> LiveSource | LogSource:
    if options.log:
        return LogSource(options.log, options.can, paced)
    interface = options.can or "vcan0"
    try:
        return LiveSource(interface)
    except OSError as error:
        raise _advice(interface, error) from None
    except can.CanError as error:
        raise InputError(f"{interface}: {error}") from None


def _moments(source: LiveSource | LogSource, view: StationView, seconds: float | None) -> Iterator[float]:
    """Takes frames into the view; yields the time after each, and in between when there are none."""
    end_s = None
    for now_s, frame in source.frames():
        if seconds is not None and end_s is None:
            end_s = now_s + seconds
        if end_s is not None and now_s > end_s:
            return
        if frame is not None:
            view.hear(frame)
        yield now_s


def _print_once(source: LiveSource | LogSource, view: StationView, options: argparse.Namespace,
                console: Console) -> int:
    seconds = options.seconds or (None if options.log else ONCE_S)
    now_s = 0.0
    for now_s in _moments(source, view, seconds):
        pass
    console.print(screen(view, now_s, source.label, options.utc, console.width, None))
    if view.bus(now_s).frames == 0:
        print(f"tools/monitor: {source.label}: nothing was heard", file=sys.stderr)
        return EXIT_NOTHING_HEARD
    return 0


def _print_json(source: LiveSource | LogSource, view: StationView, options: argparse.Namespace) -> int:
    due_s = None
    for now_s in _moments(source, view, options.seconds):
        due_s = now_s + JSON_PERIOD_S if due_s is None else due_s
        if now_s >= due_s:
            due_s += JSON_PERIOD_S * ((now_s - due_s) // JSON_PERIOD_S + 1)
            print(json.dumps({"source": source.label} | view.as_dict(now_s)), flush=True)
    return 0


def _show_live(source: LiveSource | LogSource, view: StationView, options: argparse.Namespace,
               console: Console) -> int:
    def picture(now_s: float):
        return screen(view, now_s, source.label, options.utc, console.width, console.height)

    shown_s = now_s = 0.0
    with Live(console=console, screen=True, auto_refresh=False) as live:
        for now_s in _moments(source, view, options.seconds):
            if time.monotonic() >= shown_s + REFRESH_S:
                shown_s = time.monotonic()
                live.update(picture(now_s), refresh=True)
    console.print(picture(now_s))
    return 0


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    console = Console()
    live = not (options.once or options.json) and console.is_terminal
    try:
        view = StationView(Database(options.dbc))
        source = _source(options, paced=live)
        try:
            if options.json:
                return _print_json(source, view, options)
            if live:
                return _show_live(source, view, options, console)
            return _print_once(source, view, options, console)
        finally:
            source.close()
    except InputError as error:
        print(f"tools/monitor: {error}", file=sys.stderr)
        return EXIT_USAGE
    except BrokenPipeError:
        sys.stderr.close()  # whoever read has left; nothing more to say
        return 0
    except KeyboardInterrupt:
        return 0
