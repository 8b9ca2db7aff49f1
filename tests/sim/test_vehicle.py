"""The simulated vehicle: its taper, its target, its departure, and what it tells the station."""

import pytest
from conftest import TOLD, session

NEVER_LIMITED = ("--tick-s", "900", "--min-current-a", "0")


def socs(run, session_id):
    return [float(row["soc"]) for row in run.of_session(session_id)]


@pytest.mark.parametrize("policy", ["edf", "equal-share"])
def test_steps_of_a_quarter_hour_follow_the_closed_form(sim, policy):
    """Power is max_kw - taper_kw * SOC at the start of the step, so SOC follows a linear recursion."""
    battery_kwh, max_kw, taper_kw = 8.0, 2.4, 1.6
    car = session("a", battery_kwh=battery_kwh, soc_arrival=0.1, soc_target=1, max_kw=max_kw, taper_kw=taper_kw)
    run = sim.run([car], *NEVER_LIMITED, policy=policy, station="paper")
    seen = socs(run, "a")
    assert len(seen) == 16
    decay = 1 - 0.25 * taper_kw / battery_kwh
    for step, soc in enumerate(seen):
        exact = max_kw / taper_kw - (max_kw / taper_kw - 0.1) * decay**step
        assert soc == pytest.approx(min(exact, 1), abs=1e-5)


@pytest.mark.parametrize("policy", ["edf-soc", "llf"])
def test_a_station_that_knows_the_taper_gives_what_the_battery_takes(sim, policy):
    car = session("a", battery_kwh=8, soc_arrival=0.1, soc_target=1, max_kw=2.4, taper_kw=1.6)
    run = sim.run([car], *NEVER_LIMITED, policy=policy, station="paper")
    blind = sim.run([car], *NEVER_LIMITED, policy="edf", station="paper", out="blind")
    assert socs(run, "a") == pytest.approx(socs(blind, "a"), abs=5e-3)


def test_only_the_policies_that_may_know_the_taper_react_to_it(sim):
    car = session("a", battery_kwh=80, soc_arrival=0.8, soc_target=1, max_kw=11, taper_kw=10)
    blind = sim.run([car], *NEVER_LIMITED, policy="edf", out="blind")
    knowing = sim.run([car], *NEVER_LIMITED, policy="edf-soc", out="knowing")
    assert float(blind.of_session("a")[0]["setpoint_a"]) == pytest.approx(11000 / 690, abs=0.1)
    assert float(knowing.of_session("a")[0]["setpoint_a"]) == pytest.approx(3000 / 690, abs=0.2)


def test_charging_stops_at_the_target(sim):
    run = sim.run([session("a")], "--tick-s", "900")
    row = run.sessions["a"]
    assert float(row["energy_kwh"]) == pytest.approx(8, abs=1e-4)
    assert float(row["soc_departure"]) == pytest.approx(0.7, abs=1e-5)
    assert row["satisfied"] == "1"
    assert float(row["short_kwh"]) == 0
    assert run.summary["requested_kwh"] == 8
    assert run.steps[-1]["active"] == "0"
    assert run.steps[0]["active"] == "1"
    assert float(run.steps[-1]["power_kw"]) == 0


def test_a_vehicle_that_wants_nothing_gets_nothing(sim):
    run = sim.run([session("a", soc_target=0.5)])
    assert run.sessions["a"]["satisfied"] == "1"
    assert run.summary["delivered_kwh"] == 0
    assert {row["active"] for row in run.steps} == {"0"}


def test_energy_counts_only_until_the_departure(sim):
    """It leaves 100 s into its second tick."""
    run = sim.run([session("a", departure_s=1000, taper_kw=0)], "--tick-s", "900")
    assert float(run.sessions["a"]["energy_kwh"]) == pytest.approx(7 * 1000 / 3600, abs=1e-3)


def test_a_connector_gives_no_more_than_its_own_maximum(sim):
    run = sim.run([session("a", battery_kwh=600, max_kw=200, taper_kw=0)], "--min-current-a", "0")
    assert run.summary["peak_kw"] == pytest.approx(3 * 230 * 32 / 1000, abs=0.07)
    assert {row["current_a"] for row in run.connectors} == {"32.000"}


def test_nearly_the_target_is_satisfied(sim):
    """0.01 of SOC may be missing."""
    car = dict(departure_s=3600, battery_kwh=40, soc_arrival=0.5, max_kw=8, taper_kw=0)  # gets 0.2 of SOC
    enough = sim.run([session("a", **car, soc_target=0.709)], out="enough")
    little = sim.run([session("a", **car, soc_target=0.712)], out="little")
    assert enough.sessions["a"]["satisfied"] == "1"
    assert float(enough.sessions["a"]["short_kwh"]) > 0
    assert little.sessions["a"]["satisfied"] == "0"


def urgent_first(run):
    return float(run.sessions["urgent"]["energy_kwh"]) > float(run.sessions["other"]["energy_kwh"])


def test_the_station_believes_the_departure_that_the_driver_told(sim):
    """Both leave at the same time; the one who says that it leaves earlier is served first."""
    car = dict(departure_s=3600, battery_kwh=80, soc_arrival=0.1, soc_target=0.9, max_kw=22, taper_kw=0)
    rows = [session("other", **car, **{TOLD: 20000}), session("urgent", **car, **{TOLD: 3000})]
    run = sim.run(rows, "--limit-kw", "15")
    assert run.code == 0
    assert urgent_first(run)
    swapped = [session("other", **car, **{TOLD: 3000}), session("urgent", **car, **{TOLD: 20000})]
    assert not urgent_first(sim.run(swapped, "--limit-kw", "15", out="swapped"))


def test_the_vehicle_leaves_when_it_leaves_whatever_was_told(sim):
    car = dict(battery_kwh=80, soc_arrival=0.1, soc_target=0.9, max_kw=7, taper_kw=0, departure_s=3600)
    early = sim.run([session("a", **car, **{TOLD: 1800})], out="early")
    late = sim.run([session("a", **car, **{TOLD: 7200})], out="late")
    for run in (early, late):
        assert run.code == 0
        assert float(run.sessions["a"]["energy_kwh"]) == pytest.approx(7, abs=0.02)
        assert run.steps[-1]["time_s"] == "3540"


def test_a_told_departure_may_be_left_out(sim):
    rows = [session("a", **{TOLD: ""}), session("b", **{TOLD: 7200})]
    run = sim.run(rows)
    assert run.code == 0
    assert run.summary["satisfied"] == 2


def test_times_may_be_those_of_a_real_clock(sim):
    """Unix seconds: the station's millisecond clock has wrapped many times."""
    began = 1571500800
    run = sim.run([session("a", arrival_s=began, departure_s=began + 7200)])
    assert run.steps[0]["time_s"] == str(began)
    assert run.sessions["a"]["satisfied"] == "1"


def test_the_planner_loses_little_to_a_taper_that_it_knows(planning_sim):
    """Alone and unlimited, a plan can be no worse than charging as fast as the battery takes."""
    car = session("a", battery_kwh=8, soc_arrival=0.1, soc_target=1, max_kw=2.4, taper_kw=1.6)
    plan = planning_sim.run([car], *NEVER_LIMITED, policy="soc-mpc", station="paper")
    fast = planning_sim.run([car], *NEVER_LIMITED, policy="edf", station="paper", out="fast")
    assert plan.code == 0
    assert float(plan.sessions["a"]["energy_kwh"]) >= 0.99 * float(fast.sessions["a"]["energy_kwh"])
