"""Limits per phase, with vehicles that use one phase or three. test_loads.c proves the measure that finds violations."""

import pytest
from conftest import csv_text, session

HUB_FUSE_A, FEEDER_FUSE_A = 160, 96
ONE_PHASE = dict(battery_kwh=80, soc_arrival=0.1, soc_target=0.9, max_kw=7.36, taper_kw=0, phases=1)
ANY_CURRENT = ("--min-current-a", "0")


def test_a_one_phase_car_on_a_three_phase_socket_draws_from_one_phase(sim):
    run = sim.run([session("a", **ONE_PHASE)])
    assert run.code == 0
    assert float(run.of_session("a")[30]["current_a"]) == pytest.approx(32, abs=0.1)
    assert run.summary["peak_kw"] == pytest.approx(7.36, abs=0.02)


def test_one_phase_cars_stop_at_the_fuse_of_their_phase(sim):
    """Four of them would draw 128 A from L1 of a feeder with a fuse of 96 A, but only 29 of its 66 kW."""
    run = sim.run([session(f"car-{number}", **ONE_PHASE, connector=number + 1) for number in range(4)], *ANY_CURRENT)
    assert run.code == 0
    assert run.summary["limit_violations"] == 0
    currents = [sum(float(row["current_a"]) for row in run.connectors if row["time_s"] == str(60 * tick))
                for tick in range(10, 60)]
    assert max(currents) <= FEEDER_FUSE_A + 1e-9
    assert currents[-1] == pytest.approx(FEEDER_FUSE_A, abs=1)
    assert "phase_limit" in {row["reason"] for row in run.connectors}


def test_cars_of_both_kinds_stay_within_every_fuse(sim):
    cars = [session(f"car-{number}", **ONE_PHASE | {"phases": 1 if number % 3 else 3, "max_kw": 7.36 if number % 3 else 22})
            for number in range(8)]
    run = sim.run(cars)
    assert run.code == 0, run.stderr
    assert run.summary["limit_violations"] == run.summary["guard_violations"] == 0


def test_the_garage_between_two_lines_is_bound_by_its_transformer(sim):
    cars = [session(f"car-{number}", battery_kwh=80, soc_arrival=0.1, soc_target=0.9, max_kw=6.6, taper_kw=0)
            for number in range(54)]
    run = sim.run(cars, station="caltech")
    assert run.code == 0, run.stderr
    assert run.summary["limit_violations"] == run.summary["guard_violations"] == 0
    assert 100 < run.summary["peak_kw"] <= 150
    pod = {str(number) for number in range(1, 9)}
    in_pod = [sum(float(row["current_a"]) for row in run.connectors
                  if row["time_s"] == str(60 * tick) and row["connector"] in pod) for tick in range(60)]
    assert 70 < max(in_pod) <= 80 + 1e-9


@pytest.mark.parametrize(("value", "message"), [("2", "neither 1 nor 3: '2'"), ("one", "neither 1 nor 3: 'one'")])
def test_other_numbers_of_phases_are_refused(sim, value, message):
    run = sim.run(csv_text([session("a", phases=value)]))
    assert run.code == 1
    assert run.stderr.startswith(f"sessions.csv:2: phases: {message}")


def test_phases_may_be_left_out(sim):
    run = sim.run([session("one", **ONE_PHASE), session("all", **ONE_PHASE | {"phases": "", "max_kw": 22.08})])
    assert run.code == 0
    assert run.summary["peak_kw"] == pytest.approx(7.36 + 22.08, abs=0.1)
