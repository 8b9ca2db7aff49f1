"""The image of a board: how it starts, runs, fails and starts again."""

import re
import socket
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import can
import pytest
from debugger import Debugger, address_of, thumb

from taperlib.canbus import Database
from taperlib.drive import MODES, POLL, Drive, DriveError
from taperlib.emulator import Emulator, emulated

ROOT = Path(__file__).resolve().parents[2]
DBC = Database(ROOT / "codegen/taper.dbc")
TICK_MS = 1000
HANG = thumb(0xBF30, 0xE7FD)  # wfi; b .-2: asleep, so that the emulator need not run millions of instructions


def statuses(frames: list[tuple[int, bytes]]) -> list[dict]:
    return [DBC.decode("CTRL_STATUS", data) for can_id, data in frames if DBC.name_of(can_id) == "CTRL_STATUS"]


def reports(text: str) -> list[dict[str, str]]:
    """The faults in what the image has told."""
    return [dict(re.findall(r"(\w+)=(\w+)", line)) | {"line": line}
            for line in text.splitlines() if line.startswith("taper: fault: ")]


def starts(text: str) -> list[dict[str, str]]:
    return [dict(re.findall(r"(\w+)=(\w+)", line)) for line in text.splitlines() if line.startswith("taper: start: ")]


def patch(board: Emulator, image: Path, function: str, code: bytes) -> None:
    """What the function does from now on, until the next reset."""
    with Debugger(board.debug_port) as debugger:
        debugger.write(address_of(image, function), code)


# ---- Start


def test_the_channel_answers_before_it_is_open(board: Emulator) -> None:
    with socket.create_connection(("127.0.0.1", board.port), 10.0) as attached:
        attached.sendall(b"V\rN\rS6\r")
        answer = b""
        while answer.count(b"\r") < 3:
            answer += attached.recv(100)
    assert re.fullmatch(rb"V\d{4}\rN\w{4}\r\r", answer)


def test_the_board_says_hello_to_everyone_who_opens_the_channel(board: Emulator) -> None:
    for _ in range(2):
        Drive(board.port).close()  # waits for it


def test_the_image_tells_which_station_it_is(board: Emulator, drive: Drive) -> None:
    (start,) = starts(board.text())
    assert start["station"] in board_station(drive)
    assert (start["starts"], start["after_exception"]) == ("1", "0")


def board_station(drive: Drive) -> tuple[str, ...]:
    """Stations with as many connectors as the board's."""
    return {8: ("hub",), 54: ("garage", "caltech")}[drive.figure("connectors")]


def test_the_image_ends_the_emulator_with_the_status_asked_for(board: Emulator, drive: Drive) -> None:
    drive.exit(42)
    assert board.wait() == 42


# ---- On its own clock


def test_the_station_steps_by_the_board_s_clock_and_python_can_hears_it(board: Emulator) -> None:
    heard: list[tuple[int, bytes]] = []
    with can.Bus(interface="slcan", channel=f"socket://127.0.0.1:{board.port}", sleep_after_open=0) as bus:
        while len(statuses(heard)) < 3:
            message = bus.recv(10.0)
            assert message is not None, "the station is silent"
            if not message.is_extended_id:
                heard.append((message.arbitration_id, bytes(message.data)))
    counters = [status["e2e_counter"] for status in statuses(heard)]
    assert all((after - before) % 16 == 1 for before, after in pairwise(counters))
    assert statuses(heard)[0]["mode"] == "init"


def test_a_station_that_hangs_on_its_own_clock_is_reset_by_the_watchdog(board: Emulator, image: Path) -> None:
    with Drive(board.port) as drive:
        patch(board, image, "taper_station_step", HANG)
        drive.wait_for_hello()
    (report,) = reports(board.text())
    assert report["exception"] == "2"
    assert [start["after_exception"] for start in starts(board.text())] == ["0", "2"]


def test_the_reset_button_leaves_the_channel_open(board: Emulator, drive: Drive) -> None:
    board.press_reset()
    drive.wait_for_hello()
    assert len(starts(board.text())) == 2


# ---- Driven


def test_no_time_passes_for_a_driven_station_but_what_it_is_told(drive: Drive) -> None:
    drive.set_up(TICK_MS)
    first = drive.step(0)
    assert drive.call(POLL, 10).frames == []
    later = drive.step(1000 * TICK_MS)
    assert MODES[first.mode] == "INIT"
    assert MODES[later.mode] == "FAILSAFE"


def test_a_step_tells_its_instructions_and_kicks_the_watchdog(drive: Drive) -> None:
    drive.set_up(TICK_MS)
    with_planner, without = drive.step(0), drive.step(TICK_MS)
    assert with_planner.planned and not without.planned
    assert with_planner.instructions > without.instructions > 1000
    assert without.watchdog_kicked
    assert not drive.call(POLL, TICK_MS + 20).watchdog_kicked


def test_the_same_calls_after_a_reset_take_the_same_instructions(drive: Drive) -> None:
    def run() -> list[int]:
        drive.reset()
        drive.set_up(TICK_MS)
        return [drive.step(tick * TICK_MS).instructions for tick in range(5)]
    drive.set_up(TICK_MS)
    assert run() == pytest.approx(run(), abs=40)


def test_a_station_that_refuses_its_settings_says_so(drive: Drive) -> None:
    assert not drive.set_up(tick_ms=0).ok
    assert not drive.step(0).ok
    assert drive.set_up(TICK_MS).ok


def test_the_stack_is_used_but_not_up(drive: Drive) -> None:
    drive.set_up(TICK_MS)
    drive.step(0)
    assert 500 < drive.figure("stack_used_B") < drive.figure("stack_size_B")


# ---- Faults


@dataclass(frozen=True)
class Mistake:
    """What a program does wrong, and how the report tells it."""
    name: str
    code: bytes
    exception: str
    words: str


MISTAKES = (
    Mistake("an undefined instruction", thumb(0xDE00), "6", "UsageFault"),
    Mistake("a division by zero", thumb(0x2000, 0xFBB0, 0xF0F0), "6", "UsageFault"),  # movs r0, #0; udiv r0, r0, r0
    Mistake("a write through NULL", thumb(0x2000, 0x6000), "4", "MemManage"),  # movs r0, #0; str r0, [r0]
    Mistake("running data", thumb(0x4668, 0x3001, 0x4700), "4", "MemManage"),  # mov r0, sp; adds r0, #1; bx r0
    Mistake("a stack that runs over", thumb(0xB401, 0xE7FD), "4", "stack overflow"),  # push {r0}; b .-2
    Mistake("a fault with interrupts off", thumb(0xB672, 0xDE00), "3", "HardFault"),  # cpsid i; udf
)


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_a_fault_is_reported_and_ends_in_a_reset(board: Emulator, drive: Drive, image: Path, mistake: Mistake) -> None:
    drive.set_up(TICK_MS)
    patch(board, image, "taper_station_step", mistake.code)
    with pytest.raises(DriveError, match="reset"):
        drive.step(0)
    (report,) = reports(board.text())
    assert (report["exception"], mistake.words in report["line"]) == (mistake.exception, True)
    assert starts(board.text())[-1]["after_exception"] == mistake.exception
    assert drive.resume().ok
    assert drive.step(0).ok


def test_the_report_of_a_fault_has_the_place_and_the_registers(board: Emulator, drive: Drive, image: Path) -> None:
    drive.set_up(TICK_MS)
    patch(board, image, "taper_station_step", thumb(0x2755, 0x2122, 0xDE00))  # movs r7, #0x55; movs r1, #0x22; udf
    with pytest.raises(DriveError, match="reset"):
        drive.step(0)
    (report,) = reports(board.text())
    assert int(report["pc"], 16) == address_of(image, "taper_station_step") + 4
    assert (int(report["r1"], 16), int(report["r7"], 16)) == (0x22, 0x55)
    assert int(report["cfsr"], 16) == 1 << 16  # UNDEFINSTR


def test_the_station_sends_nothing_from_a_fault(board: Emulator, drive: Drive, image: Path) -> None:
    drive.set_up(TICK_MS)
    patch(board, image, "taper_station_step", thumb(0xDE00))
    with pytest.raises(DriveError, match="reset"):
        drive.step(0)
    assert drive.frames() == []


def test_a_call_that_hangs_ends_in_the_watchdog_s_report(board: Emulator, drive: Drive, image: Path) -> None:
    drive.set_up(TICK_MS)
    patch(board, image, "taper_station_poll", HANG)
    with pytest.raises(DriveError, match="reset"):
        drive.call(POLL, 20)
    (report,) = reports(board.text())
    assert (report["exception"], "watchdog" in report["line"]) == ("2", True)
    assert 0 <= int(report["pc"], 16) - address_of(image, "taper_station_poll") < len(HANG)


def test_the_watchdog_resets_even_when_its_report_hangs(board: Emulator, drive: Drive, image: Path) -> None:
    drive.set_up(TICK_MS)
    patch(board, image, "mps2_fault_report", HANG)
    patch(board, image, "taper_station_poll", HANG)
    with pytest.raises(DriveError, match="reset"):
        drive.call(POLL, 20)
    assert reports(board.text()) == []
    assert len(starts(board.text())) == 2


# ---- Store


def policy_of(drive: Drive) -> str:
    """Whether the first step of a new station plans tells who proposes."""
    return "planner" if drive.step(0).planned else "edf"


def test_settings_survive_a_reset(drive: Drive) -> None:
    drive.set_up(TICK_MS, policy="edf")
    drive.reset()
    assert drive.resume().ok
    assert policy_of(drive) == "edf"
    drive.set_up(TICK_MS, policy="planner")
    drive.reset()
    assert drive.resume().ok
    assert policy_of(drive) == "planner"


def test_what_the_station_wrote_survives_a_fault(board: Emulator, drive: Drive, image: Path) -> None:
    drive.set_up(TICK_MS, policy="edf")
    patch(board, image, "taper_station_step", thumb(0xDE00))
    with pytest.raises(DriveError, match="reset"):
        drive.step(0)
    assert drive.resume().ok
    assert policy_of(drive) == "edf"


def test_the_store_is_empty_when_the_power_was_off(image: Path) -> None:
    with emulated(image) as board, Drive(board.port) as drive:
        drive.set_up(TICK_MS, policy="edf")
    with emulated(image) as board, Drive(board.port) as drive:
        assert not drive.resume().ok
