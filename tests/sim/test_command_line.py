"""The command line: what is refused with exit code 2, and what --help says."""

import pytest
from conftest import csv_text, has_planner, session

POLICIES = ("soc-mpc", "mpc", "edf", "edf-soc", "llf", "equal-share")
GIVEN = ("--sessions", "sessions.csv", "--policy", "edf")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ((), "--sessions is needed"),
        (("--policy", "edf"), "--sessions is needed"),
        (("--sessions", "sessions.csv"), "--policy is needed"),
        (("--sessions", "sessions.csv", "--policy", "best"), "--policy: unknown policy 'best'"),
        ((*GIVEN, "--station", "moon"), "--station: unknown station 'moon'; there are"),
        ((*GIVEN, "--limit-kw", "much"), "--limit-kw: not a number: 'much'"),
        ((*GIVEN, "--limit-kw", "nan"), "--limit-kw: not a number: 'nan'"),
        ((*GIVEN, "--limit-kw", "inf"), "--limit-kw: not a number: 'inf'"),
        ((*GIVEN, "--limit-kw", "-1"), "--limit-kw: below 0"),
        ((*GIVEN, "--limit-kw", "10", "--limit-csv", "limit.csv"), "exclude each other"),
        ((*GIVEN, "--tick-s", "0"), "--tick-s: not a whole number in 1..3600: '0'"),
        ((*GIVEN, "--tick-s", "3601"), "--tick-s: not a whole number"),
        ((*GIVEN, "--tick-s", "1.5"), "--tick-s: not a whole number"),
        ((*GIVEN, "--tick-s", "-60"), "--tick-s: not a whole number"),
        ((*GIVEN, "--tick-s", ""), "--tick-s: not a whole number"),
        ((*GIVEN, "--min-current-a", "-6"), "--min-current-a: below 0"),
        ((*GIVEN, "--min-current-a", "33", "--station", "hub"), "--min-current-a: above 32 A"),
        ((*GIVEN, "--seed", "x"), "--seed: not a whole number"),
        ((*GIVEN, "--seed", "18446744073709551616"), "--seed: not a whole number"),
        ((*GIVEN, "--frobnicate"), "frobnicate"),
        ((*GIVEN, "extra"), "unexpected argument 'extra'"),
        ((*GIVEN, "--limit-kw"), "requires an argument"),
    ],
)
def test_a_bad_command_line_is_refused(sim, arguments, reason):
    sim.write("sessions.csv", csv_text([session("a")]))
    run = sim.call(*arguments)
    assert run.code == 2
    assert reason in run.stderr
    assert run.stdout == ""
    assert sim.files() == ["sessions.csv"]


def test_help_names_units_policies_and_stations(sim):
    run = sim.call("--help")
    assert run.code == 0
    text = " ".join(run.stdout.split())
    for word in (*POLICIES, "garage", "[kW]", "[s]", "[kWh]", "[A]", "taper_kw", "expected_departure_s", "EXIT CODE"):
        assert word in text


@pytest.mark.parametrize("policy", ["edf", "edf-soc", "llf", "equal-share"])
def test_a_policy_without_planner_charges_without_solving(sim, policy):
    run = sim.run([session("a")], policy=policy)
    assert run.code == 0, run.stderr
    assert run.summary["policy"] == policy
    assert run.summary["satisfied"] == 1
    assert run.summary["solves"] == 0


@pytest.mark.parametrize("policy", ["soc-mpc", "mpc"])
def test_a_policy_with_planner_charges_by_its_plans(planning_sim, policy):
    run = planning_sim.run([session("a")], policy=policy)
    assert run.code == 0, run.stderr
    assert run.summary["satisfied"] == 1
    assert run.summary["solves"] > 0
    assert 0 < run.summary["iterations"]["p50"] <= run.summary["iterations"]["p99"] <= run.summary["iterations"]["max"]
    assert run.summary["fallback_ticks"] == 0


def test_the_default_station_is_the_garage(sim):
    sim.write("sessions.csv", csv_text([session("a")]))
    run = sim.call("--sessions", "sessions.csv", "--policy", "edf", "--out", "out")
    assert run.summary["station"] == "garage"
    assert run.summary["tick_s"] == 60


def test_the_minimum_current_can_be_taken_away(sim):
    slow = session("slow", max_kw=20, taper_kw=0, soc_target=0.75)
    limit = ("--limit-kw", "2", "--tick-s", "900")  # 2.9 A on three phases
    assert float(sim.run([slow], *limit).sessions["slow"]["energy_kwh"]) == 0.0
    run = sim.run([slow], *limit, "--min-current-a", "0", out="continuous")
    assert float(run.sessions["slow"]["energy_kwh"]) > 7.0
    assert run.code == 0


def test_a_build_without_planner_says_so_and_still_charges(sim):
    if has_planner(sim):
        pytest.skip("this build has the planner")
    run = sim.run([session("a")], policy="soc-mpc")
    assert run.code == 0
    assert "this build has no planner; soc-mpc charges by earliest deadline first" in run.stderr
    assert {row["mode"] for row in run.steps} == {"fallback"}
    assert run.summary["delivered_kwh"] > 0
    assert run.summary["fallback_ticks"] == len(run.steps)
