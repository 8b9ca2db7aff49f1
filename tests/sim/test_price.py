"""The price of energy: how its file is read, what the energy cost, and how it reaches the plan."""

import pytest
from conftest import session

# Four cars with twice the time that they need; the second half is cheap.
FLEET = [session(f"car-{number}", battery_kwh=40, soc_arrival=0.2, soc_target=0.7, max_kw=11, taper_kw=0)
         for number in range(4)]
CHEAP_LATER = "time_s,price_per_kwh\n0,0.40\n7200,0.10\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "price.csv:1: header: missing: the file is empty"),
        ("time_s,price_per_kwh\n", "price.csv:1: time_s: no rows, at least one is needed"),
        ("time_s,price\n0,5\n", "price.csv:1: price_per_kwh: column missing"),
        ("time_s,price_per_kwh\n0,0.2\n0,0.3\n", "price.csv:3: time_s: not after the time of the row before"),
        ("time_s,price_per_kwh\n0,cheap\n", "price.csv:2: price_per_kwh: not a number: 'cheap'"),
        ("time_s,price_per_kwh\n0,33\n", "price.csv:2: price_per_kwh: above 32.767"),
        ("time_s,price_per_kwh\n0,-33\n", "price.csv:2: price_per_kwh: below -32.767"),
    ],
)
def test_a_bad_price_file_is_refused(sim, text, message):
    sim.write("price.csv", text)
    run = sim.run(FLEET, "--price-csv", "price.csv")
    assert run.code == 1
    assert run.stderr.startswith(message)
    assert run.stderr.count("\n") == 1
    assert sim.files() == ["price.csv", "sessions.csv"]


@pytest.mark.parametrize(("value", "reason"), [("-0.1", "--price-weight: below 0"), ("1.1", "--price-weight: above 1"),
                                               ("much", "--price-weight: not a number")])
def test_a_weight_is_a_share(sim, value, reason):
    run = sim.run(FLEET, "--price-weight", value)
    assert run.code == 2
    assert reason in run.stderr


def test_energy_without_a_price_costs_nothing_that_is_known(sim):
    summary = sim.run(FLEET).summary
    assert (summary["energy_cost"], summary["cost_per_kwh"], summary["price_weight"]) == (None, None, None)


def test_energy_costs_what_its_time_costs(sim):
    """7 kW for four hours, 0.40 for the first and 0.10 after it, with a change in the middle of a tick."""
    sim.write("price.csv", "time_s,price_per_kwh\n0,0.40\n3630,0.10\n")
    car = session("a", battery_kwh=80, soc_arrival=0.1, soc_target=0.9, taper_kw=0)
    run = sim.run([car], "--price-csv", "price.csv", "--min-current-a", "0")
    assert run.code == 0
    expected = 7 * (3630 * 0.40 + (4 * 3600 - 3630) * 0.10) / 3600
    assert run.summary["energy_cost"] == pytest.approx(expected, rel=5e-3)
    assert run.summary["cost_per_kwh"] == pytest.approx(run.summary["energy_cost"] / run.summary["delivered_kwh"], abs=1e-5)
    assert "the energy cost" in run.stdout


def test_a_negative_price_earns(sim):
    sim.write("price.csv", "time_s,price_per_kwh\n0,-0.05\n")
    run = sim.run(FLEET, "--price-csv", "price.csv")
    assert run.summary["energy_cost"] == pytest.approx(-0.05 * run.summary["delivered_kwh"], rel=1e-6)


def test_a_price_without_weight_changes_no_current(planning_sim):
    planning_sim.write("price.csv", CHEAP_LATER)
    priced = planning_sim.run(FLEET, "--price-csv", "price.csv", "--price-weight", "0", policy="soc-mpc", out="priced")
    plain = planning_sim.run(FLEET, policy="soc-mpc", out="plain")
    assert priced.code == plain.code == 0
    assert priced.connectors == plain.connectors


def test_a_plan_that_minds_the_price_waits_for_cheap_hours(planning_sim):
    planning_sim.write("price.csv", CHEAP_LATER)
    early = planning_sim.run(FLEET, "--price-csv", "price.csv", "--price-weight", "0", policy="soc-mpc", out="early")
    cheap = planning_sim.run(FLEET, "--price-csv", "price.csv", "--price-weight", "1", policy="soc-mpc", out="cheap")
    assert cheap.code == 0
    assert cheap.summary["price_weight"] == 1
    assert cheap.summary["satisfied"] == early.summary["satisfied"] == 4
    assert cheap.summary["cost_per_kwh"] < 0.5 * early.summary["cost_per_kwh"]
    assert "planned_later" in {row["reason"] for row in cheap.connectors}


def test_a_price_curve_longer_than_the_station_keeps_is_followed_to_its_end(planning_sim):
    """A price that changes each minute: far more points than one transfer holds, so it goes out in pieces."""
    points = "".join(f"{minute * 60},{0.2 + 0.001 * (minute % 2):.3f}\n" for minute in range(600))
    planning_sim.write("price.csv", "time_s,price_per_kwh\n" + points)
    long_stay = [car | {"departure_s": 8 * 3600} for car in FLEET]
    run = planning_sim.run(long_stay, "--price-csv", "price.csv", "--price-weight", "0.5", policy="soc-mpc")
    assert run.code == 0, run.stderr
    assert run.summary["satisfied"] == 4
