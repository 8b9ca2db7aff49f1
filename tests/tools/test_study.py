"""tools/study: campaigns on one process, on several and on a cluster, what is run again, headlines, errors."""

import csv
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from taperlib.files import InputError
from taperlib.sessions import peak_present, requested_kwh
from taperstudy.cases import Case, bound_of, job_of
from taperstudy.catalogue import all_sections
from taperstudy.command import main
from taperstudy.headlines import MARK, accept_headlines, broken_headlines, read_headlines
from taperstudy.recipes import (
    AcnWeek, DailyDrop, DrawnBatteries, EqualBatteries, Inputs, SiteLimit, limit_csv, working_day_kwh,
)
from taperstudy.settings import EVENTS, WEEK, equal_week, real_week, synthetic
from taperstudy.simulator_build import with_horizon
from taperstudy.store import Store
from taperstudy.worker import Programs, run_job

ROOT = Path(__file__).resolve().parents[2]
SIMULATOR = Path(os.environ["TAPER_SIM"]) if "TAPER_SIM" in os.environ else (
    ROOT / "build/host-release/host_sim/taper-sim")
WEEK_HEADER = ("arrival,departure,requested_energy (kWh),delivered_energy (kWh),station_id,session_id,"
               "estimated_departure,claimed")


@pytest.fixture
def data(tmp_path):
    """A folder with a short week: six cars in one morning."""
    folder = tmp_path / "data"
    folder.mkdir()
    rows = [f"2020-01-06 08:{5 * car:02d}:00-08:00,2020-01-06 1{car % 3}:30:00-08:00,{6 + car},5,S,car {car},"
            f"2020-01-06 09:30:00-08:00,True" for car in range(6)]
    (folder / "acn-short-2020-01-06.csv").write_text("\n".join([WEEK_HEADER, *rows]) + "\n")
    return folder


@pytest.fixture
def campaign(tmp_path, data):
    """Arguments that run eight cases of a second in all, and where they write."""
    toml = tmp_path / "campaign.toml"
    toml.write_text('name = "tiny"\nstations = ["hub"]\nweeks = ["acn-short-*"]\nlimits_kw = [15, 30]\n'
                    'policies = ["soc-mpc", "llf", "equal-share"]\noptions = ["--min-current-a", "0"]\n')

    def run(name, *arguments):
        code = main(["--campaign", str(toml), "--data", str(data), "--sim", str(SIMULATOR),
                     "--cases", str(tmp_path / name / "cases"), "--out", str(tmp_path / name), *arguments])
        return code, tmp_path / name / "tiny.csv"
    return run


def test_one_process_two_of_them_and_a_cluster_of_two_workers_give_the_same_table(campaign):
    from distributed import LocalCluster
    assert SIMULATOR.is_file(), f"{SIMULATOR} is missing: cmake --build --preset host-release -t taper-sim"
    code, alone = campaign("alone", "--workers", "1")
    assert code == 0
    code, here = campaign("here", "--workers", "2")
    assert code == 0
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        code, there = campaign("there", "--scheduler", cluster.scheduler_address)
    assert code == 0
    assert alone.read_bytes() == here.read_bytes() == there.read_bytes()
    with alone.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["limit_kw"], row["policy"]) for row in rows] == [
        (kw, policy) for kw in ("15", "30") for policy in ("soc-mpc", "llf", "equal-share")]
    assert all(50 < float(row["share_of_bound_percent"]) <= 100.01 and row["violations"] == "0" for row in rows)


def test_a_finished_case_is_not_run_again_and_a_half_written_one_is(campaign, tmp_path, capsys):
    code, table = campaign("once", "--workers", "1")
    assert code == 0 and "8 cases, 0 of them finished before" in capsys.readouterr().out
    before = table.read_bytes()
    cases = tmp_path / "once" / "cases"
    kept, lost = sorted(cases.iterdir())[:2]
    lost.rename(cases / f".{lost.name}.1.part")  # as an interruption leaves it
    written = kept.stat().st_mtime_ns
    table.unlink()
    assert campaign("once", "--workers", "1")[0] == 0
    assert "8 cases, 7 of them finished before" in capsys.readouterr().out
    assert kept.stat().st_mtime_ns == written and lost.is_dir()
    assert table.read_bytes() == before


def test_a_failed_write_leaves_no_case(tmp_path):
    store = Store(tmp_path)
    with pytest.raises(TypeError):
        store.keep("case", {"measures.json": b"{}", "steps.csv.gz": "not bytes"})
    assert not store.has("case") and list(tmp_path.iterdir()) == []


def test_another_simulator_makes_another_case_of_a_run_and_not_of_a_bound():
    inputs = Inputs()
    ours = Programs(SIMULATOR, "a" * 64, "c" * 64)
    other = replace(ours, simulator_sha256="b" * 64)
    for case, changes in ((Case(synthetic(0.02), "llf"), True), (bound_of(synthetic(0.02)), False)):
        keys = {job_of(case, inputs).key(programs.sha256_for(case.policy)) for programs in (ours, other)}
        assert (len(keys) == 2) == changes


def test_a_case_depends_on_all_that_it_is_made_of_but_not_on_its_name():
    inputs, setting = Inputs(), synthetic(0.02)
    case = Case(setting, "llf")
    key = job_of(case, inputs).key("program")
    assert job_of(Case(replace(setting, name="another"), "llf"), inputs).key("program") == key
    changed = [replace(case, policy="edf"), replace(case, options=EVENTS), Case(synthetic(0.03), "llf"),
               Case(replace(setting, limit=SiteLimit(kw=57.0)), "llf"), Case(replace(setting, tick_s=60.0), "llf"),
               Case(replace(setting, station="depot"), "llf"), Case(replace(setting, horizon=48), "llf")]
    keys = {job_of(each, inputs).key("program") for each in changed}
    assert len(keys) == len(changed) and key not in keys


def test_a_worker_with_another_simulator_says_so(tmp_path):
    job = job_of(Case(synthetic(0.02), "llf"), Inputs())
    for path, reason in ((tmp_path / "absent", "there is no simulator at"), (SIMULATOR, "is another one than")):
        programs = Programs(path, "0" * 64, Programs.of(SIMULATOR).code_sha256)
        with pytest.raises(InputError, match=reason):
            run_job(job, programs)


def test_a_worker_with_other_tools_says_so():
    programs = replace(Programs.of(SIMULATOR), code_sha256="0" * 64)
    with pytest.raises(InputError, match="of another version"):
        run_job(job_of(Case(synthetic(0.02), "llf"), Inputs()), programs)


@pytest.mark.parametrize("workers", ["1", "2"])
def test_a_case_that_fails_is_named_with_the_simulator_s_own_words(campaign, tmp_path, capsys, workers):
    toml = tmp_path / "campaign.toml"
    toml.write_text(toml.read_text().replace('"llf"', '"magic"'))
    code, table = campaign("magic", "--workers", workers)
    error = capsys.readouterr().err
    assert code == 1 and not table.exists()
    assert error.startswith("study: case 'hub, short 2020-01-06, ") and " magic': magic: the simulator failed" in error
    assert "Traceback" not in error


def test_a_scheduler_that_is_not_there_is_named(campaign, capsys, monkeypatch):
    monkeypatch.setattr("taperstudy.runner.CONNECT_TIMEOUT_S", 1)
    code, _ = campaign("nobody", "--scheduler", "tcp://127.0.0.1:9")
    assert code == 1 and "--scheduler tcp://127.0.0.1:9: no Dask scheduler answers there" in capsys.readouterr().err


@pytest.mark.parametrize("line, reason", [
    ('weeks = ["acn-mars-*"]', "key weeks: no week is called 'acn-mars-\\*'"),
    ('stations = ["nowhere"]', "key stations: 'nowhere' is none of hub, garage,"),
    ("weeks = []", "key weeks: needs a list of texts"),
    ("limit_shares = [0.5]", "needs either limit_shares or limits_kw"),
    ("alpha = 0.05", "needs both alpha and battery_kwh"),
    ("tempo = 3", "key tempo: is not known"),
    ('tick_s = "60"', "key tick_s: needs a number"),
    ('name = "../away"', "key name: needs letters"),
])
def test_a_campaign_that_makes_no_sense_is_refused_with_file_key_and_reason(campaign, tmp_path, capsys, line, reason):
    toml = tmp_path / "campaign.toml"
    key = line.split(" =")[0]
    kept = [text for text in toml.read_text().splitlines() if not text.startswith(f"{key} =")]
    toml.write_text("\n".join([*kept, line]) + "\n")
    assert campaign("refused")[0] == 1
    error = capsys.readouterr().err
    assert error.startswith(f"study: {toml}") and reason.replace("\\", "") in error


def page(tmp_path, *rows):
    path = tmp_path / "results.md"
    path.write_text("\n".join(["# Results", "", MARK, "", "| headline | value | within | must be |", "|---|---|---|---|",
                               *rows, "", "More text."]) + "\n")
    return path


def test_headlines_that_hold_are_silent_and_each_broken_one_is_named_with_its_line(tmp_path):
    path = page(tmp_path, "| gain [%] | 12.50 | 0.05 | >= 10.27 |", "| least [%] | 99.76 | 0.05 | |")
    assert broken_headlines(path, {"gain [%]": 12.54, "least [%]": 99.72}, whole=True) == []
    assert broken_headlines(path, {"gain [%]": 12.4, "least [%]": 99.76}, whole=True) == [
        f"{path}, line 7: 'gain [%]' says 12.5, within 0.05; the study found 12.4000"]
    path = page(tmp_path, "| gain [%] | 10.25 | 0.05 | >= 10.27 |")
    assert broken_headlines(path, {"gain [%]": 10.26}, whole=True) == [
        f"{path}, line 7: 'gain [%]' must be >= 10.27; the study found 10.2600"]


def test_a_headline_that_nobody_computes_or_states_is_told(tmp_path):
    path = page(tmp_path, "| gain [%] | 12.50 | 0.05 | |")
    assert broken_headlines(path, {}, whole=False) == []
    assert "is nothing that the study finds" in broken_headlines(path, {}, whole=True)[0]
    assert "does not state 'more'" in broken_headlines(path, {"gain [%]": 12.5, "more": 1.0}, whole=False)[0]


def test_accepting_writes_the_numbers_found_and_keeps_the_bounds(tmp_path):
    path = page(tmp_path, "| gain [%] | 12.50 | 0.05 | >= 10.27 |", "| least [%] | 99.76 | 0.05 | |")
    accept_headlines(path, {"gain [%]": 9.0})
    assert [(headline.value, headline.bound) for headline in read_headlines(path)] == [(9.0, ">= 10.27"), (99.76, "")]
    assert path.read_text().startswith("# Results\n") and path.read_text().endswith("More text.\n")
    assert "must be >= 10.27" in broken_headlines(path, {"gain [%]": 9.0, "least [%]": 99.76}, whole=True)[0]


def test_a_page_without_headlines_or_with_a_senseless_one_is_refused(tmp_path):
    path = page(tmp_path, "| gain [%] | much | 0.05 | |")
    with pytest.raises(InputError, match="line 7, value: 'much' is not a number"):
        read_headlines(path)
    with pytest.raises(InputError, match="line 7: the bound 'high'"):
        read_headlines(page(tmp_path, "| gain [%] | 1 | 0.05 | high |"))
    path.write_text("# Results\n")
    with pytest.raises(InputError, match="has no line"):
        read_headlines(path)


def test_a_broken_headline_makes_the_command_fail_with_its_line(tmp_path, monkeypatch, capsys, data):
    """With the section of the paper in small: the same code, one setting."""
    settings = [replace(real_week("acn-short-2020-01-06", 0.1), station="hub", limit=SiteLimit(kw=15.0))]
    monkeypatch.setattr("taperstudy.paper.six_settings", lambda: settings)
    arguments = ["--section", "paper", "--data", str(data), "--sim", str(SIMULATOR), "--workers", "1",
                 "--cases", str(tmp_path / "cases"), "--out", str(tmp_path / "out")]
    names = ["gain of soc-mpc-log over mpc-log, average of the six [%]", "the same, solved at events only [%]",
             "soc-mpc, least share of the bound in the six [%]", "soc-mpc, most below another policy in the six [%]",
             "limit violations in all of these runs"]
    path = page(tmp_path, *(f"| {name} | 0 | 1000 | |" for name in names))
    assert main([*arguments, "--results", str(path)]) == 0
    path = page(tmp_path, *(f"| {name} | 0 | 1000 | |" for name in names[:-1]), f"| {names[-1]} | 3 | 0 | |")
    assert main([*arguments, "--results", str(path)]) == 1
    assert f"line 11: '{names[-1]}' says 3, within 0; the study found 0.0000" in capsys.readouterr().err
    written = sorted(file.name for file in (tmp_path / "out").iterdir())
    assert written == ["experiments.csv", "gain.csv", "report.html", "shares.csv"]
    report = (tmp_path / "out" / "report.html").read_text()
    assert "Plotly.newPlot" in report and "src=\"http" not in report


def test_every_section_has_cases_that_can_be_made_of_the_project_s_own_data():
    inputs = Inputs()
    sections = all_sections(inputs)
    assert len({section.name for section in sections}) == len(sections)
    for section in sections:
        assert section.cases
        for case in set(section.cases):
            job_of(case, inputs)


def test_batteries_of_the_real_week_are_of_many_sizes_and_lose_the_same_share():
    sessions = Inputs().sessions(real_week(WEEK, 0.08).sessions)
    assert {24.0, 40.0, 60.0, 100.0} <= {session.battery_kwh for session in sessions}
    assert {round(session.taper_kw / session.max_kw, 3) for session in sessions} == {0.8}


def test_a_full_battery_of_18_kwh_takes_nothing_more_at_the_steepest_taper():
    sessions = Inputs().sessions(equal_week(WEEK, 0.1).sessions)
    assert {session.battery_kwh for session in sessions} == {18.0}
    assert all(0.1 <= session.soc_arrival <= 0.5 and session.soc_target <= 1 for session in sessions)
    assert {round(session.taper_kw / session.max_kw, 6) for session in sessions} == {1.0}
    lines = limit_csv(SiteLimit(hours=10), sessions).splitlines()
    assert lines[1] == f"0,{round(working_day_kwh(sessions) / 10, 3)}"
    assert working_day_kwh(sessions) == pytest.approx(requested_kwh(sessions) / 5, rel=0.06)  # little on the weekend
    lighter = Inputs().sessions(equal_week(WEEK, 0.05).sessions)
    assert [session.soc_arrival for session in lighter] == [session.soc_arrival for session in sessions]


def test_a_battery_that_would_leave_no_power_is_refused():
    with pytest.raises(InputError, match="no power would be left"):
        Inputs().sessions(AcnWeek(WEEK, EqualBatteries(24.0, 0.1)))


def test_the_bound_does_not_hear_what_drivers_say():
    setting = replace(real_week(WEEK, 0.1), sessions=AcnWeek(WEEK, DrawnBatteries(), driver_departure=True))
    inputs = Inputs()
    assert "expected_departure_s" in job_of(Case(setting, "llf"), inputs).sessions_csv
    assert "expected_departure_s" not in job_of(bound_of(setting), inputs).sessions_csv


def test_a_limit_can_be_a_share_and_drop_each_day():
    sessions = Inputs().sessions(real_week(WEEK, 0.1).sessions)
    assert peak_present(sessions) == 52 and requested_kwh(sessions) > 2000
    lines = limit_csv(SiteLimit(share=0.5, drop=DailyDrop(12, 15, 0.25)), sessions).splitlines()
    assert lines[:4] == ["time_s,limit_kw", "0,187.2", "43200,46.8", "54000,187.2"]


def test_a_station_with_another_horizon_differs_by_its_name_and_steps_alone():
    toml = (ROOT / "codegen/stations/garage.toml").read_text()
    changed = [(old, new) for old, new in zip(toml.splitlines(), with_horizon(toml, "garage", 48).splitlines())
               if old != new]
    assert [new for _, new in changed] == ['name = "garage48"', "steps = 48"]
    with pytest.raises(InputError, match="has no line like 'steps = 48'"):
        with_horizon('name = "garage"\n', "garage", 48)


def test_the_command_lists_its_sections_and_refuses_unknown_ones(capsys):
    assert main(["--list"]) == 0
    assert "The paper's experiments" in capsys.readouterr().out
    assert main(["--section", "weather"]) == 1
    assert "study: --section weather: there are paper, " in capsys.readouterr().err


def test_the_script_finds_its_modules_from_any_folder(tmp_path):
    done = subprocess.run([sys.executable, str(ROOT / "tools/study"), "--help"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and "--campaign" in done.stdout
