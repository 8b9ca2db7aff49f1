"""tools/bound.py: the clairvoyant bound against cases that can be worked out by hand."""

import bound as bound_tool
import numpy as np
import pytest
from taperlib.clairvoyant import clairvoyant_bound
from taperlib.feeders import feeder_rows
from taperlib.files import InputError
from taperlib.limits import Limit, constant_limit, read_limit_csv
from taperlib.sessions import Session, read_sessions_csv, write_sessions_csv

HOUR_S = 3600
PLENTY = constant_limit(1000.0)
FUSED = """
name = "fused"
description = "Four three-phase sockets below one fuse"
[horizon]
steps = 4
step_s = 900
[control]
tick_ms = 1000
min_on_s = 0
min_off_s = 0
[site]
failsafe_kW = 5.0
[[groups]]
name = "site"
limit_kW = 100.0
limit_A = 40.0
[[connectors]]
count = 4
group = "site"
kind = "AC"
phases = 3
voltage_V = 230
min_A = 6.0
max_A = 32.0
"""


def car(arrival_h=0.0, departure_h=1.0, battery_kwh=20.0, soc=0.0, target=1.0, max_kw=8.0, taper_kw=0.0, name="car",
        **optional):
    return Session(name, arrival_h * HOUR_S, departure_h * HOUR_S, battery_kwh, soc, target, max_kw, taper_kw, **optional)


def energy_by_recursion(session, tick_s):
    """What a car takes that always gets all that its taper allows, held for a tick."""
    soc, target_kwh = session.soc_arrival, session.requested_kwh
    energy_kwh = 0.0
    for _ in range(int((session.departure_s - session.arrival_s) / tick_s)):
        power_kw = max(session.max_kw - session.taper_kw * soc, 0.0)
        step_kwh = min(power_kw * tick_s / HOUR_S, target_kwh - energy_kwh)
        energy_kwh += step_kwh
        soc += step_kwh / session.battery_kwh
    return energy_kwh


def bound_kwh(sessions, limit=PLENTY, **options):
    return clairvoyant_bound(sessions, limit, **options).energy_kwh


def test_a_car_without_taper_takes_its_power_times_its_stay():
    assert bound_kwh([car()]) == pytest.approx(8.0)


def test_a_car_never_gets_more_than_it_asked_for():
    assert bound_kwh([car(soc=0.5, target=0.6)]) == pytest.approx(2.0)


def test_a_tapered_car_takes_what_the_recursion_over_its_steps_gives():
    session = car(departure_h=3, soc=0.2, taper_kw=6.0)
    assert bound_kwh([session]) == pytest.approx(energy_by_recursion(session, 900))


def test_two_steps_of_a_tapered_car_by_hand():
    # Step 1: 8 kW * 0.25 h = 2 kWh, SOC 0.1. Step 2: (8 - 0.1 * 4) kW * 0.25 h = 1.9 kWh.
    assert bound_kwh([car(departure_h=0.5, taper_kw=4.0)]) == pytest.approx(3.9)


def test_a_shorter_tick_follows_the_taper_within_the_step():
    session = car(departure_h=2, taper_kw=6.0)
    by_minute = energy_by_recursion(session, 60)
    assert bound_kwh([session], tick_s=60) == pytest.approx(by_minute)
    assert by_minute < bound_kwh([session]) - 0.05


def test_the_limit_is_shared():
    cars = [car(name="a"), car(name="b")]
    assert bound_kwh(cars, constant_limit(10.0)) == pytest.approx(10.0)


def test_the_bound_serves_first_who_leaves_first():
    leaves_soon = car(departure_h=1, battery_kwh=10.0, name="soon")
    stays = car(departure_h=2, battery_kwh=10.0, name="late")
    assert bound_kwh([stays, leaves_soon], constant_limit(8.0)) == pytest.approx(16.0)


def test_steps_in_which_the_car_is_not_there_do_not_count():
    sessions = [car(arrival_h=1, departure_h=2), car(arrival_h=4, departure_h=4.5, name="b")]
    assert bound_kwh(sessions) == pytest.approx(12.0)


def test_a_part_of_a_step_counts_by_its_length():
    assert bound_kwh([car(arrival_h=0.1, departure_h=0.4)]) == pytest.approx(8.0 * 0.3)


def test_a_limit_that_drops_is_kept_in_every_step():
    drop = Limit(np.array([0.0, 1800.0]), np.array([8.0, 2.0]))
    assert bound_kwh([car(departure_h=1)], drop) == pytest.approx(8.0 * 0.5 + 2.0 * 0.5)


def test_a_night_without_cars_does_not_shift_the_limit():
    drop = Limit(np.array([0.0, 5.0 * HOUR_S]), np.array([8.0, 2.0]))
    sessions = [car(arrival_h=2, departure_h=3), car(arrival_h=6, departure_h=7, name="b")]
    assert bound_kwh(sessions, drop) == pytest.approx(8.0 + 2.0)


def test_a_limit_that_changes_within_a_step_counts_by_its_mean():
    change = Limit(np.array([0.0, 300.0]), np.array([6.0, 3.0]))
    assert bound_kwh([car(departure_h=0.25)], change) == pytest.approx((6.0 * 300 + 3.0 * 600) / 3600)


def test_the_first_limit_also_holds_before_its_time(tmp_path):
    path = tmp_path / "limit.csv"
    path.write_text("time_s,limit_kw\n1800,4\n7200,1\n")
    limit = read_limit_csv(path)
    assert limit.at(np.array([0.0, 1800.0, 7199.0, 7200.0])).tolist() == [4.0, 4.0, 4.0, 1.0]
    assert limit.mean_kw(np.array([0.0, 900.0, 10800.0])).tolist() == pytest.approx([4.0, (6300 * 4 + 3600) / 9900])


# ---- The feeder tree: caltech has pods of 80 A on connectors 1-8 and 9-16, all between L1 and L2 at 208 V

def at_caltech(count, first=1, named=True, max_kw=6.656):
    return [car(name=f"car-{number}", max_kw=max_kw, connector=str(number) if named else "")
            for number in range(first, first + count)]


def feeder_bound_kwh(sessions, station="caltech"):
    return bound_kwh(sessions, feeders=feeder_rows(station, sessions))


def test_a_feeder_bounds_the_sessions_that_name_its_connectors():
    eight = at_caltech(8)  # 32 A each, of which the pod has 80
    assert bound_kwh(eight) == pytest.approx(8 * 6.656)
    assert feeder_bound_kwh(eight) == pytest.approx(80 * 0.208)


def test_two_feeders_bound_their_own_sessions_only():
    assert feeder_bound_kwh(at_caltech(16)) == pytest.approx(2 * 80 * 0.208)
    assert feeder_bound_kwh(at_caltech(18)) == pytest.approx(2 * 80 * 0.208 + 2 * 6.656)


def test_a_session_without_a_connector_is_not_bound_by_feeders():
    assert feeder_bound_kwh(at_caltech(8, named=False)) == pytest.approx(8 * 6.656)


def test_the_station_s_own_limit_bounds_sessions_without_a_connector_too():
    assert feeder_bound_kwh(at_caltech(40, named=False)) == pytest.approx(150.0)


def test_a_one_phase_car_loads_its_own_phase_only(tmp_path, monkeypatch):
    """Four three-phase sockets below a fuse of 40 A: one-phase cars draw from the first phase, and all of them from it."""
    folder = tmp_path / "codegen" / "stations"
    folder.mkdir(parents=True)
    (folder / "fused.toml").write_text(FUSED)
    monkeypatch.setattr("taperlib.feeders.station_file", lambda name: folder / f"{name}.toml")
    one = [car(name=f"{number}", max_kw=7.36, connector=str(number), phases=1) for number in (1, 2)]
    three = [car(name=f"{number}", max_kw=22.08, battery_kwh=60.0, connector=str(number)) for number in (3, 4)]
    assert feeder_bound_kwh(one, "fused") == pytest.approx(40 * 0.23)
    assert feeder_bound_kwh(three, "fused") == pytest.approx(40 * 0.69)
    assert feeder_bound_kwh(one + three, "fused") == pytest.approx(40 * 0.69)


def test_a_connector_that_the_station_lacks_is_an_error():
    with pytest.raises(InputError, match="station caltech has no connector 55"):
        feeder_rows("caltech", at_caltech(1, first=55))


def test_a_station_that_is_not_there_is_an_error():
    with pytest.raises(InputError, match="station nowhere"):
        feeder_rows("nowhere", at_caltech(1))


def test_a_step_too_long_for_the_taper_is_refused():
    with pytest.raises(InputError, match="too long for the steepest taper"):
        clairvoyant_bound([car(battery_kwh=1.0, taper_kw=8.0)], PLENTY, step_s=3600)


def test_sessions_survive_writing_and_reading_in_any_column_order(tmp_path):
    path = tmp_path / "sessions.csv"
    session = Session("x, y", 0.5, 900, 64, 0.123456, 0.9, 7.2, 4.32, connector="3", expected_departure_s=600)
    write_sessions_csv(path, [session])
    assert read_sessions_csv(path) == [session]
    path.write_text("taper_kw,max_kw,soc_target,soc_arrival,battery_kwh,departure_s,arrival_s,connector,session_id\n"
                    "4.32,7.2,0.9,0.123456,64,900,0.5,3,z\n")
    assert read_sessions_csv(path) == [Session("z", 0.5, 900, 64, 0.123456, 0.9, 7.2, 4.32, connector="3")]


def test_phases_survive_writing_and_reading(tmp_path):
    path = tmp_path / "sessions.csv"
    sessions = [car(name="a", phases=1), car(name="b")]
    write_sessions_csv(path, sessions)
    assert read_sessions_csv(path) == sessions
    path.write_text(path.read_text().replace(",1\n", ",2\n"))
    with pytest.raises(InputError, match="column phases: 2 is neither 1 nor 3"):
        read_sessions_csv(path)


@pytest.mark.parametrize("column, value, reason", [
    ("soc_target", "0.1", "0.1 is not between soc_arrival and 1"),
    ("soc_arrival", "1.5", "1.5 is not between 0 and 1"),
    ("departure_s", "0", "0 is not after arrival_s"),
    ("battery_kwh", "-3", "-3 is not greater than 0"),
    ("max_kw", "much", "'much' is not a number"),
    ("taper_kw", "", "is empty"),
    ("taper_kw", "7.3", "7.3 is not between 0 and max_kw"),
])
def test_a_bad_value_in_a_sessions_file_is_named(tmp_path, capsys, column, value, reason):
    good = {"session_id": "a", "connector": "", "arrival_s": "0", "departure_s": "900", "battery_kwh": "50",
            "soc_arrival": "0.2", "soc_target": "0.8", "max_kw": "7.2", "taper_kw": "4"}
    path = tmp_path / "bad.csv"
    path.write_text(",".join(good) + "\n" + ",".join((good | {column: value}).values()) + "\n")
    assert bound_tool.main(["--sessions", str(path), "--limit-kw", "10"]) == 1
    message = capsys.readouterr().err
    assert f"bad.csv, line 2, column {column}: {reason}" in message


def test_the_tool_prints_the_bound_and_where_a_shared_limit_comes_from(tmp_path, capsys):
    path = tmp_path / "two.csv"
    write_sessions_csv(path, [car(name="a"), car(name="b")])
    assert bound_tool.main(["--sessions", str(path), "--limit-share", "0.5"]) == 0
    output = capsys.readouterr().out
    assert "7.2 kW = 0.5 x 2 cars at once x 7.2 kW" in output
    assert "bound        7.20 kWh" in output


@pytest.mark.parametrize("text, place", [("time_s,limit_kw\n0,5\n0,6\n", "line 3, column time_s"),
                                         ("time_s,limit_kw\n0,-5\n", "line 2, column limit_kw"),
                                         ("time,limit_kw\n0,5\n", "line 1: the header lacks time_s"),
                                         ("time_s,limit_kw\n", "holds no limits")])
def test_a_bad_limit_file_is_named(tmp_path, text, place):
    path = tmp_path / "limit.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=place):
        read_limit_csv(path)
