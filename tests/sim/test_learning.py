"""What the station is not told, or told wrong, and what it learns instead."""

import pytest
from conftest import csv_text, read_csv, session

# Cars that want more than the site has, some of them far into their taper; ticks of a minute.
CARS = [session(f"car-{k}", arrival_s=300 * k, departure_s=5 * 3600 + 600 * k, battery_kwh=40 + 5 * k, max_kw=11,
                taper_kw=8, soc_arrival=0.2 + 0.05 * k, soc_target=0.9) for k in range(8)]
LIMIT = ("--limit-kw", "35")
# One car with all it wants.
ALONE = [session("a", departure_s=8 * 3600, battery_kwh=60, max_kw=11, taper_kw=8, soc_arrival=0.2, soc_target=0.8)]
FILES = ("sessions.csv", "steps.csv", "connectors.csv")
COLUMNS = ["session_id", "share", "learned", "sure", "limit_kw", "true_kw", "limit_end_kw", "true_end_kw", "error"]
DROP = "time_s,limit_kw\n0,40\n3600,15\n"


def files_of(run):
    return [(run.out / name).read_bytes() for name in FILES]


def test_a_learned_taper_loses_next_to_nothing_against_a_known_one(planning_sim):
    known = planning_sim.run(CARS, *LIMIT, policy="soc-mpc", out="known").summary
    learned = planning_sim.run(CARS, *LIMIT, policy="soc-mpc-learned", out="learned").summary
    blind = planning_sim.run(CARS, *LIMIT, policy="mpc", out="blind").summary
    assert learned["delivered_kwh"] >= 0.99 * known["delivered_kwh"]
    assert learned["delivered_kwh"] > blind["delivered_kwh"]
    assert learned["limit_violations"] == 0
    assert learned["learns_taper"] is True
    assert "learns_taper" not in known


@pytest.mark.parametrize("words", [(), ("--taper-error", "1"), ("--soc", "absent"), ("--soc-error", "0.1")])
def test_after_a_tenth_of_a_charge_the_taper_is_known(sim, words):
    run = sim.run(ALONE, *words, "--learn-taper", "--tapers", "tapers.csv", policy="edf-soc")
    rows = read_csv(sim.folder / "tapers.csv")
    assert list(rows[0]) == COLUMNS
    assert [row["share"] for row in rows] == ["0.10", "0.25", "0.50"]
    assert all(row["learned"] == "1" and float(row["error"]) <= 0.05 for row in rows)
    assert run.summary["satisfied"] == 1


def test_a_car_that_never_limits_itself_teaches_nothing(sim):
    car = session("a", departure_s=8 * 3600, battery_kwh=80, max_kw=22, taper_kw=10, soc_arrival=0.1, soc_target=0.4)
    sim.run([car], "--limit-kw", "7", "--learn-taper", "--tapers", "tapers.csv", policy="edf")
    rows = read_csv(sim.folder / "tapers.csv")
    assert {row["learned"] for row in rows} == {"0"}


def test_a_learned_taper_makes_up_for_a_wrong_one(sim):
    words = ("--taper-error", "1", *LIMIT)
    misled = sim.run(CARS, *words, policy="edf-soc", out="misled").summary
    learned = sim.run(CARS, *words, "--learn-taper", policy="edf-soc", out="learned").summary
    assert learned["delivered_kwh"] > misled["delivered_kwh"]


def test_without_soc_the_station_plans_by_energy(sim):
    run = sim.run(CARS, *LIMIT, "--soc", "absent", policy="edf-soc")
    assert {row["expected_soc"] for row in run.connectors} == {""}
    assert run.summary["limit_violations"] == 0
    assert run.summary["errors"]["soc"] == "absent"


def test_a_wrong_soc_changes_what_a_car_gets_but_not_what_it_wants(sim):
    right = sim.run(ALONE, policy="edf-soc", out="right")
    wrong = sim.run(ALONE, "--soc-error", "0.1", policy="edf-soc", out="wrong")
    assert wrong.summary["requested_kwh"] == right.summary["requested_kwh"]
    told = [float(run.of_session("a")[5]["expected_soc"]) for run in (right, wrong)]
    assert 0.001 < abs(told[0] - told[1]) <= 0.102  # steps of the wire


def test_errors_follow_from_the_seed(sim):
    words = ("--meter-noise", "0.02", "--soc-error", "0.05", "--learn-taper", *LIMIT)
    once, again, other = (sim.run(CARS, *words, "--seed", seed, policy="edf-soc", out=out)
                          for seed, out in ((1, "once"), (1, "again"), (2, "other")))
    assert files_of(once) == files_of(again)
    assert files_of(once) != files_of(other)
    assert other.summary["limit_violations"] == 0


def test_errors_of_nothing_change_nothing(sim):
    plain = sim.run(CARS, *LIMIT, policy="edf-soc", out="plain")
    none = sim.run(CARS, *LIMIT, "--soc-error", "0", "--meter-noise", "0", "--taper-error", "0", "--soc", "exact",
                   policy="edf-soc", out="none")
    assert files_of(none) == files_of(plain)
    assert "errors" not in plain.summary
    assert none.summary["errors"] == dict(soc="exact", soc_error=0, taper_error=0, meter_noise=0,
                                          limit_unannounced=False)


def test_a_drop_that_nobody_announced_is_kept_to_but_not_planned_for(planning_sim):
    planning_sim.write("drop.csv", DROP)
    words = ("--limit-csv", "drop.csv")
    told = planning_sim.run(CARS, *words, policy="soc-mpc", out="told")
    sudden = planning_sim.run(CARS, *words, "--limit-unannounced", policy="soc-mpc", out="sudden")
    assert sudden.summary["limit_violations"] == 0
    assert [row["limit_kw"] for row in sudden.steps] == [row["limit_kw"] for row in told.steps]
    assert files_of(sudden) != files_of(told)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--soc", "maybe"), "--soc: neither absent nor exact: 'maybe'"),
        (("--soc-error", "0.2"), "--soc-error: above 0.1: '0.2'"),
        (("--meter-noise", "1"), "--meter-noise: above 0.1: '1'"),
        (("--taper-error", "2"), "--taper-error: above 1: '2'"),
        (("--soc", "absent", "--soc-error", "0.1"), "--soc absent and --soc-error exclude each other"),
        (("--limit-unannounced",), "--limit-unannounced needs --limit-csv"),
        (("--bus", "slcan:127.0.0.1:1", "--learn-taper"), "--learn-taper and --tapers"),
    ],
)
def test_options_that_make_no_sense_are_refused(sim, words, message):
    sim.write("sessions.csv", csv_text(CARS))
    run = sim.call("--sessions", "sessions.csv", "--policy", "edf", "--station", "hub", *words)
    assert run.code == 2
    assert message in run.stderr


def test_a_tapers_file_that_cannot_be_written_is_an_error(sim):
    run = sim.run(ALONE, "--tapers", "no/such/folder.csv")
    assert run.code == 1
    assert run.stderr == "no/such/folder.csv: No such file or directory\n"
