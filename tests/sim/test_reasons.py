"""What a driver is told: why the connector has the current that it has, and what the vehicle will leave with."""

from conftest import session

CAR = dict(battery_kwh=80, soc_arrival=0.1, soc_target=0.9, max_kw=22, taper_kw=0)
CROWD = [session(f"car-{number}", **CAR, connector=number + 1) for number in range(6)]
REASONS = {"planned", "vehicle_limit", "connector_limit", "site_limit", "feeder_limit", "phase_limit", "waiting",
           "hand_over", "complete", "planned_later", "ramp", "grid_pause", "departure"}


def words(run, column="reason"):
    return {row[column] for row in run.connectors}


def test_every_row_has_a_reason(sim):
    run = sim.run([*CROWD, session("small", connector=7)], "--limit-kw", 40)
    assert run.code == 0
    assert words(run) <= REASONS
    assert "complete" in words(run)
    assert {row["reason"] for row in run.of_session("car-0")} & {"site_limit", "waiting"}


def test_a_vehicle_that_takes_all_that_it_can_is_its_own_limit(sim):
    run = sim.run([session("a", max_kw=7, taper_kw=0)], policy="edf-soc")
    assert run.connectors[5]["reason"] == "vehicle_limit"
    big = sim.run([session("a", battery_kwh=80, max_kw=50, taper_kw=0)], out="big")
    assert big.connectors[5]["reason"] == "connector_limit"


def test_a_limit_of_zero_is_told_as_the_grid_s(sim):
    run = sim.run(CROWD, "--limit-kw", 0)
    assert words(run) == {"grid_pause"}


def test_those_who_wait_for_their_minimum_know_their_place(sim):
    """9 kW are two minima of 4.14 kW: four of six wait, each with a place of its own, and all have their turn."""
    run = sim.run(CROWD, "--limit-kw", 9)
    assert run.code == 0
    tick = [row for row in run.connectors if row["time_s"] == "60"]
    waiting = [row for row in tick if row["reason"] == "waiting"]
    assert len(waiting) == 4
    assert sorted(row["waiting_place"] for row in waiting) == ["1", "2", "3", "4"]
    assert {row["waiting_of"] for row in waiting} == {"4"}
    assert {(row["waiting_place"], row["waiting_of"]) for row in tick if row not in waiting} == {("0", "0")}
    assert all(float(row["energy_kwh"]) > 1 for row in run.sessions.values())


def test_who_will_leave_short_is_told_how_much_and_for_which_limit(sim):
    run = sim.run(CROWD, "--limit-kw", 20)
    row = run.of_session("car-0")[30]
    assert 0 < float(row["short_kwh"]) < 64
    assert 0.1 <= float(row["expected_soc"]) < 0.9
    assert row["because"] == "site_limit"
    last = run.of_session("car-0")[-1]
    missing = (0.9 - float(last["soc"])) * 80
    assert abs(float(last["short_kwh"]) - missing) < 0.5


def test_who_will_have_all_is_told_so(sim):
    row = sim.run([session("a")]).connectors[5]
    assert (row["short_kwh"], row["because"]) == ("0.000", "")
    assert abs(float(row["expected_soc"]) - 0.7) <= 0.01


def test_the_last_word_on_a_session_stands_with_it(sim):
    run = sim.run([*CROWD, session("small", connector=7)], "--limit-kw", 40)
    assert run.sessions["small"]["reason"] == "complete"
    assert run.sessions["small"]["because"] == ""
    for name, row in run.sessions.items():
        last = run.of_session(name)[-1]
        assert (row["reason"], row["because"]) == (last["reason"], last["because"])


def test_a_session_that_never_found_a_connector_has_no_reason(sim):
    rows = [session("there", connector=1), session("late", connector=1, arrival_s=60)]
    run = sim.run(rows)
    assert (run.sessions["late"]["connector"], run.sessions["late"]["reason"]) == ("", "")
