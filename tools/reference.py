#!/usr/bin/env python3
"""The paper's planning problem by the firmware and by an exact solver, side by side.

Chen and Zhang, "State-of-Charge Aware EV Charging" (arXiv 2111.15147), eq. 7 (policy soc-mpc-log) and, without the
taper, eq. 4 (policy mpc-log). In each planning instant, for the vehicles i that are there, the steps t = 0..T-1 of h
hours, the power p_it [kW], the energy E_it = h (p_i0 + .. + p_it) [kWh] and the energy wanted need_i [kWh]:

  maximise    sum of log p_it over the (i,t) in which i may charge - lambda sum_i (E_i,T-1 - need_i)^2
  subject to  0 <= p_it <= what connector, vehicle and site allow, times the share of the step that i stays   (eq. 1, 3)
              p_it <= peak_i - taper_i (stored energy + E_i,t-1) / capacity_i                                 (eq. 5)
              E_i,T-1 <= need_i
              sums of each feeder, and of the site, <= their limits                                           (eq. 2)

It is stated in CVXPY and solved by Clarabel with exponential cones (tools/taperlib/log_utility.py). The firmware solves
it as a few quadratic programmes, its outer iterations; the table tells how many are enough. Each problem is solved cold
by the firmware. Either the problems are those of a run of taper-sim over --sessions, or --generated draws them.

The table has, over all problems: the greatest difference of two powers of the first step, which is the one that is
carried out, in percent of the power of the strongest connector; the difference of the objective in percent of the
greater of the exact one and the number of logarithms; and medians of times: of the firmware, of Clarabel alone, of CVXPY
and Clarabel (statement, translation, solution), and how many times faster than that the firmware is.

With --timing all problems of the replay are instead planned in their order, each after the one before as in the firmware,
by throughput (soc-mpc) and by log utility (soc-mpc-log), and COUNT of them by CVXPY and Clarabel, at their own tolerances:
stated as a few products of matrices, and written out a vehicle at a time. Each time is the least of three. The firmware
always solves for all connectors of the station, CVXPY for the vehicles that are there: so there is a second line for the
problems of a station of which three quarters or more are taken, and COUNT of those.

Files in --out: gap.csv (the table) and problems.csv (each problem with each number of outer iterations), or timing.csv.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

from taperlib.cases import add_limit_arguments, limit_of_options
from taperlib.files import InputError, write_atomically
from taperlib.gaps import Gap, Line, Solved, csv_text, line_of
from taperlib.log_utility import SolverError
from taperlib.numbers import not_negative, positive, whole_positive
from taperlib.planner_probe import plan_cold
from taperlib.planner_times import Times, chosen, time_day, time_exact, times_of
from taperlib.planning_cases import SEED, Case, draw, evenly, read_problems
from taperlib.sessions import read_sessions_csv

ROOT = Path(__file__).resolve().parents[1]
SIMULATOR = Path("build/host-release/host_sim/taper-sim")
PROBE = Path("build/host-release/tests/planner/planner_probe")
OUTER_ITERATIONS = "1,2,3,4,6,8"
WIDTH = 140  # of the table, also where the terminal has less
MOST_OUTER_ITERATIONS = 20  # TAPER_MAX_OUTER_ITERATIONS


def _outer_iterations(text: str) -> list[int]:
    try:
        counts = [int(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of whole numbers") from None
    if any(not 1 <= count <= MOST_OUTER_ITERATIONS for count in counts):
        raise argparse.ArgumentTypeError(f"'{text}' has a number outside 1..{MOST_OUTER_ITERATIONS}")
    return counts


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--sessions", type=Path, help="sessions CSV: the planning problems of its replay")
    source.add_argument("--generated", type=whole_positive, metavar="COUNT",
                        help="draw so many problems instead, over three stations; 72 have every combination")
    parser.add_argument("--seed", type=int, default=SEED, help=f"of --generated (default {SEED})")
    add_limit_arguments(parser, required=False)
    parser.add_argument("--station", default="garage", help="one of codegen/stations (default garage)")
    parser.add_argument("--policy", choices=("soc-mpc-log", "mpc-log"), default="soc-mpc-log",
                        help="with the taper (eq. 7) or without (eq. 4) (default soc-mpc-log)")
    parser.add_argument("--lambda", dest="weight", type=not_negative, default=100.0,
                        help="weight of the squared energy missing [1/kWh2] (default 100)")
    parser.add_argument("--horizon-steps", type=whole_positive, help="steps that are planned (default: the station's)")
    parser.add_argument("--tick-s", type=positive, default=900.0, help="control tick of the replay [s] (default 900)")
    parser.add_argument("--problems", type=whole_positive, default=40, metavar="COUNT",
                        help="problems of the replay, evenly taken (default 40)")
    parser.add_argument("--outer-iterations", type=_outer_iterations, default=_outer_iterations(OUTER_ITERATIONS),
                        metavar="N,..", help=f"of the firmware, 1 to 20 each (default {OUTER_ITERATIONS})")
    parser.add_argument("--timing", action="store_true", help="compare times instead of plans, on the problems of a day")
    parser.add_argument("--out", type=Path, help="folder for the CSV files (default: none are written)")
    parser.add_argument("--sim", type=Path, default=ROOT / SIMULATOR, help=f"the simulator (default {SIMULATOR})")
    parser.add_argument("--probe", type=Path, default=ROOT / PROBE, help=f"the planner (default {PROBE})")
    return parser


def _recorded(options: argparse.Namespace) -> list[Case]:
    """The planning problems of a replay, all of them."""
    limit = limit_of_options(options, read_sessions_csv(options.sessions)).simulator_arguments
    horizon = [] if options.horizon_steps is None else ["--horizon-steps", str(options.horizon_steps)]
    with tempfile.TemporaryDirectory() as folder:
        problems = Path(folder) / "problems"
        command = [str(options.sim.absolute()), "--sessions", str(options.sessions), "--station", options.station, *limit,
                   *horizon, "--policy", options.policy, "--lambda", f"{options.weight:g}", "--tick-s", f"{options.tick_s:g}",
                   "--problems", str(problems)]
        try:
            run = subprocess.run(command, capture_output=True, text=True, check=False)
        except OSError as error:
            raise InputError(f"{options.sim}: cannot be started: {error.strerror}") from None
        if run.returncode != 0:
            raise InputError(f"{options.sim}: failed with exit code {run.returncode}: {run.stderr.strip()[-500:]}")
        return read_problems(problems)


def _replayed(options: argparse.Namespace) -> list[Case]:
    cases = _recorded(options)
    if not cases:
        raise InputError(f"{options.sessions}: no vehicle ever charges")
    return cases


def _cases(options: argparse.Namespace) -> list[Case]:
    if options.generated is not None:
        return [draw(number, options.seed) for number in range(options.generated)]
    cases = _replayed(options)
    return [cases[k] for k in evenly(len(cases), options.problems)]


def _solved(cases: list[Case], console: Console) -> list[Solved]:
    """The problems with their optima. One that the exact solver fails on is told and left out: it says nothing of the firmware."""
    solved = []
    for case in track(cases, "exact solver", console=console, transient=True):
        try:
            solved.append(Solved.of(case))
        except SolverError as error:
            print(f"reference: problem {case.name} is left out: {error}", file=sys.stderr)
    if not solved:
        raise SolverError("the exact solver has failed on every problem")
    return solved


def _gaps(options: argparse.Namespace, console: Console) -> list[list[Gap]]:
    """By number of outer iterations."""
    solved = _solved(_cases(options), console)
    found = []
    for outer in options.outer_iterations:
        plans = plan_cold(options.probe, [one.case for one in solved], outer)
        found.append([one.gap(planned, outer) for one, planned in zip(solved, plans)])
    return found


GAP_HEADINGS = ("outer\niterations", "problems", "without\na plan", "first step\nworst %", "first step\nmean %",
                "objective\nworst %", "objective\nmean %", "firmware\nms", "Clarabel\nms", "CVXPY +\nClarabel ms",
                "times\nfaster")


def _print_table(headings: tuple[str, ...], rows: list[list[str]], console: Console) -> None:
    table = Table(header_style="bold")
    for heading in headings:
        table.add_column(heading, justify="right")
    for row in rows:
        table.add_row(*row)
    Console(width=max(console.width, WIDTH)).print(table)


def _gap_row(line: Line) -> list[str]:
    return [
        str(line.outer_iterations), str(line.problems), str(line.without_plan),
        f"{line.first_step_worst_percent:.3f}", f"{line.first_step_mean_percent:.4f}",
        f"{line.objective_worst_percent:.4f}", f"{line.objective_mean_percent:.5f}",
        f"{line.firmware_ms:.2f}", f"{line.exact_solver_ms:.1f}", f"{line.exact_total_ms:.1f}", f"{line.times_faster:.1f}",
    ]


def _time_column(times: Times) -> dict[str, str]:
    def exact(ms: float) -> str:
        return f"{ms:.1f} ({times.times_faster(ms):.1f} x)"

    return {
        "problems": str(times.problems),
        "vehicles": f"{times.vehicles:g}",
        "soc-mpc, ms": f"{times.throughput_ms:.2f}",
        "soc-mpc-log, ms": f"{times.log_utility_ms:.2f} ({times.log_to_throughput:.2f} x)",
        "of these, by the exact solver": str(times.exact_problems),
        "vehicles there": f"{times.exact_vehicles:g}",
        "soc-mpc-log there, ms": f"{times.log_utility_on_those_ms:.2f}",
        "Clarabel, ms": exact(times.exact_solver_ms),
        "CVXPY of matrices and Clarabel, ms": exact(times.matrices_ms),
        "CVXPY written out and Clarabel, ms": exact(times.written_out_ms),
    }


def _print_times(lines: list[Times], console: Console) -> None:
    columns = [_time_column(times) for times in lines]
    rows = [[name, *(column[name] for column in columns)] for name in columns[0]]
    _print_table(("medians", *(times.which for times in lines)), rows, console)


def _compare_plans(options: argparse.Namespace, console: Console) -> None:
    gaps = _gaps(options, console)
    lines = [line_of(of_outer) for of_outer in gaps]
    if options.out is not None:
        write_atomically(options.out / "gap.csv", csv_text(lines, Line))
        write_atomically(options.out / "problems.csv", csv_text([gap for of_outer in gaps for gap in of_outer], Gap))
    _print_table(GAP_HEADINGS, [_gap_row(line) for line in lines], console)
    doubt = max(gap.exact_doubt_percent for gap in gaps[0])
    console.print(f"By their duality gaps, first steps of the exact plans are within {doubt:.3f} % of the optimum's.", soft_wrap=True)


def _compare_times(options: argparse.Namespace, console: Console) -> None:
    cases = _replayed(options)
    day = time_day(options.probe, cases)
    lines = []
    for which, places in day.groups().items():
        picked = track(chosen(places, options.problems), f"exact solver, {which}", console=console, transient=True)
        lines.append(times_of(which, day, places, {k: time_exact(cases[k]) for k in picked}))
    if options.out is not None:
        write_atomically(options.out / "timing.csv", csv_text(lines, Times))
    _print_times(lines, console)


def _check(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """What argparse does not: which options belong together."""
    limited = any(value is not None for value in (options.limit_kw, options.limit_share, options.limit_csv))
    if options.sessions is not None and not limited:
        parser.error("--sessions needs one of --limit-kw, --limit-share and --limit-csv")
    if options.generated is not None and options.timing:
        parser.error("--timing needs --sessions: the problems of a day in their order")


def main(arguments: list[str] | None = None) -> int:
    parser = _parser()
    options = parser.parse_args(arguments)
    _check(parser, options)
    console = Console()
    try:
        (_compare_times if options.timing else _compare_plans)(options, console)
    except (InputError, SolverError, OSError) as error:
        Console(stderr=True).print(f"reference: {error}", markup=False, highlight=False, soft_wrap=True)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
