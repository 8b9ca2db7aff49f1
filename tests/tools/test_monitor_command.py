"""tools/monitor as a command: logs, JSON, terminals, and what goes wrong."""

import json
import os
import pty
import subprocess
from pathlib import Path

import can
import pytest
from taperlib import monitor
from taperlib.canbus import Database, read_log
from taperlib.files import InputError
from taperlib.monitor import LiveSource, main

ROOT = Path(__file__).resolve().parents[2]


def test_a_log_is_shown_once(scene, tmp_path, capsys):
    log = scene.save_log(tmp_path / "day.log")
    assert main(["--log", str(log), "--once", "--utc"]) == 0
    output = capsys.readouterr().out
    assert "mode plan" in output and "14:00" in output and "day.log" in output


def test_json_gives_an_object_each_second(scene, tmp_path, capsys):
    for _ in range(25):
        scene.now_s += 0.1
        scene.status(1)
    assert main(["--log", str(scene.save_log(tmp_path / "day.log")), "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(lines) == 2
    assert lines[0]["connectors"][0]["setpoint_a"] == 16.0
    assert lines[1]["time_s"] - lines[0]["time_s"] == pytest.approx(1.0)
    assert lines[0]["station"]["mode"] == "plan" and lines[0]["bus"]["crc_errors"] == 0


def test_seconds_end_it(scene, tmp_path, capsys):
    scene.now_s += 10
    scene.status(2)
    log = scene.save_log(tmp_path / "day.log")
    assert main(["--log", str(log), "--once", "--seconds", "5"]) == 0
    assert f"{len(scene.frames) - 1} frames" in capsys.readouterr().out


def test_on_a_terminal_it_is_live_and_leaves_the_last_picture(scene, tmp_path):
    scene.now_s += 0.5
    scene.status(1)
    master, slave = pty.openpty()
    process = subprocess.Popen([ROOT / "tools" / "monitor", "--log", scene.save_log(tmp_path / "day.log")],
                               stdout=slave, stderr=subprocess.STDOUT, stdin=slave,
                               env=os.environ | {"TERM": "xterm", "COLUMNS": "80", "LINES": "24"})
    os.close(slave)
    output = b""
    try:
        while chunk := os.read(master, 65536):
            output += chunk
    except OSError:
        pass  # the other end was closed
    os.close(master)
    assert process.wait(30) == 0, output
    assert b"\x1b[?1049h" in output and b"\x1b[?1049l" in output
    assert b"planned?" in output.rpartition(b"\x1b[?1049l")[2]


def test_an_empty_log_is_said_with_an_exit_code(tmp_path, capsys):
    (tmp_path / "empty.log").touch()
    assert main(["--log", str(tmp_path / "empty.log"), "--once"]) == 1
    assert "nothing was heard" in capsys.readouterr().err


def test_a_log_keeps_to_one_interface_and_to_frames_of_this_bus(tmp_path):
    log = tmp_path / "mixed.log"
    log.write_text("(1.0) vcan0 101#0011223344556677\n(1.1) vcan1 102#00\n(1.2) vcan0 12345678#00\n"
                   "(1.3) vcan0 20000080#0000000000000000\n(1.4) vcan0 101#R8\n(1.5) vcan0 103#01 R\n(1.6) vcan0 10")
    frames = list(read_log(log, None))
    assert [(frame.can_id, frame.is_error) for frame in frames] == [(0x101, False), (0, True), (0x103, False)]
    assert [frame.can_id for frame in read_log(log, "vcan1")] == [0x102]


def test_what_is_not_a_log_is_refused_with_its_line(tmp_path, capsys):
    (tmp_path / "bad.log").write_text("(1.0) vcan0 101#00\nhello\n")
    assert main(["--log", str(tmp_path / "bad.log"), "--once"]) == 2
    assert "bad.log:2: not a line of candump -l: 'hello'" in capsys.readouterr().err
    assert main(["--log", str(tmp_path / "none.log"), "--once"]) == 2
    assert "No such file" in capsys.readouterr().err


def test_a_bad_database_is_refused(tmp_path):
    (tmp_path / "bad.dbc").write_text("BO_ nonsense\n")
    with pytest.raises(InputError, match="not a CAN database"):
        Database(tmp_path / "bad.dbc")


def test_an_interface_that_is_not_there_is_told_with_the_line_that_mends_it(capsys):
    assert main(["--can", "nocan9", "--once"]) == 2
    assert "tools/with-vcan" in capsys.readouterr().err


class FakeBus:
    """Hands out what a test gives it; an exception is raised."""

    def __init__(self, what):
        self.what = what

    def recv(self, _timeout):
        item = self.what.pop(0)
        if isinstance(item, Exception):
            raise item
        return item

    def shutdown(self):
        pass


def test_an_interface_may_go_down_and_come_back(monkeypatch):
    message = can.Message(arbitration_id=0x101, data=bytes(8), is_extended_id=False, timestamp=5.0)
    what = [message, can.CanOperationError("Network is down"), OSError("No such device"), None, message]
    monkeypatch.setattr(monitor, "REOPEN_S", 0.0)
    monkeypatch.setattr(LiveSource, "_open", lambda self: FakeBus(what))
    source = LiveSource("vcan7")
    frames = source.frames()
    labels = [(next(frames)[1] is not None, source.label) for _ in range(5)]
    assert labels == [(True, "vcan7"), (False, "vcan7 IS DOWN"), (False, "vcan7 IS DOWN"), (False, "vcan7"),
                      (True, "vcan7")]
