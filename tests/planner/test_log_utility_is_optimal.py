"""The firmware's log utility, each problem planned cold, against the exact optimum by CVXPY and Clarabel.

The problems are drawn (tools/taperlib/planning_cases.py tells the ranges): three stations; few vehicles, all connectors
under a tight limit, uneven vehicles, nearly full ones; lambda 1, 10, 100; with taper and without. 72 have each
combination once. TAPER_REFERENCE_PROBLEMS=600 takes more, TAPER_REFERENCE_SEED=N others. The firmware takes as many outer
iterations as it does of itself. `tools/reference.py --generated 72` makes a table of the same.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from taperlib.gaps import Gap, Solved
from taperlib.planner_probe import DEFAULT, Planned, plan_cold
from taperlib.planning_cases import SEED, draw

PROBLEMS = int(os.environ.get("TAPER_REFERENCE_PROBLEMS", 72))
CASES = [draw(number, int(os.environ.get("TAPER_REFERENCE_SEED", SEED))) for number in range(PROBLEMS)]
FIRST_STEP_PERCENT = 1.0  # of peak power
OBJECTIVE_PERCENT = 0.1
EXCESS = 1e-3  # over a limit, per unit: what the planner is held to in double precision


@pytest.fixture(scope="module")
def plans() -> list[Planned]:
    return plan_cold(Path(os.environ["TAPER_PLANNER_PROBE"]), CASES)


@pytest.mark.parametrize("number", range(PROBLEMS), ids=[case.name for case in CASES])
def test_a_plan_is_the_optimum(plans: list[Planned], number: int) -> None:
    gap: Gap = Solved.of(CASES[number]).gap(plans[number], DEFAULT)
    assert gap.usable
    assert gap.excess <= EXCESS
    assert gap.first_step_percent <= FIRST_STEP_PERCENT
    assert gap.objective_percent <= OBJECTIVE_PERCENT
