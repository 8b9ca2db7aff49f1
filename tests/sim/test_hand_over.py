"""Current that one connector gives up reaches another only when the first vehicle has followed: 5 s after the echo."""

import pytest
from conftest import session

REACTION_S = 5
ECHO_S = 0.2
LIMIT_KW = 22.08  # one socket at 32 A
CAR = dict(battery_kwh=80, soc_arrival=0.1, soc_target=0.9, max_kw=22.08, taper_kw=0)
# "first" has all the current until "urgent" comes, which leaves early and is served first.
FIRST = session("first", **CAR, departure_s=7200)
URGENT = session("urgent", **CAR, arrival_s=600, departure_s=2400)


ANY_CURRENT = ("--min-current-a", "0")  # no turns: all of the current changes hands


def run_two(sim):
    return sim.run([FIRST, URGENT], "--limit-kw", LIMIT_KW, *ANY_CURRENT)


def at(run, session_id, time_s):
    return next(row for row in run.of_session(session_id) if row["time_s"] == str(time_s))


def test_a_hand_over_costs_its_seconds_and_no_more(sim):
    run = run_two(sim)
    assert run.code == 0
    first, urgent = at(run, "first", 600), at(run, "urgent", 600)
    assert float(first["setpoint_a"]) < 1 and float(urgent["setpoint_a"]) > 31  # how it stands at the end of the tick
    had = float(first["current_a"]) + float(urgent["current_a"])  # means over the tick
    assert had == pytest.approx(32 * (60 - REACTION_S - ECHO_S) / 60, abs=0.3)
    later = at(run, "urgent", 660)
    assert float(later["current_a"]) == pytest.approx(32, abs=0.2)


def test_what_was_charged_is_what_the_means_say(sim):
    run = run_two(sim)
    for name in ("first", "urgent"):
        charged = sum(float(row["current_a"]) * 0.69 / 60 for row in run.of_session(name))
        assert float(run.sessions[name]["energy_kwh"]) == pytest.approx(charged, abs=0.01)
    site = sum(float(row["power_kw"]) / 60 for row in run.steps)
    assert run.summary["delivered_kwh"] == pytest.approx(site, abs=0.01)


@pytest.mark.parametrize("tick_s", [1, 2, 5])
def test_in_short_ticks_a_hand_over_spans_several(sim, tick_s):
    rows = [session("first", **CAR, departure_s=900), session("urgent", **CAR, arrival_s=600, departure_s=800)]
    run = sim.run(rows, "--limit-kw", LIMIT_KW, "--tick-s", tick_s, *ANY_CURRENT)
    assert run.code == 0
    served_s = min(int(row["time_s"]) for row in run.of_session("urgent") if float(row["setpoint_a"]) > 0)
    assert 600 + REACTION_S - tick_s < served_s <= 600 + REACTION_S + 2 * tick_s
    assert run.summary["limit_violations"] == 0


def test_who_takes_nothing_from_others_waits_for_nobody(sim):
    """There is room for both: the second one has its current from the first moment of its tick."""
    run = sim.run([FIRST, URGENT], "--limit-kw", 50)
    assert float(at(run, "urgent", 600)["current_a"]) == pytest.approx(32, abs=0.1)
    assert float(at(run, "first", 600)["current_a"]) == pytest.approx(32, abs=0.1)


def test_nothing_is_kept_for_a_vehicle_that_left_when_the_next_one_is_plugged_in(sim):
    """In long ticks its setpoint ran out, and the connector fell back: that says nothing about the next vehicle."""
    before = session("before", **CAR, connector=1, departure_s=1800)
    after = session("after", **CAR, connector=1, arrival_s=1800, departure_s=3600)
    run = sim.run([before, after], "--limit-kw", LIMIT_KW, "--tick-s", 900)
    assert float(at(run, "after", 1800)["current_a"]) == pytest.approx(32, abs=0.5)
