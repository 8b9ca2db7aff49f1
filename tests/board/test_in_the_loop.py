"""Processor in the loop: what the image in QEMU decides, against the same run within taper-sim of the host, to the bit.

Both have 32-bit floats. With TAPER_LONG=1 the paper's day and a whole real week are compared as well.
"""

import os
import time
from pathlib import Path

import pytest

from equality import HOST, cases_of
from taperlib.drive import POLL, Drive
from taperlib.equality import Case, Outcome, Target, compare, run

STATION = os.environ.get("TAPER_STATION", "")
CASES = cases_of(STATION, long=os.environ.get("TAPER_LONG") == "1")
NAMES = [case.name for case in CASES]
WATCHED_S = 2.0  # a call that takes longer is a fault


@pytest.fixture(scope="module")
def simulator() -> Path:
    assert HOST.is_file(), (f"{HOST} is not there, which the board is compared with: "
                            "cmake --preset host-debug && cmake --build --preset host-debug -t taper-sim")
    return HOST


@pytest.fixture(scope="module", params=CASES, ids=NAMES)
def runs(request: pytest.FixtureRequest, image: Path, simulator: Path,
         tmp_path_factory: pytest.TempPathFactory) -> tuple[Case, Outcome, Outcome]:
    """A run on the host, and on the board."""
    folder = tmp_path_factory.mktemp("in-the-loop")
    host, board = Target("host", simulator), Target("board", simulator, image=image)
    return request.param, run(host, request.param, folder / "host"), run(board, request.param, folder / "board")


def test_the_board_decides_as_the_host_does_to_the_bit(runs: tuple[Case, Outcome, Outcome]) -> None:
    _, host, board = runs
    difference = compare(host, board)
    assert not difference, difference
    assert difference.frames > 500


def test_the_planner_works_and_no_limit_is_exceeded(runs: tuple[Case, Outcome, Outcome]) -> None:
    _, _, board = runs
    assert board.summary["solves"] > 0
    assert board.summary["delivered_kwh"] > 0
    assert (board.summary["limit_violations"], board.summary["guard_violations"]) == (0, 0)


def test_instructions_and_stack_are_measured(runs: tuple[Case, Outcome, Outcome]) -> None:
    _, _, board = runs
    measured = board.summary["board"]
    per_tick = measured["instructions_per_tick"]
    assert 0 < per_tick["p50"] <= per_tick["max"]
    assert 0 < per_tick["max_without_slice"] < per_tick["max"]
    assert 0 < measured["stack_used_b"] < measured["stack_size_b"]


def test_a_simulation_may_take_its_time_between_calls(drive: Drive) -> None:
    assert drive.set_up().ok
    assert drive.step(0).ok
    time.sleep(1.5 * WATCHED_S)
    assert drive.call(POLL, 500).ok
