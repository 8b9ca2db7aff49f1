"""taperlib/charge_curve.py, and the bound of sessions that have a curve or two lines."""

import numpy as np
import pytest
from taperlib.charge_curve import hull_lines, hull_points, parse_curve, power_kw
from taperlib.clairvoyant import clairvoyant_bound
from taperlib.files import InputError
from taperlib.limits import constant_limit
from taperlib.sessions import Session, read_sessions_csv, write_sessions_csv

PLENTY = constant_limit(1000.0)
DENT = ((0.0, 40.0), (0.2, 50.0), (0.4, 30.0), (0.6, 32.0), (1.0, 2.0))


def car(stay_h=1.0, soc=0.0, target=1.0, max_kw=50.0, taper_kw=0.0, battery_kwh=20.0, **optional):
    return Session("car", 0.0, stay_h * 3600, battery_kwh, soc, target, max_kw, taper_kw, **optional)


def bound_kwh(session, **options):
    return clairvoyant_bound([session], PLENTY, **options).energy_kwh


def energy_by_recursion(session, kw_at, tick_s):
    soc, energy_kwh = session.soc_arrival, 0.0
    for _ in range(int(session.departure_s / tick_s)):
        step_kwh = min(kw_at(soc) * tick_s / 3600, session.requested_kwh - energy_kwh)
        energy_kwh += step_kwh
        soc += step_kwh / session.battery_kwh
    return energy_kwh


def test_the_hull_leaves_out_dents_and_keeps_corners():
    assert hull_points(DENT) == [(0.0, 40.0), (0.2, 50.0), (0.6, 32.0), (1.0, 2.0)]


def test_the_lines_of_the_hull_are_nowhere_below_the_curve_and_touch_it():
    lines = hull_lines(DENT)
    soc = np.linspace(0, 1, 1001)
    least = np.min([at_0 - fall * soc for at_0, fall in lines], axis=0)
    gap = least - power_kw(DENT, soc)
    assert gap.min() > -1e-9
    assert [(round(at_0, 9), round(fall, 9)) for at_0, fall in lines] == [(40, -50), (59, 45), (77, 75)]
    assert gap[[0, 200, 600, 1000]] == pytest.approx(0, abs=1e-9)


def test_a_curve_that_covers_a_part_is_constant_outside():
    curve = ((0.2, 30.0), (0.8, 10.0))
    assert power_kw(curve, np.array([0.0, 0.5, 1.0])).tolist() == [30, 20, 10]
    assert hull_points(curve) == [(0.0, 30.0), (0.2, 30.0), (1.0, 10.0)]


def test_two_lines_by_hand():
    """20 kW, and 36 - 36 SOC. Quarters of an hour: 20 kW at SOC 0 and 0.25 (27 kW), then 18 kW at SOC 0.5."""
    session = car(stay_h=0.75, max_kw=20, second_max_kw=36, second_taper_kw=36)
    assert bound_kwh(session) == pytest.approx(5 + 5 + 4.5)


def test_a_concave_curve_alone_is_followed_within_its_corners():
    """Against what the vehicle takes that gets all it wants: never below, and hardly above."""
    curve = ((0.0, 50.0), (0.3, 50.0), (1.0, 8.0))
    session = car(stay_h=0.5, soc=0.1, curve=curve)
    taken_kwh = energy_by_recursion(session, lambda soc: float(power_kw(curve, soc)), 60)
    bound = bound_kwh(session, step_s=300, tick_s=60)
    assert taken_kwh - 1e-9 <= bound <= 1.01 * taken_kwh


@pytest.mark.parametrize("tick_s", [60, 300])
def test_the_bound_is_above_what_a_vehicle_with_a_rising_and_dented_curve_takes(tick_s):
    session = car(stay_h=0.5, curve=DENT)
    taken_kwh = energy_by_recursion(session, lambda soc: float(power_kw(DENT, soc)), tick_s)
    assert bound_kwh(session, step_s=300, tick_s=tick_s) >= taken_kwh - 1e-9


def test_the_lines_that_are_told_do_not_bound_a_vehicle_with_a_curve():
    curve = ((0.0, 30.0), (1.0, 30.0))
    low = car(stay_h=0.25, max_kw=5, curve=curve)
    assert bound_kwh(low) == pytest.approx(7.5)


def test_a_session_with_one_line_has_the_rows_that_it_had():
    one = clairvoyant_bound([car(taper_kw=40)], PLENTY)
    assert (one.variables, one.constraints) == (8, 12)


def test_curve_and_second_line_survive_writing_and_reading(tmp_path):
    path = tmp_path / "sessions.csv"
    sessions = [Session("a", 0, 900, 64, 0.1, 0.9, 72.5, 4.3, second_max_kw=90.25, second_taper_kw=80.0, curve=DENT),
                Session("b", 0, 900, 64, 0.1, 0.9, 7.2, 4.32)]
    write_sessions_csv(path, sessions)
    assert read_sessions_csv(path) == sessions


@pytest.mark.parametrize("text, reason", [
    ("0:5", "has 1 points, not 2 to 32"),
    ("0:5 0:6", "point 2: SOC 0 does not ascend"),
    ("0:5 1", "point 2: '1' is not soc:kw"),
    ("0:5 half:6", "point 2: 'half' is not a number"),
    ("0:5 1.5:6", "point 2: SOC 1.5 is not between 0 and 1"),
    ("0:5 1:0", "point 2: 0 kW is not above 0 and at most 655.34"),
    ("0:5 1:inf", "point 2: 'inf' is not a finite number"),
])
def test_a_bad_curve_is_named(text, reason):
    with pytest.raises(InputError) as error:
        parse_curve(text, "cars.csv, line 7, column curve")
    assert str(error.value).startswith("cars.csv, line 7, column curve")
    assert str(error.value).endswith(reason)


@pytest.mark.parametrize("second, reason", [
    ("5,", "column second_max_kw: 5 is given without second_taper_kw"),
    (",5", "column second_taper_kw: 5 is given without second_max_kw"),
    ("5,6", "column second_taper_kw: 6 is not between 0 and second_max_kw"),
    ("0,0", "column second_max_kw: 0 is not greater than 0"),
])
def test_a_bad_second_line_is_named(tmp_path, second, reason):
    path = tmp_path / "bad.csv"
    path.write_text("session_id,connector,arrival_s,departure_s,battery_kwh,soc_arrival,soc_target,max_kw,taper_kw,"
                    f"second_max_kw,second_taper_kw\na,,0,900,50,0.2,0.8,7.2,4,{second}\n")
    with pytest.raises(InputError, match=f"bad.csv, line 2, {reason}"):
        read_sessions_csv(path)
