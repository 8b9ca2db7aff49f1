"""What tools/board.py makes of a week, and what it says when it cannot run. With an image it is run by tools/dev board."""

from dataclasses import replace
from pathlib import Path

import board
import pytest
from taperlib.sessions import Session

HOUR_S = 3600.0
DAY_S = 24 * HOUR_S


def test_the_first_day_holds_those_who_came_on_it_and_nobody_stays_longer():
    sessions = board.sessions_of_day(board.WEEK, 0)
    assert len(sessions) == 9
    assert all(0 <= session.arrival_s < session.departure_s <= DAY_S for session in sessions)


def test_days_share_no_session():
    ids = [session.session_id for day in range(7) for session in board.sessions_of_day(board.WEEK, day)]
    assert len(ids) == len(set(ids)) == 204


def test_a_day_on_which_nobody_came_is_refused():
    with pytest.raises(board.BoardError, match="nobody came on day 7"):
        board.sessions_of_day(board.WEEK, 7)


def test_the_limit_is_a_third_of_what_those_at_a_connector_could_draw():
    session = Session("a", 0.0, HOUR_S, 50.0, 0.2, 0.8, 7.2, 3.6)
    five = [replace(session, session_id=str(i)) for i in range(5)]
    assert board.default_limit_kw(five, "garage") == 12.0
    assert board.default_limit_kw(five * 4, "hub") == pytest.approx(8 * 7.2 / 3)


def test_a_preset_that_was_not_built_is_told_how(capsys, monkeypatch, tmp_path: Path):
    monkeypatch.setattr(board, "BUILD", tmp_path)
    assert board.main(["cm7-hub"]) == board.EXIT_FAILED
    assert "tools/dev board cm7-hub" in capsys.readouterr().err


def test_a_preset_without_an_image_is_refused(capsys, monkeypatch, tmp_path: Path):
    (tmp_path / "host-release").mkdir(parents=True)
    (tmp_path / "host-release/CMakeCache.txt").write_text("TAPER_BOARD:STRING=\nTAPER_STATIONS:STRING=hub\n")
    monkeypatch.setattr(board, "BUILD", tmp_path)
    assert board.main(["host-release"]) == board.EXIT_FAILED
    assert "host-release builds no image" in capsys.readouterr().err
