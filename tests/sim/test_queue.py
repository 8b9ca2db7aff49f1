"""Who gets which connector, and who waits. The hub has eight."""

from conftest import session


def at_hub(number, **changed):
    return session(f"car-{number}", departure_s=3600, **changed)


def places(run):
    return {name: row["connector"] for name, row in run.sessions.items()}


def queued(run):
    return {name: float(row["queued_s"]) for name, row in run.sessions.items()}


def test_the_lowest_free_connector_is_taken_by_order_of_arrival(sim):
    run = sim.run([at_hub(1, arrival_s=120), at_hub(2, arrival_s=60), at_hub(3, arrival_s=60)])
    assert places(run) == {"car-2": "1", "car-3": "2", "car-1": "3"}
    assert set(queued(run).values()) == {0.0}


def test_a_named_connector_is_kept(sim):
    run = sim.run([at_hub(1, connector=5), at_hub(2), at_hub(3, connector=1, arrival_s=60)])
    assert places(run)["car-1"] == "5"
    assert places(run)["car-2"] == "1"
    assert places(run)["car-3"] == ""  # the first free one was taken before, for the whole hour
    assert queued(run)["car-3"] == 3540


def test_more_vehicles_than_connectors_queue_by_arrival(sim):
    crowd = [at_hub(number, arrival_s=number) for number in range(8)]
    crowd[3]["departure_s"] = 1200
    crowd[6]["departure_s"] = 1800
    late = [session("second", arrival_s=200, departure_s=7200), session("first", arrival_s=100, departure_s=7200),
            session("third", arrival_s=300, departure_s=7200)]
    run = sim.run(crowd + late)
    assert run.code == 0
    assert [places(run)[name] for name in ("first", "second")] == ["4", "7"]
    assert queued(run)["first"] == 1200 - 100
    assert queued(run)["second"] == 1800 - 200
    assert queued(run)["third"] == 3600 - 300
    assert run.summary["queued"] == 3
    assert all(float(run.sessions[name]["energy_kwh"]) > 0 for name in ("first", "second", "third"))


def test_who_gives_up_is_reported_with_nothing(sim):
    crowd = [at_hub(number) for number in range(8)]
    run = sim.run([*crowd, session("unlucky", arrival_s=600, departure_s=1500)])
    assert run.code == 0
    row = run.sessions["unlucky"]
    assert row["connector"] == ""
    assert float(row["energy_kwh"]) == 0
    assert float(row["soc_departure"]) == 0.5
    assert row["satisfied"] == "0"
    assert float(row["short_kwh"]) == 8
    assert float(row["queued_s"]) == 900
    assert run.summary["never_plugged_in"] == 1
    assert run.summary["sessions"] == 9


def test_who_waits_for_a_named_connector_holds_up_nobody(sim):
    run = sim.run([at_hub(0, connector=1), at_hub(1, connector=1, arrival_s=60), at_hub(2, arrival_s=120)])
    assert places(run)["car-2"] == "2"
    assert queued(run)["car-2"] == 0


def test_a_connector_that_gets_free_is_taken_in_the_same_tick(sim):
    run = sim.run([at_hub(1, connector=2), session("next", connector=2, arrival_s=3600, departure_s=7200)])
    assert queued(run)["next"] == 0
    assert run.of_session("next")[0]["time_s"] == "3600"
    assert float(run.of_session("next")[0]["current_a"]) > 0


def test_a_vehicle_between_two_ticks_waits_for_the_next_tick(sim):
    run = sim.run([session("a", arrival_s=61, departure_s=7200)])
    assert run.steps[0]["time_s"] == "60"
    assert run.of_session("a")[0]["time_s"] == "120"
    assert queued(run)["a"] == 0


def test_a_stay_that_no_tick_sees_is_reported(sim):
    run = sim.run([session("short", arrival_s=61, departure_s=119), session("a")])
    assert places(run)["short"] == ""
    assert queued(run)["short"] == 58
    alone = sim.run([session("short", arrival_s=61, departure_s=119)], out="alone")
    assert alone.code == 0
    assert queued(alone)["short"] == 58


def test_many_sessions_on_one_connector_pass_the_wire_s_session_number(sim):
    """The number of a session has one byte and is never 0."""
    rows = [session(f"car-{number}", connector=1, arrival_s=number * 600, departure_s=number * 600 + 600,
                    soc_target=0.51) for number in range(300)]
    run = sim.run(rows)
    assert run.summary["satisfied"] == 300
