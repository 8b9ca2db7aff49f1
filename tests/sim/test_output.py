"""The files of a run: their form, that they appear whole or not at all, and that a repeat is equal to the bit."""

import csv
import json
import re

import pytest
from conftest import session

SUMMARY = ["policy", "station", "sessions", "requested_kwh", "delivered_kwh", "satisfied", "limit_violations",
           "fallback_ticks", "solves", "iterations", "solve_ms", "peak_kw"]
HEADERS = {
    "sessions.csv": "session_id,connector,energy_kwh,soc_departure,satisfied,short_kwh,queued_s,reason,because",
    "steps.csv": "time_s,limit_kw,power_kw,active,mode",
    "connectors.csv": "time_s,connector,session_id,setpoint_a,current_a,soc,reason,waiting_place,waiting_of,"
                      "soc_estimated,expected_soc,short_kwh,because",
}
WORDS = {"session_id", "mode", "reason", "because"}
MAY_BE_EMPTY = {"expected_soc", "short_kwh"}  # in connectors.csv, where the station expects nothing
FILES = ["connectors.csv", "sessions.csv", "steps.csv", "summary.json"]
ROWS = [session(f"car-{number}", arrival_s=300 * number, departure_s=7200 + 1080 * number, max_kw=11 + number,
                soc_arrival=0.05 * number, battery_kwh=50 + number) for number in range(10)]


def without_wall_time(text):
    return re.sub(r'"solve_ms":\s*\{[^}]*\}', "", text)


def bytes_of(run):
    found = {path.name: path.read_bytes() for path in run.out.iterdir()}
    found["summary.json"] = without_wall_time(found["summary.json"].decode())
    return found


def test_the_files_have_the_agreed_form(sim):
    run = sim.run(ROWS, "--limit-kw", "40")
    assert sorted(path.name for path in run.out.iterdir()) == FILES
    assert list(run.summary)[: len(SUMMARY)] == SUMMARY
    assert list(run.summary["iterations"]) == list(run.summary["solve_ms"]) == ["p50", "p99", "max"]
    for name, header in HEADERS.items():
        assert (run.out / name).read_text().splitlines()[0] == header


def test_the_files_agree_with_one_another(sim):
    run = sim.run(ROWS, "--limit-kw", "40")
    delivered = sum(float(row["energy_kwh"]) for row in run.sessions.values())
    assert run.summary["delivered_kwh"] == pytest.approx(delivered, abs=1e-3)
    assert run.summary["satisfied"] == sum(row["satisfied"] == "1" for row in run.sessions.values())
    assert max(float(row["power_kw"]) for row in run.steps) <= run.summary["peak_kw"] <= 40
    by_time = {}
    for row in run.connectors:
        by_time[row["time_s"]] = by_time.get(row["time_s"], 0) + float(row["current_a"]) * 0.69
    for row in run.steps:
        assert float(row["power_kw"]) == pytest.approx(by_time.get(row["time_s"], 0), abs=0.01)
    energy = sum(float(row["power_kw"]) for row in run.steps) / 60
    assert energy == pytest.approx(delivered, abs=0.01)
    times = [int(row["time_s"]) for row in run.steps]
    assert times == list(range(0, 7200 + 1080 * 9, 60))
    assert {row["mode"] for row in run.steps} <= {"init", "plan", "fallback", "failsafe"}


def test_a_summary_for_people_is_always_printed(sim):
    run = sim.run(ROWS)
    assert f"{run.summary['satisfied']} of 10 sessions satisfied" in run.stdout
    sim.write("rows.csv", (sim.folder / "sessions.csv").read_text())
    bare = sim.call("--sessions", "rows.csv", "--policy", "edf", "--station", "hub")
    assert bare.stdout == run.stdout
    assert bare.stderr == ""


@pytest.mark.parametrize("policy", ["edf-soc", "llf", "equal-share"])
def test_a_repeat_is_equal_to_the_bit(sim, policy):
    runs = [sim.run(ROWS, "--limit-kw", "40", policy=policy, out=out) for out in ("one", "two")]
    assert bytes_of(runs[0]) == bytes_of(runs[1])


def test_a_repeat_with_the_planner_is_equal_to_the_bit(planning_sim):
    runs = [planning_sim.run(ROWS, "--limit-kw", "40", policy="soc-mpc", out=out) for out in ("one", "two")]
    assert runs[0].summary["solves"] > 10
    assert bytes_of(runs[0]) == bytes_of(runs[1])


def check_seeds(simulator, policy):
    runs = [simulator.run(ROWS, "--limit-kw", "40", "--seed", seed, policy=policy, out=f"seed-{seed}")
            for seed in (0, 1, 0xFFFFFFFFFFFFFFFF)]
    for run in runs:
        assert run.code == 0
        assert run.steps == runs[0].steps
        assert run.connectors == runs[0].connectors
        assert run.sessions == runs[0].sessions


def test_nothing_depends_on_the_order_in_which_nodes_send(sim):
    check_seeds(sim, "edf-soc")


def test_no_plan_depends_on_the_order_in_which_nodes_send(planning_sim):
    check_seeds(planning_sim, "soc-mpc")


def test_an_existing_folder_keeps_its_other_files(sim):
    (sim.folder / "out").mkdir()
    (sim.folder / "out" / "notes.txt").write_text("mine")
    (sim.folder / "out" / "summary.json").write_text("old")
    run = sim.run(ROWS)
    assert run.code == 0
    assert (run.out / "notes.txt").read_text() == "mine"
    assert run.summary["sessions"] == 10
    assert sorted(path.name for path in sim.folder.iterdir()) == ["out", "sessions.csv"]


@pytest.mark.parametrize("out", ["new", "new/", "./new//"])
def test_a_new_folder_is_made_and_nothing_else(sim, out):
    assert sim.run(ROWS, out=out).code == 0
    assert sorted(path.name for path in sim.folder.iterdir()) == ["new", "sessions.csv"]
    assert sorted(path.name for path in (sim.folder / "new").iterdir()) == FILES


@pytest.mark.parametrize(
    ("out", "reason"),
    [("sessions.csv", "cannot be an output directory"), ("sessions.csv/out", "cannot be an output directory"),
     ("sessions.csv/missing/out", "cannot be an output directory"), ("", "cannot be an output directory")],
)
def test_an_impossible_folder_is_told_before_the_run(sim, out, reason):
    run = sim.run(ROWS, out=out)
    assert run.code == 1
    assert reason in run.stderr
    assert run.stdout == ""
    assert sim.files() == ["sessions.csv"]


@pytest.mark.parametrize("out", ["a/b/c", "./a//b/c/", "here/../a/b/c"])
def test_missing_parents_are_made(sim, out):
    (sim.folder / "here").mkdir()
    assert sim.run(ROWS, out=out).code == 0
    assert sorted(path.name for path in (sim.folder / "a/b/c").iterdir()) == FILES
    assert sim.files() == sorted(["a", "a/b", "a/b/c", *(f"a/b/c/{name}" for name in FILES), "here", "sessions.csv"])


def test_parents_are_not_made_for_bad_input(sim):
    assert sim.run("nonsense\n", out="a/b/c").code == 1
    assert sim.files() == ["sessions.csv"]


def test_a_link_to_nowhere_is_told_before_the_run(sim):
    (sim.folder / "link").symlink_to("nowhere")
    run = sim.run(ROWS, out="link/missing/out")
    assert run.code == 1
    assert "cannot be made" in run.stderr
    assert run.stdout == ""
    assert sim.files() == ["link", "sessions.csv"]


def test_parents_that_were_made_go_when_writing_fails(sim):
    """The name itself fits; that of the directory that is written to does not."""
    (sim.folder / "here").mkdir()
    run = sim.run(ROWS, out="here/a/b/" + 250 * "x")
    assert run.code == 1
    assert "cannot be written to" in run.stderr
    assert sim.files() == ["here", "sessions.csv"]


def test_a_folder_that_gets_in_the_way_of_a_file_is_an_error(sim):
    (sim.folder / "out" / "steps.csv" / "inner").mkdir(parents=True)
    run = sim.run(ROWS)
    assert run.code == 1
    assert "cannot be written to" in run.stderr
    assert not (run.out / "summary.json").exists()
    assert sorted(path.name for path in sim.folder.iterdir()) == ["out", "sessions.csv"]


def test_all_numbers_are_plain_decimals(sim):
    run = sim.run(ROWS, "--limit-kw", "40")
    json.loads((run.out / "summary.json").read_text())
    number = re.compile(r"-?\d+(\.\d+)?")
    for name in ("steps.csv", "connectors.csv", "sessions.csv"):
        with (run.out / name).open(newline="") as file:
            for row in csv.DictReader(file):
                for column, value in row.items():
                    empty = value == "" and name == "connectors.csv" and column in MAY_BE_EMPTY
                    if column not in WORDS and not empty:
                        assert number.fullmatch(value), (name, column, value)
