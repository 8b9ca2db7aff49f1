"""tools/synthetic.py: the paper's day has the facts that were published and measured for it."""

import pytest
from synthetic import PAPER_LIMIT_KW, main, synthetic_day
from taperlib.clairvoyant import clairvoyant_bound
from taperlib.limits import constant_limit
from taperlib.sessions import peak_present, read_sessions_csv

DAY_S = 86400


@pytest.mark.parametrize("alpha, bound_kwh", [(0.02, 763.9), (0.03, 757.8), (0.05, 738.7)])
def test_the_clairvoyant_bound_of_the_day_is_the_known_one(alpha, bound_kwh):
    bound = clairvoyant_bound(synthetic_day(alpha), constant_limit(PAPER_LIMIT_KW))
    assert bound.energy_kwh == pytest.approx(bound_kwh, abs=0.05)


def test_200_cars_come_and_124_are_there_at_once():
    day = synthetic_day(0.02)
    assert len(day) == 200
    assert peak_present(day) == 124


def test_all_have_left_by_midnight_and_some_leave_because_of_it():
    departures_s = [session.departure_s for session in synthetic_day(0.02)]
    assert max(departures_s) == DAY_S
    assert departures_s.count(DAY_S) >= 3


def test_stays_are_whole_steps_of_at_most_35():
    stays = {(session.departure_s - session.arrival_s) / 900 for session in synthetic_day(0.02)}
    assert all(stay == int(stay) and 0 < stay <= 35 for stay in stays)
    assert max(stays) == 35


def test_no_target_is_above_the_battery_and_some_reach_it():
    targets = [session.soc_target for session in synthetic_day(0.02)]
    assert max(targets) == 1.0
    assert min(targets) < 0.5


def test_alpha_changes_the_taper_and_nothing_else():
    gentle, steep = synthetic_day(0.02), synthetic_day(0.05)
    assert [session.taper_kw for session in gentle] == pytest.approx([0.64] * 200)
    assert [session.taper_kw for session in steep] == pytest.approx([1.6] * 200)
    assert [session.soc_arrival for session in gentle] == [session.soc_arrival for session in steep]
    assert [session.arrival_s for session in gentle] == [session.arrival_s for session in steep]


def test_a_taper_that_leaves_a_full_battery_no_power_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["--out", str(tmp_path / "day.csv"), "--alpha", "0.08"])
    assert "above 0.075" in capsys.readouterr().err


def test_another_seed_is_another_day():
    assert synthetic_day(0.02, seed=1) != synthetic_day(0.02)


def test_the_written_file_reads_back_as_the_same_day(tmp_path):
    target = tmp_path / "day.csv"
    assert main(["--out", str(target), "--alpha", "0.05", "--seed", "0x5ee2"]) == 0
    day = synthetic_day(0.05)
    again = read_sessions_csv(target)
    assert [(session.session_id, session.arrival_s, session.departure_s) for session in again] == [
        (session.session_id, session.arrival_s, session.departure_s) for session in day]
    assert [session.soc_target for session in again] == [session.soc_target for session in day]
    assert [session.taper_kw for session in again] == pytest.approx([session.taper_kw for session in day])
