"""tools/compare.py, with a test double in place of the simulator (fake_taper_sim.py)."""

import csv
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from compare import main
from taperlib.charts import downsampled_rows
from taperlib.measures import energy_shares, jain_fairness, missing_soc_percent
from taperlib.sessions import Session, write_sessions_csv
from taperlib.simulator import Departure, Run, Spread

FAKE = Path(__file__).resolve().parent / "fake_taper_sim.py"
MEGABYTE = 1_000_000


@pytest.fixture
def case(tmp_path):
    """A folder with three sessions, an executable simulator, and the arguments that compare them."""
    simulator = tmp_path / "taper-sim"
    simulator.write_text(f"#!{sys.executable}\n" + FAKE.read_text())
    simulator.chmod(0o755)
    sessions = [Session(f"car-{index}", 3600 * index, 3600 * index + 7200, 40.0, 0.2, 0.6, 7.2, 4.32)
                for index in range(3)]
    write_sessions_csv(tmp_path / "sessions.csv", sessions)
    arguments = ["--sessions", str(tmp_path / "sessions.csv"), "--sim", str(simulator), "--limit-kw", "10",
                 "--out", str(tmp_path / "out"), "--policies", "soc-mpc,edf"]
    return tmp_path, arguments


def table_of(folder):
    with (folder / "out" / "table.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_comparison_writes_table_report_and_the_simulator_s_output(case, capsys):
    folder, arguments = case
    assert main(arguments) == 0
    assert sorted(path.name for path in (folder / "out").iterdir()) == [
        "comparison.json", "report.html", "runs", "table.csv"]
    assert (folder / "out" / "runs" / "edf" / "steps.csv").is_file()
    output = capsys.readouterr().out
    assert "soc-mpc" in output and "Clairvoyant bound" in output


def test_the_table_keeps_the_order_asked_for_and_measures_against_the_bound(case):
    folder, arguments = case
    assert main(arguments) == 0
    rows = table_of(folder)
    comparison = json.loads((folder / "out" / "comparison.json").read_text())
    assert [row["policy"] for row in rows] == ["soc-mpc", "edf"]
    for row in rows:
        share = 100 * float(row["energy_kwh"]) / comparison["bound_kwh"]
        assert float(row["share_of_bound_percent"]) == pytest.approx(share)
        assert 50 < share <= 100.000001
        assert float(row["unserved_kwh"]) == pytest.approx(3 * 16 - float(row["energy_kwh"]))


def test_energy_without_a_price_has_no_cost(case):
    folder, arguments = case
    assert main(arguments) == 0
    assert {row["cost"] for row in table_of(folder)} == {""}
    assert "per kWh" not in (folder / "out" / "report.html").read_text().split("<tbody>")[0].split("<thead>")[1]


def test_prices_go_to_the_simulator_and_costs_into_the_table(case):
    folder, arguments = case
    prices = folder / "day-ahead.csv"
    prices.write_text("time_s,price_per_kwh\n0,0.2\n")
    assert main([*arguments, "--price-csv", str(prices), "--price-weight", "0.5"]) == 0
    for row in table_of(folder):
        assert float(row["cost"]) == pytest.approx(0.2 * float(row["energy_kwh"]))
        assert float(row["cost_per_kwh"]) == pytest.approx(0.2)
    report = (folder / "out" / "report.html").read_text()
    assert "price day-ahead.csv with weight 0.5" in report and "<span>per kWh</span>" in report


def test_a_policy_that_solves_nothing_has_no_iterations(case):
    folder, arguments = case
    assert main(arguments) == 0
    planner, baseline = table_of(folder)
    assert planner["iterations_max"] == "120.0"
    assert baseline["iterations_max"] == ""


def test_the_report_loads_nothing_from_elsewhere_and_is_small_enough_to_mail(case):
    folder, arguments = case
    assert main([*arguments, "--title", "A <quiet> day"]) == 0
    report = (folder / "out" / "report.html").read_text()
    assert len(report) < 12 * MEGABYTE
    assert "<h1>A &lt;quiet&gt; day</h1>" in report
    assert re.findall(r"<(?:script|link|img)[^>]*(?:src|href)=[\"']?(?:https?:)?//", report) == []


def test_a_simulator_that_fails_leaves_no_report_and_its_message_is_shown(case, capsys, monkeypatch):
    folder, arguments = case
    monkeypatch.setenv("FAKE_SIM", "fail:edf")
    assert main(arguments) == 1
    message = capsys.readouterr().err
    assert "exit code 4" in message and "the fake was told to fail" in message
    assert list((folder / "out").iterdir()) == []


def test_a_failed_comparison_leaves_the_last_good_one_whole(case, monkeypatch):
    folder, arguments = case
    assert main(arguments) == 0
    before = {path: path.read_bytes() for path in (folder / "out").rglob("*") if path.is_file()}
    monkeypatch.setenv("FAKE_SIM", "fail:soc-mpc")
    assert main(arguments) == 1
    assert {path: path.read_bytes() for path in (folder / "out").rglob("*") if path.is_file()} == before


def test_a_step_above_the_limit_is_found_even_if_the_simulator_counts_none(case, capsys, monkeypatch):
    folder, arguments = case
    monkeypatch.setenv("FAKE_SIM", "exceed:edf")
    assert main(arguments) == 3
    message = " ".join(capsys.readouterr().err.split())
    assert "10.5000 kW" in message and "exceeded under edf" in message
    planner, baseline = table_of(folder)
    assert (planner["violations"], baseline["violations"]) == ("0", "1")
    assert "The site limit was exceeded" in (folder / "out" / "report.html").read_text()


def test_a_simulator_that_claims_a_higher_limit_is_held_to_the_one_asked_for(case, capsys, monkeypatch):
    _, arguments = case
    monkeypatch.setenv("FAKE_SIM", "boast:soc-mpc")
    assert main(arguments) == 3
    assert "exceeded under soc-mpc" in " ".join(capsys.readouterr().err.split())


def test_output_that_lacks_a_file_is_an_error(case, capsys, monkeypatch):
    folder, arguments = case
    monkeypatch.setenv("FAKE_SIM", "cut:edf")
    assert main(arguments) == 1
    assert "edf: the simulator's output cannot be read" in capsys.readouterr().err
    assert not (folder / "out" / "report.html").exists()


def test_a_simulator_that_is_not_there_is_named(case, capsys):
    folder, arguments = case
    assert main([*arguments, "--sim", str(folder / "none")]) == 1
    assert "there is no simulator" in capsys.readouterr().err


def test_a_policy_cannot_name_a_folder(case):
    _, arguments = case
    with pytest.raises(SystemExit) as exit_info:
        main([*arguments, "--policies", "../edf"])
    assert exit_info.value.code == 2


def test_jain_s_index_is_one_for_equal_shares_and_one_nth_for_a_single_winner():
    assert jain_fairness(np.array([0.4, 0.4, 0.4])) == pytest.approx(1.0)
    assert jain_fairness(np.array([1.0, 0.0, 0.0, 0.0])) == pytest.approx(0.25)
    assert jain_fairness(np.array([0.0, 0.0])) == 1.0


def test_a_session_that_was_never_served_counts_as_nothing_received():
    sessions = [Session(name, 0, 900, 10.0, 0.2, 0.6, 7.2, 0.0) for name in ("served", "queued")]
    served = {"served": Departure(energy_kwh=2.0, soc=0.4)}
    nothing, step = Spread(None, None, None), np.array([0.0])
    run = Run("edf", 2.0, 0, 0, 0, 0, 2.0, nothing, nothing, served, step, step, step)
    assert energy_shares(sessions, run).tolist() == pytest.approx([0.5, 0.0])
    assert missing_soc_percent(sessions, run).tolist() == pytest.approx([20.0, 40.0])


def test_thinning_keeps_the_order_the_peak_and_the_trough():
    value = np.sin(np.arange(100_000) / 900.0)
    value[54_321], value[77_777] = 5.0, -5.0
    rows = downsampled_rows(value, most=1000)
    assert rows.size <= 1000
    assert np.all(np.diff(rows) > 0)
    assert 54_321 in rows and 77_777 in rows


def test_a_short_series_is_not_thinned():
    assert downsampled_rows(np.array([3.0, 1.0, 2.0])).tolist() == [0, 1, 2]
