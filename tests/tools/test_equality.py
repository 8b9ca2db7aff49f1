"""The comparison of a run on several targets. What boards do is in tests/board."""

import os
from pathlib import Path

import equality
import pytest

from taperlib.equality import Case, EqualityError, Target, compare, run
from taperlib.sessions import Session

CARS = [Session(f"car-{k}", 60 * k, 3600, 40.0, 0.2, 0.9, 11.0, 5.0) for k in range(3)]
CASE = Case("three cars", "hub", CARS, ("--policy", "edf", "--limit-csv", "limits.csv"),
            {"limits.csv": "time_s,limit_kw\n0,20\n1800,10\n"})


@pytest.fixture
def target():
    path = os.environ.get("TAPER_SIM")
    assert path, "TAPER_SIM does not say where taper-sim is"
    return Target("host", Path(path).resolve())


def change(outcome, name, old, new):
    path = outcome.folder / name
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_two_runs_of_one_program_are_equal(target, tmp_path):
    one, two = (run(target, CASE, tmp_path / name) for name in ("one", "two"))
    difference = compare(one, two)
    assert not difference
    assert difference.frames == len(one.frames()) > 100
    assert (difference.count, difference.first, difference.files) == (0, "", ())


def test_a_frame_that_differs_is_shown_with_its_time(target, tmp_path):
    one, two = (run(target, CASE, tmp_path / name) for name in ("one", "two"))
    line = one.frames()[50]
    changed = line[:-1] + ("0" if line[-1] != "0" else "1")
    change(two, "frames.log", line + "\n", changed + "\n")
    difference = compare(one, two)
    assert difference
    assert (difference.count, difference.first) == (1, f"{changed}, and not {line}")


def test_frames_that_only_one_target_sent_count(target, tmp_path):
    one, two = (run(target, CASE, tmp_path / name) for name in ("one", "two"))
    last = one.frames()[-1]
    change(two, "frames.log", last + "\n", "")
    assert compare(one, two).count == 1
    assert compare(one, two).first == f"nothing, and not {last}"
    assert compare(two, one).first == f"{last}, and not nothing"


@pytest.mark.parametrize("name, old, new", [
    ("connectors.csv", "car-0", "car-9"), ("steps.csv", "20.0000,9.1667", "20.0000,9.1668"), ("sessions.csv", "car-1", "car-8"),
    ("summary.json", '"limit_violations":\t0', '"limit_violations":\t1')])
def test_files_that_differ_are_named(target, tmp_path, name, old, new):
    one, two = (run(target, CASE, tmp_path / folder) for folder in ("one", "two"))
    change(two, f"out/{name}", old, new)
    difference = compare(one, two)
    assert difference
    assert (difference.count, difference.files) == (0, (name,))


def test_what_is_measured_may_differ(target, tmp_path):
    one, two = (run(target, CASE, tmp_path / name) for name in ("one", "two"))
    change(two, "out/summary.json", '"seed":\t0', '"seed":\t0, "board": {"stack_used_b": 7}')
    assert not compare(one, two)


def test_a_run_that_fails_says_why(target, tmp_path):
    bad = Case("bad", "hub", CARS, ("--policy", "edf", "--limit-csv", "missing.csv"))
    with pytest.raises(EqualityError, match="host: bad: exit code 1: missing.csv: "):
        run(target, bad, tmp_path / "bad")
    with pytest.raises(EqualityError, match="nobody: .*no-such-program cannot be started: No such file"):
        run(Target("nobody", tmp_path / "no-such-program"), CASE, tmp_path / "nobody")


def test_an_image_that_is_none_says_how_to_build_one(target, tmp_path):
    board = Target("board", target.program, image=tmp_path / "other.elf")
    with pytest.raises(EqualityError, match="board: .*other.elf: is not an image"):
        run(board, CASE, tmp_path / "run")


def test_what_is_not_built_is_listed_with_the_lines_that_build_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(equality, "BUILD", tmp_path)
    monkeypatch.setattr(equality, "HOST", tmp_path / "taper-sim")
    assert equality.main(["--target", "cm7-hub", "--target", "linux-armhf"]) == 1
    errors = capsys.readouterr().err
    assert "cmake --preset host-debug && cmake --build --preset host-debug -t taper-sim" in errors
    assert "cmake --preset cm7-hub && cmake --build --preset cm7-hub" in errors
    assert "cmake --preset linux-armhf && cmake --build --preset linux-armhf" in errors
    assert "cm4-hub" not in errors


def test_the_table_has_a_row_for_every_run_and_target(target, tmp_path, monkeypatch):
    monkeypatch.setattr(equality, "HOST", target.program)
    monkeypatch.setattr(equality, "targets_of", lambda station, presets: [Target("twin", target.program)])
    lines, equal = equality.table([CASE], [], tmp_path / "runs", jobs=2)
    assert equal
    assert len(lines) == 4
    frames = len((tmp_path / "runs/0-0/frames.log").read_text().splitlines())
    assert lines[2].startswith(f"| three cars | host | {frames} | | | ")
    assert lines[3].startswith(f"| three cars | twin | {frames} | 0 | none | ")


@pytest.mark.parametrize("station, boards", [("hub", ["Cortex-M7", "Cortex-M4F"]), ("garage", ["Cortex-M7"])])
def test_every_station_is_compared_on_its_boards_and_on_arm_linux(station, boards):
    names = [target.name for target in equality.targets_of(station, [*equality.BOARDS, *equality.PROGRAMS])]
    assert names == [*boards, "armhf", "aarch64"]


@pytest.mark.parametrize("station", equality.STATIONS)
def test_the_long_runs_come_on_top(station):
    short, long = (equality.cases_of(station, long=long) for long in (False, True))
    assert [case.name for case in long][:len(short)] == [case.name for case in short]
    assert [len(case.sessions) for case in long[len(short):]] == [200, 335]
    assert {case.station for case in long} == {station}
