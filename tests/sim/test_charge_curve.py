"""A vehicle with a charging curve obeys the curve, and tells its lines."""

import pytest
from conftest import csv_text, session

UNLIMITED = ("--tick-s", "60", "--min-current-a", "0")
CURVE = ((0.0, 10.0), (0.4, 14.0), (0.6, 6.0), (1.0, 1.0))
TEXT = "0:10 0.4:14  0.6:6 1:1"
CAR = dict(battery_kwh=20, soc_arrival=0.1, soc_target=0.9, max_kw=22, taper_kw=0)


def curve_kw(soc):
    for (from_soc, from_kw), (to_soc, to_kw) in zip(CURVE, CURVE[1:], strict=False):
        if soc <= to_soc:
            return from_kw + (soc - from_soc) / (to_soc - from_soc) * (to_kw - from_kw)
    raise AssertionError(soc)


def powers(run):
    """SOC at the start of each tick, and mean power [kW], until the tick in which the target is reached."""
    rows = [(float(row["soc"]), float(row["current_a"]) * 0.69) for row in run.of_session("a")]
    return [pair for pair in rows if pair[0] < 0.89]


def test_a_vehicle_obeys_its_curve(sim):
    run = sim.run([session("a", **CAR, curve=TEXT)], *UNLIMITED)
    assert run.code == 0
    assert len(powers(run)) > 90
    for soc, power_kw in powers(run):
        assert power_kw == pytest.approx(curve_kw(soc), abs=0.01)


def test_outside_of_its_points_a_curve_stays_as_there(sim):
    run = sim.run([session("a", **CAR, curve="0.3:5 0.5:8")], *UNLIMITED)
    seen = powers(run)
    assert seen[0][1] == pytest.approx(5, abs=0.01)
    assert seen[-1][1] == pytest.approx(8, abs=0.01)


def test_the_greatest_power_of_the_curve_is_the_flat_limit_that_is_told(sim):
    """The line that is told reaches 40 kW at SOC 0; the connector could give 22."""
    run = sim.run([session("a", **CAR | {"max_kw": 40, "taper_kw": 38}, curve=TEXT)], *UNLIMITED, policy="edf-soc")
    offered_kw = [float(row["setpoint_a"]) * 0.69 for row in run.of_session("a")]
    assert max(offered_kw) == pytest.approx(14, abs=0.07)


def test_a_line_told_too_low_holds_the_vehicle_back_and_one_too_high_does_not(sim):
    def energy_kwh(max_kw, policy):
        car = CAR | {"max_kw": max_kw, "departure_s": 3600}
        run = sim.run([session("a", **car, curve=TEXT)], *UNLIMITED, policy=policy, out=f"{policy}-{max_kw}")
        return float(run.sessions["a"]["energy_kwh"])

    blind_kwh = energy_kwh(22, "edf")
    assert energy_kwh(22, "edf-soc") == pytest.approx(blind_kwh, abs=0.02)
    assert energy_kwh(5, "edf-soc") == pytest.approx(5, abs=0.05)
    assert blind_kwh > 8


def test_without_a_curve_a_vehicle_takes_the_least_of_its_lines(sim):
    """12 kW, and 18 - 16 SOC: they cross at SOC 0.375."""
    run = sim.run([session("a", **CAR | {"max_kw": 12}, second_max_kw=18, second_taper_kw=16)], *UNLIMITED)
    assert run.code == 0
    for soc, power_kw in powers(run):
        assert power_kw == pytest.approx(min(12, 18 - 16 * soc), abs=0.01)


@pytest.mark.parametrize("policy", ["edf-soc", "llf"])
def test_a_second_line_reaches_the_station_where_tapers_are_told(sim, policy):
    """9 - 8 SOC is below the first line from SOC 0 on; the curve would allow more."""
    car = session("a", **CAR, second_max_kw=9, second_taper_kw=8, curve="0:20 1:20")
    told = sim.run([car], *UNLIMITED, policy=policy, out="told")
    assert len(powers(told)) > 60
    for soc, power_kw in powers(told):
        assert power_kw == pytest.approx(9 - 8 * soc, abs=0.15)  # of 0.1 A and half a percent of SOC
    blind = sim.run([car], *UNLIMITED, policy="edf", out="blind")
    assert powers(blind)[0][1] == pytest.approx(20, abs=0.01)


@pytest.mark.parametrize("curve, reason", [
    ("0:5", "fewer than two points"),
    ("0:5 0:6", "point 2: SOC does not ascend"),
    ("0:5 half:6", "point 2: not SOC:KW"),
    ("0:5 1", "point 2: not SOC:KW"),
    ("0:5 0.5:3 1.1:4", "point 3: SOC is outside 0..1"),
    ("-0.1:5 1:4", "point 1: SOC is outside 0..1"),
    ("0:5 1:0", "point 2: power must be above 0"),
    ("0:700 1:4", "point 1: power is above what the bus carries"),
    ("0:5 1:nan", "point 2: not SOC:KW"),
    (" ".join(f"{k / 100}:5" for k in range(33)), "point 33: more points than a curve can have"),
])
def test_a_bad_curve_is_refused(sim, curve, reason):
    run = sim.run([session("a"), session("b", curve=curve)])
    assert run.code == 1
    assert run.stderr == f"sessions.csv:3: curve: {reason}\n"


@pytest.mark.parametrize("columns, message", [
    ({"second_max_kw": 5}, "second_max_kw: given without second_taper_kw"),
    ({"second_taper_kw": 5}, "second_taper_kw: given without second_max_kw"),
    ({"second_max_kw": 0, "second_taper_kw": 0}, "second_max_kw: must be above 0"),
    ({"second_max_kw": 5, "second_taper_kw": 6}, "second_taper_kw: above second_max_kw"),
    ({"second_max_kw": 5, "second_taper_kw": -1}, "second_taper_kw: below 0"),
    ({"second_max_kw": 700, "second_taper_kw": 0}, "second_max_kw: must not be above 655.34, the most that the bus carries"),
])
def test_a_bad_second_line_is_refused(sim, columns, message):
    run = sim.run([session("a", **columns)])
    assert run.code == 1
    assert run.stderr == f"sessions.csv:2: {message}\n"


def test_empty_fields_of_the_optional_columns_are_as_if_they_were_not_there(sim):
    columns = {"curve": "", "second_max_kw": "", "second_taper_kw": ""}
    run = sim.run([session("a", **columns)])
    plain = sim.run(csv_text([session("a")]), out="plain")
    assert run.sessions == plain.sessions
    assert run.code == plain.code == 0
