"""The site limit: how its file is read, and that every tick respects it."""

import pytest
from conftest import csv_text, session

CROWD = [session(f"car-{number}", battery_kwh=80, soc_arrival=0.1, soc_target=0.9, max_kw=22, taper_kw=0)
         for number in range(8)]
# Any current may be set: what is not used of the limit is rounding, 0.069 kW a car at most.
ANY_CURRENT = ("--min-current-a", "0")
UNUSED_KW = 8 * 0.069


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "limit.csv:1: header: missing: the file is empty"),
        ("time_s,limit_kw\n", "limit.csv:1: time_s: no rows, at least one is needed"),
        ("time_s,kw\n0,5\n", "limit.csv:1: limit_kw: column missing"),
        ("time_s,limit_kw\n0,5\n0,6\n", "limit.csv:3: time_s: not after the time of the row before"),
        ("time_s,limit_kw\n0,5\n60,6\n30,7\n", "limit.csv:4: time_s: not after"),
        ("time_s,limit_kw\n0,-5\n", "limit.csv:2: limit_kw: below 0"),
        ("time_s,limit_kw\n0,much\n", "limit.csv:2: limit_kw: not a number: 'much'"),
        ("time_s,limit_kw\n0,nan\n", "limit.csv:2: limit_kw: not a number: 'nan'"),
        ("time_s,limit_kw\n0\n", "limit.csv:2: row: 1 fields, but the header has 2"),
    ],
)
def test_a_bad_limit_file_is_refused(sim, text, message):
    sim.write("limit.csv", text)
    run = sim.run([session("a")], "--limit-csv", "limit.csv")
    assert run.code == 1
    assert run.stderr.startswith(message)
    assert run.stderr.count("\n") == 1
    assert run.stdout == ""
    assert sim.files() == ["limit.csv", "sessions.csv"]


def powers(run):
    return {int(row["time_s"]): (float(row["limit_kw"]), float(row["power_kw"])) for row in run.steps}


@pytest.mark.parametrize("policy", ["edf", "edf-soc", "llf", "equal-share"])
def test_no_tick_is_above_a_constant_limit(sim, policy):
    run = sim.run(CROWD, "--limit-kw", "40", *ANY_CURRENT, policy=policy)
    assert run.code == 0
    assert run.summary["limit_violations"] == 0
    assert run.summary["guard_violations"] == 0
    assert run.summary["peak_kw"] == pytest.approx(40, abs=UNUSED_KW)
    assert run.summary["delivered_kwh"] > 0.9 * 4 * 40  # some is missing while current changes hands
    assert all(power <= 40.000001 for _, power in powers(run).values())
    assert run.summary["peak_kw"] <= 40


@pytest.mark.parametrize("policy", ["edf", "equal-share"])
def test_a_drop_of_the_limit_is_respected_in_the_same_tick(sim, policy):
    sim.write("limit.csv", "time_s,limit_kw\n0,60\n3600,20\n7200,80\n")
    run = sim.run(CROWD, "--limit-csv", "limit.csv", *ANY_CURRENT, policy=policy)
    assert run.code == 0
    at = powers(run)
    for time_s, limit_kw in ((3540, 60), (3600, 20), (7140, 20), (7200, 80)):
        assert at[time_s] == (limit_kw, pytest.approx(limit_kw, abs=UNUSED_KW))
        assert at[time_s][1] <= limit_kw


def test_a_drop_inside_a_tick_holds_for_the_whole_tick(sim):
    sim.write("limit.csv", "time_s,limit_kw\n0,60\n3700,20\n")
    run = sim.run(CROWD, "--limit-csv", "limit.csv", "--tick-s", "900")
    at = powers(run)
    assert run.code == 0
    assert at[2700][0] == 60
    assert at[3600][0] == 20 and at[3600][1] <= 20


def test_the_first_limit_holds_before_its_time(sim):
    sim.write("limit.csv", "time_s,limit_kw\n7200,30\n9000,50\n")
    run = sim.run(CROWD, "--limit-csv", "limit.csv", *ANY_CURRENT)
    assert run.code == 0
    assert powers(run)[120] == (30, pytest.approx(30, abs=UNUSED_KW))  # the third tick: the first two raise them slowly


def test_limit_zero_stops_everything(sim):
    run = sim.run(CROWD, "--limit-kw", "0")
    assert run.code == 0
    assert run.summary["delivered_kwh"] == 0
    assert run.summary["peak_kw"] == 0


def test_the_station_s_own_limit_holds_above_a_higher_one(sim):
    run = sim.run(CROWD, "--limit-kw", "500")
    assert run.code == 0
    assert "above the station's own, 110 kW" in run.stderr
    assert {row["limit_kw"] for row in run.steps} == {"110.0000"}
    assert run.summary["peak_kw"] <= 110


def test_the_feeders_hold_too(sim):
    """Four of the eight connectors are on one feeder of 66 kW."""
    run = sim.run([car | {"connector": number + 1, "max_kw": 22, "taper_kw": 0} for number, car in
                   enumerate(CROWD[:4])])
    assert run.code == 0
    assert 64 < run.summary["peak_kw"] <= 66


def test_a_limit_file_longer_than_the_station_keeps_is_followed_to_its_end(sim):
    points = [(minute * 60, 30 + minute % 2 * 20) for minute in range(2000)]
    sim.write("limit.csv", "time_s,limit_kw\n" + "".join(f"{time_s},{kw}\n" for time_s, kw in points))
    long_stay = [car | {"departure_s": 2000 * 60, "battery_kwh": 600} for car in CROWD]
    run = sim.run(long_stay, "--limit-csv", "limit.csv", *ANY_CURRENT)
    assert run.code == 0
    at = powers(run)
    assert all(at[time_s][0] == kw for time_s, kw in points)
    late = [at[time_s] for time_s, _ in points[-1000:]]
    assert sum(power > limit_kw - 1 for limit_kw, power in late) > 950  # the others: current changes hands, a car is full


def test_the_planner_uses_a_drop_that_it_knows_of(planning_sim):
    """Four cars leave when the limit drops, four later: all get what they want if all of the limit is used before."""
    early = [session(f"early-{number}", connector=number + 1, battery_kwh=40, soc_arrival=0.1, soc_target=0.6,
                     departure_s=2 * 3600, max_kw=11, taper_kw=0) for number in range(4)]
    late = [session(f"late-{number}", connector=number + 5, battery_kwh=40, soc_arrival=0.1, soc_target=0.6,
                    departure_s=8 * 3600, max_kw=11, taper_kw=0) for number in range(4)]
    planning_sim.write("limit.csv", "time_s,limit_kw\n0,44\n7200,14\n")
    run = planning_sim.run(early + late, "--limit-csv", "limit.csv", "--min-current-a", "0", policy="soc-mpc")
    assert run.code == 0
    assert run.summary["satisfied"] == 8
    assert all(power <= limit_kw for limit_kw, power in powers(run).values())


def test_unknown_columns_of_a_limit_file_are_ignored_with_a_warning(sim):
    sim.write("limit.csv", "time_s,limit_kw,why\n0,30,test\n")
    sim.write("sessions.csv", csv_text(CROWD))
    run = sim.run(CROWD, "--limit-csv", "limit.csv")
    assert run.code == 0
    assert run.stderr == "limit.csv:1: why: warning: unknown column, ignored\n"


def test_a_plan_counts_on_a_rise_that_is_known_ahead(planning_sim):
    """4 kW for two hours, then 22: the slow car cannot catch up then, the fast one can, though it leaves earlier."""
    slow = session("slow", battery_kwh=80, soc_arrival=0.5, soc_target=0.65, max_kw=3.7, taper_kw=0)
    fast = session("fast", departure_s=3 * 3600, battery_kwh=80, soc_arrival=0.5, soc_target=0.7, max_kw=22, taper_kw=0)
    planning_sim.write("rise.csv", "time_s,limit_kw\n0,4\n7200,22\n")

    def slow_at_the_rise(run):
        assert run.code == 0
        return {row["time_s"]: float(row["soc"]) for row in run.of_session("slow")}["7200"]

    known = planning_sim.run([slow, fast], "--limit-csv", "rise.csv", *ANY_CURRENT, policy="soc-mpc", out="known")
    never = planning_sim.run([slow, fast], "--limit-kw", "4", *ANY_CURRENT, policy="soc-mpc", out="never")
    assert slow_at_the_rise(known) > 0.55  # 3.7 kW all the time: 0.5925
    assert slow_at_the_rise(never) < 0.51
    assert known.summary["satisfied"] == 2
    blind = planning_sim.run([slow, fast], "--limit-csv", "rise.csv", *ANY_CURRENT, policy="edf", out="blind")
    assert blind.summary["satisfied"] == 1
