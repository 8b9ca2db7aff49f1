"""tools/curves.py: lines fitted to real charging curves, and days of fast charging."""

import csv

import curves as curves_tool
import numpy as np
import pytest
from taperlib.charge_curve import MOST_KW, capped, most_kw, power_kw
from taperlib.curves import FITS, STAY_MIN, VEHICLES_CSV, dc_day, fit_error, fit_lines, read_vehicles, told_kw, told_lines
from taperlib.files import InputError
from taperlib.sessions import peak_present, read_sessions_csv

SOC = np.linspace(0, 1, 201)
VEHICLES = read_vehicles()
TRAPEZIUM = ((0.0, 100.0), (0.4, 100.0), (1.0, 10.0))
THREE_PIECES = ((0.0, 120.0), (0.3, 120.0), (0.7, 80.0), (1.0, 8.0))


def test_all_vehicles_are_read():
    assert len(VEHICLES) == 113
    first = VEHICLES[0]
    assert (first.name, first.battery_kwh) == ("Aiways U5 2021", 63.0)
    assert first.curve == ((0.0, 95.0), (0.18, 90.0), (0.4, 90.0), (0.8, 50.0), (1.0, 6.6))


@pytest.mark.parametrize("fit", FITS)
def test_a_curve_of_two_pieces_is_found_again(fit):
    assert fit_lines(TRAPEZIUM, 1, fit) == (pytest.approx((160.0, 150.0), abs=0.01),)


@pytest.mark.parametrize("fit", FITS)
def test_a_curve_of_three_pieces_is_found_again(fit):
    assert fit_lines(THREE_PIECES, 2, fit) == (
        pytest.approx((150.0, 100.0), abs=0.01), pytest.approx((248.0, 240.0), abs=0.01))
    assert fit_error(THREE_PIECES, fit_lines(THREE_PIECES, 2, fit)).worst_share < 1e-4


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("count", [1, 2])
def test_every_line_can_be_told(fit, count):
    for vehicle in VEHICLES:
        lines = fit_lines(vehicle.curve, count, fit)
        assert 1 <= len(lines) <= count
        assert all(0 <= fall <= at_0 <= MOST_KW for at_0, fall in lines), vehicle.name


@pytest.mark.parametrize("count", [1, 2])
def test_what_is_told_from_above_is_nowhere_below_the_curve(count):
    for vehicle in VEHICLES:
        gap = told_kw(vehicle.curve, fit_lines(vehicle.curve, count, "above"), SOC) - power_kw(vehicle.curve, SOC)
        assert gap.min() > -0.01, vehicle.name


@pytest.mark.parametrize("fit", FITS)
def test_another_line_never_fits_worse(fit):
    for vehicle in VEHICLES:
        rms = [fit_error(vehicle.curve, fit_lines(vehicle.curve, count, fit)).rms_share for count in (0, 1, 2)]
        assert rms[0] + 1e-6 >= rms[1] and rms[1] + 1e-6 >= rms[2], vehicle.name


def test_least_squares_are_as_good_as_a_search_over_lines():
    """Against every line of a grid of 1 kW and 1 kW."""
    curve = VEHICLES[0].curve
    at_0, fall = np.meshgrid(np.arange(90.0, 300.0), np.arange(0.0, 300.0))
    usable = fall <= at_0
    told = np.minimum(most_kw(curve), at_0[usable][:, None] - fall[usable][:, None] * SOC)
    searched = np.sqrt(((told - power_kw(curve, SOC)) ** 2).mean(axis=1)).min() / most_kw(curve)
    assert fit_error(curve, fit_lines(curve, 1, "mean")).rms_share <= 1.01 * searched


def test_pieces_say_how_many_lines_are_told():
    assert told_lines(THREE_PIECES, 1) == {"max_kw": 120.0, "taper_kw": 0.0}
    assert set(told_lines(THREE_PIECES, 2)) == {"max_kw", "taper_kw"}
    assert set(told_lines(THREE_PIECES, 3)) == {"max_kw", "taper_kw", "second_max_kw", "second_taper_kw"}


def test_a_capped_curve_is_the_least_of_curve_and_cap():
    for vehicle in VEHICLES:
        assert power_kw(capped(vehicle.curve, 60.0), SOC) == pytest.approx(
            np.minimum(power_kw(vehicle.curve, SOC), 60.0), abs=0.01), vehicle.name


def test_a_day_is_drawn_by_its_seed_whatever_is_told():
    one, three = dc_day(7, pieces=1), dc_day(7, pieces=3)
    assert one == dc_day(7, pieces=1)
    assert [(car.arrival_s, car.departure_s, car.curve) for car in one] == [
        (car.arrival_s, car.departure_s, car.curve) for car in three]
    assert one != dc_day(8, pieces=1)
    assert all(car.second_max_kw is None and car.taper_kw == 0 for car in one)


def test_a_day_is_as_its_text_says():
    day = dc_day(3, cars=400)
    assert peak_present(day) == 12
    assert 200 < len(day) < 400
    assert all(STAY_MIN[0] <= (car.departure_s - car.arrival_s) / 60 <= STAY_MIN[1] for car in day)
    assert all(0.1 <= car.soc_arrival <= 0.6 and 0.8 <= car.soc_target <= 1.0 for car in day)
    assert all(most_kw(car.curve) <= 150 for car in day)
    assert len({car.curve for car in day}) > 40


def test_the_tool_writes_a_day(tmp_path, capsys):
    path = tmp_path / "day.csv"
    assert curves_tool.main(["day", "--out", str(path), "--seed", "5", "--pieces", "3"]) == 0
    assert read_sessions_csv(path) == dc_day(5, 3)
    assert f"{path}: {len(dc_day(5))} sessions" in capsys.readouterr().out


def test_the_tool_writes_the_errors_of_all_fits(tmp_path, capsys):
    path = tmp_path / "fits.csv"
    assert curves_tool.main(["fits", "--out", str(path)]) == 0
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 113 * 2 * 3
    above = [row for row in rows if row["fit"] == "above"]
    assert {row["below_percent"] for row in above} == {"0.00"}
    assert all(float(row["rms_percent"]) <= float(row["worst_percent"]) for row in rows)
    assert "113 vehicles" in capsys.readouterr().out


@pytest.mark.parametrize(("line", "place"), [
    ("x,Maker,Car,,2021,50,7,50,0,much", "line 3, column power_kw: 'much' is not a number"),
    ("x,Maker,Car,,2021,50,7,50,0,50", "vehicle id .Maker Car 2021.: has 1 points"),
    ("id,Maker,Car,,2021,50,7,50,0,50", "vehicle id .Maker Car 2021., point 2: SOC 0 does not ascend"),
])
def test_a_bad_row_of_curves_is_named(tmp_path, line, place):
    path = tmp_path / "curves.csv"
    head = VEHICLES_CSV.read_text(encoding="utf-8").splitlines()[0]
    path.write_text(f"{head}\nid,Maker,Car,,2021,50,7,50,0,40\n{line}\n")
    with pytest.raises(InputError, match=place):
        read_vehicles(path)
