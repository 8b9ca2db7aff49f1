"""tools/reference.py: the exact planner on problems that paper and pencil solve, what it reads, and what it writes."""

from __future__ import annotations

import csv
import math
import os
from dataclasses import replace
from pathlib import Path

import cvxpy as cp
import numpy as np
import pytest
import reference
from rich.console import Console
from taperlib.files import InputError
from taperlib.gaps import Solved
from taperlib.log_utility import DOUBT, PRECISE, Exact, LogUtility, SolverError
from taperlib.planner_probe import demand_line, run_probe
from taperlib.planner_times import Day
from taperlib.planning_cases import KINDS, LAMBDAS, STATIONS, Case, draw, evenly, read_problems
from taperlib.planning_problem import Demand, read_station
from taperlib.written_out import solve_written_out

HUB = read_station("hub")
PEAK_KW = 22.08
AMPLE_W = 110_000
STEP_H = 0.25
EMPTY = Demand(stored_Wh=0, capacity_Wh=60_000, need_Wh=60_000, peak_W=20_000, taper_W=0, departs_in_s=86_400)


def case(demands: dict[int, Demand], weight: float = 0.0, steps: int = 4, limit_W: int = AMPLE_W) -> Case:
    return Case("by hand", HUB, demands, [limit_W] * HUB.steps, weight, steps)


def exact(problem: Case) -> np.ndarray:
    return LogUtility(problem).solve(**PRECISE).power_kW


def test_a_vehicle_alone_charges_evenly() -> None:
    power_kW = exact(case({2: replace(EMPTY, need_Wh=5_000)}, weight=10))
    assert power_kW[2] == pytest.approx([5.0] * 4, rel=1e-4)
    assert not np.delete(power_kW, 2, axis=0).any()


def test_equals_share_the_site_equally() -> None:
    power_kW = exact(case(dict.fromkeys(range(4), EMPTY), limit_W=24_000))
    assert power_kW[:4] == pytest.approx(np.full((4, 4), 6.0), rel=1e-4)


def test_a_taper_gives_up_power_now_for_power_later() -> None:
    """Two steps: log u + log (P - a u) has its maximum at u = P / 2a, with a = 0.8 of P in a step of full power."""
    steep = replace(EMPTY, capacity_Wh=5_000, taper_W=16_000)
    power_kW = exact(case({0: steep}, steps=2))
    assert power_kW[0] == pytest.approx([20 / 1.6, 10.0], rel=1e-4)


def test_a_great_lambda_cares_for_energy_more_than_for_fairness() -> None:
    """The one misses 10 kWh, the other 1 kWh; the site has 2 kWh."""
    demands = {0: replace(EMPTY, need_Wh=10_000), 1: replace(EMPTY, need_Wh=1_000)}
    fair, eager = (exact(case(demands, weight, limit_W=2_000)).sum(axis=1)[:2] * STEP_H for weight in (0.0, 1000.0))
    assert fair == pytest.approx([1.0, 1.0], rel=1e-3)
    assert eager[0] > 1.9


def test_no_logarithm_where_a_vehicle_may_not_charge() -> None:
    demands = {
        0: replace(EMPTY, departs_in_s=1_350),  # one step and a half
        1: replace(EMPTY, capacity_Wh=40_000, stored_Wh=40_000, taper_W=20_000),  # full
        2: EMPTY,
    }
    course = [AMPLE_W, AMPLE_W, 0, AMPLE_W] + [AMPLE_W] * (HUB.steps - 4)
    utility = LogUtility(replace(case(demands), limit_W=course))
    assert utility.terms.tolist() == [[True, True, False, False], [False] * 4, [True, True, False, True]]
    power_kW = utility.solve(**PRECISE).power_kW
    assert not power_kW[:3][~utility.terms].any()
    assert power_kW[0, 1] == pytest.approx(0.5 * PEAK_KW, rel=1e-4)


def test_the_objective_is_the_papers() -> None:
    utility = LogUtility(case({0: replace(EMPTY, need_Wh=9_000)}, weight=2.0, steps=2))
    power_kW = np.zeros((8, 2))
    power_kW[0] = [4.0, 8.0]
    missing_kWh = 9.0 - STEP_H * 12.0
    assert utility.objective(power_kW) == pytest.approx(math.log(4) + math.log(8) - 2 * missing_kWh**2)


def test_the_gap_of_powers_that_are_all_a_thousandth_off_is_a_thousandth() -> None:
    """Though the logarithms add up to nearly nothing: their powers are 1 kW."""
    utility = LogUtility(case({0: replace(EMPTY, need_Wh=1_000)}))
    best = utility.solve(**PRECISE)
    assert abs(best.objective) < 1e-3
    assert utility.gap(0.999 * best.power_kW, best) == pytest.approx(1e-3, rel=1e-2)
    assert utility.first_step_difference(0.999 * best.power_kW, best) == pytest.approx(1e-3 / PEAK_KW, rel=1e-2)


def written_plainly(drawn: Case) -> cp.Problem:
    """Equation 7 in kW and kWh, of a station with one limit, of which no vehicle leaves within a step."""
    demands = list(drawn.demands.values())
    limit_kW = np.array(drawn.limit_W) / 1000
    stay = np.array([[d.departs_in_s > t * 900 for t in range(limit_kW.size)] for d in demands])
    slope = np.array([d.taper_W / d.capacity_Wh for d in demands])[:, None]
    now_kW = np.array([d.peak_W - d.taper_W * d.stored_Wh / d.capacity_Wh for d in demands])[:, None] / 1000
    need_kWh = np.array([d.need_Wh for d in demands]) / 1000
    power_kW = cp.Variable(stay.shape, nonneg=True)
    energy_kWh = STEP_H * cp.cumsum(power_kW, axis=1)
    rows = [power_kW <= 7.36 * stay, power_kW[:, 1:] + cp.multiply(slope, energy_kWh[:, :-1]) <= now_kW,
            power_kW[:, :1] <= now_kW, energy_kWh[:, -1] <= need_kWh, cp.sum(power_kW, axis=0) <= limit_kW]
    missing = cp.sum_squares(energy_kWh[:, -1] - need_kWh)
    return cp.Problem(cp.Maximize(cp.sum(cp.log(power_kW[stay])) - drawn.lambda_per_kWh2 * missing), rows)


def test_the_papers_formula_written_out_plainly_has_the_same_optimum() -> None:
    drawn = draw(1 + 12)
    assert drawn.name == "13: garage, saturated, lambda 10, with taper"
    whole = {i: replace(d, departs_in_s=d.departs_in_s // 900 * 900) for i, d in drawn.demands.items()}
    drawn = replace(drawn, demands=whole)
    assert LogUtility(drawn).solve().objective == pytest.approx(written_plainly(drawn).solve(solver=cp.CLARABEL), rel=1e-6)


def test_nothing_is_planned_without_power() -> None:
    answer = LogUtility(case({0: EMPTY}, weight=1.0, limit_W=0)).solve(**PRECISE)
    assert not answer.power_kW.any()
    assert answer.objective == pytest.approx(-3600)


def test_a_duality_gap_bounds_the_first_step() -> None:
    answer = Exact(np.array([[10.0]]), 0.0, duality_gap=0.5e-4, solver_s=0.0, total_s=0.0)
    assert answer.first_step_doubt(20.0) == pytest.approx(0.5 * 0.01 / 0.99)


def test_an_answer_in_doubt_is_sought_once_more() -> None:
    """Of this one Clarabel says at first that it is almost solved, with a gap that leaves the first step open by 2 %."""
    utility = LogUtility(draw(38))
    first, best = utility.solve(**PRECISE), utility.solve_precisely()
    assert best.duality_gap <= first.duality_gap
    assert best.first_step_doubt(utility.base_kW) <= DOUBT


def test_72_drawn_problems_have_every_combination() -> None:
    cases = [draw(number) for number in range(72)]
    found = {(c.station.name, c.name.split(", ")[1], c.lambda_per_kWh2, any(d.taper_W for d in c.demands.values()))
             for c in cases}
    assert found == {(s, k, w, t) for s in STATIONS for k in KINDS for w in LAMBDAS for t in (False, True)}


def test_a_seed_repeats_its_problems() -> None:
    assert draw(17, seed=5) == draw(17, seed=5)
    assert draw(17, seed=5) != draw(17, seed=6)


def test_some_of_many_are_spread_over_all() -> None:
    assert evenly(10, 4) == [0, 2, 5, 7]
    assert evenly(3, 4) == [0, 1, 2]


def written(folder: Path, *lines: str) -> Path:
    path = folder / "problems"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_recorded_problem_is_read_back(tmp_path: Path) -> None:
    one_phase = replace(EMPTY, conductors=1, max_mA=16_000, second_peak_W=90_000, second_taper_W=85_000)
    limit = "limit " + " ".join(["30000"] * HUB.steps)
    lines = ["station hub", "planning 1 2500 6 12", "time 7200000", limit, demand_line(HUB, 3, one_phase), "solve", "solve"]
    (found,) = read_problems(written(tmp_path, *lines))
    assert found.demands == {3: one_phase}
    assert (found.lambda_per_kWh2, found.horizon_steps, found.planned.steps) == (2.5, 12, 12)
    assert (found.time_ms, found.limit_W) == (7_200_000, [30_000] * HUB.steps)


@pytest.mark.parametrize("line", ["demand 1 2", "second 1 90000 85000", "planning x", "nonsense 1"])
def test_a_line_that_cannot_be_read_is_named(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match="problems, line 2: "):
        read_problems(written(tmp_path, "station hub", line))


SESSIONS = """session_id,connector,arrival_s,departure_s,battery_kwh,soc_arrival,soc_target,max_kw,taper_kw,phases
a,1,0,9000,40,0.2,0.8,22,10,
b,2,1800,9000,40,0.2,0.8,22,10,1
"""


def test_a_problem_that_the_exact_solver_fails_on_is_told_and_left_out(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    cases = [draw(0), draw(1)]
    solve = Solved.of

    def fail_on_the_first(case: Case) -> Solved:
        if case.name == cases[0].name:
            raise SolverError("no progress")
        return solve(case)

    monkeypatch.setattr(reference.Solved, "of", staticmethod(fail_on_the_first))
    assert [one.case.name for one in reference._solved(cases, Console(quiet=True))] == [cases[1].name]
    assert f"{cases[0].name} is left out: no progress" in capsys.readouterr().err
    with pytest.raises(SolverError):
        reference._solved(cases[:1], Console(quiet=True))


def test_a_program_in_the_present_folder_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "probe").write_text("#!/bin/sh\nexit 3\n")
    (tmp_path / "probe").chmod(0o755)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="exit code 3"):
        run_probe(Path("./probe"), [], [])


def run(tmp_path: Path, *arguments: str) -> int:
    sessions = tmp_path / "sessions.csv"
    sessions.write_text(SESSIONS)
    programs = ["--sim", os.environ["TAPER_SIM"], "--probe", os.environ["TAPER_PLANNER_PROBE"]]
    return reference.main(["--sessions", str(sessions), "--station", "hub", *programs, *arguments])


def test_a_replay_is_compared_by_outer_iterations(tmp_path: Path) -> None:
    limit = ("--limit-kw", "12", "--problems", "3", "--outer-iterations", "2,6")
    assert run(tmp_path, *limit, "--out", str(tmp_path / "out")) == 0
    rows = list(csv.DictReader((tmp_path / "out/gap.csv").open()))
    assert [row["outer_iterations"] for row in rows] == ["2", "6"]
    assert len((tmp_path / "out/problems.csv").read_text().splitlines()) == 1 + 2 * 3


def test_a_days_times_are_compared(tmp_path: Path) -> None:
    assert run(tmp_path, "--limit-kw", "12", "--timing", "--problems", "2", "--out", str(tmp_path / "out")) == 0
    (row,) = csv.DictReader((tmp_path / "out/timing.csv").open())
    assert (row.pop("which"), row["exact_problems"]) == ("all problems", "2")
    assert all(float(value) > 0 for value in row.values())


def test_a_full_station_has_its_own_line() -> None:
    cases = [draw(number) for number in range(12)]
    taken = [len(case.demands) / case.station.connectors for case in cases]
    groups = Day(cases, [1.0] * 12, [1.0] * 12).groups()
    assert groups["all problems"] == list(range(12))
    assert groups["a full station"] == [k for k, share in enumerate(taken) if share >= 0.75] != []


@pytest.mark.parametrize("number", [0, 1, 2, 3])
def test_written_out_by_vehicles_the_optimum_is_the_same(number: int) -> None:
    case = draw(number)
    utility, exact = LogUtility(case), LogUtility(case).solve_precisely()
    answer = solve_written_out(case)
    assert utility.gap(answer.power_kW, exact) < 1e-4
    assert utility.first_step_difference(answer.power_kW, exact) < 5e-3


@pytest.mark.parametrize("arguments", [(), ("--limit-kw", "9", "--outer-iterations", "0")])
def test_a_command_that_makes_no_sense_is_refused(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    with pytest.raises(SystemExit) as refused:
        run(tmp_path, *arguments)
    assert refused.value.code == 2


def test_what_is_missing_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(tmp_path, "--limit-csv", str(tmp_path / "none.csv")) == 1
    assert "none.csv: cannot be read" in capsys.readouterr().err
