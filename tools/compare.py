#!/usr/bin/env python3
"""Runs charging policies on the same sessions and compares them with the clairvoyant bound and with each other.

Writes table.csv, comparison.json, report.html (opens without a network) and the simulator's output, runs/POLICY/, to
--out. Exit code: 0 all well; 1 a run failed, and nothing was written; 2 wrong usage; 3 some step had more power than
the site limit: the report is written and says so.
"""

import argparse
import shutil
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from taperlib.cases import SiteLimit, add_limit_arguments, limit_of_options
from taperlib.clairvoyant import clairvoyant_bound
from taperlib.feeders import feeder_rows, station_file
from taperlib.files import InputError
from taperlib.measures import Measures, measures_of, rows_above_limit
from taperlib.numbers import not_negative, positive, share
from taperlib.report import Comparison, cell_text, headings_of, write_comparison
from taperlib.sessions import read_sessions_csv, requested_kwh
from taperlib.simulator import POLICIES, Run, SimulationError, run_policy

ROOT = Path(__file__).resolve().parents[1]
DEFAULT_SIMULATOR = Path("build/host-release/host_sim/taper-sim")
PARALLEL_RUNS = 2
BOUND_STEP_S = 900.0
WIDTH_OF_ALL_COLUMNS = 160
MAIN_COLUMNS = ("policy", "energy_kwh", "share_of_bound_percent", "satisfied", "violations", "solve_ms_p50", "cost")
EXIT_RUN_FAILED, EXIT_LIMIT_EXCEEDED = 1, 3


def _policies(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names or len(set(names)) != len(names):
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of different policies")
    if any("/" in name or name.startswith((".", "-")) for name in names):
        raise argparse.ArgumentTypeError(f"'{text}' holds something that is not a policy's name")
    return names


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=Path, required=True, help="sessions CSV")
    add_limit_arguments(parser)
    parser.add_argument("--station", default="garage", help="one of codegen/stations (default garage)")
    parser.add_argument("--tick-s", type=positive, default=60.0, help="control tick [s] (default 60)")
    parser.add_argument("--min-current-a", type=not_negative, help="least current of a connector that charges [A]")
    parser.add_argument("--price-csv", type=Path, help="CSV time_s,price_per_kwh: each price holds until the next")
    parser.add_argument("--price-weight", type=share,
                        help="weight of the price against having energy early, 0 to 1 (default: the station's)")
    parser.add_argument("--policies", type=_policies, default=list(POLICIES),
                        help=f"comma-separated (default {','.join(POLICIES)})")
    parser.add_argument("--out", type=Path, default=Path("build/compare"), help="folder (default build/compare)")
    parser.add_argument("--sim", type=Path, default=ROOT / DEFAULT_SIMULATOR,
                        help=f"the simulator (default {DEFAULT_SIMULATOR} in this repository)")
    parser.add_argument("--title", help="heading of the report (default: the name of the sessions file)")
    return parser


def _simulator_arguments(options: argparse.Namespace, site: SiteLimit) -> list[str]:
    arguments = ["--sessions", str(options.sessions), "--station", options.station, *site.simulator_arguments,
                 "--tick-s", f"{options.tick_s:g}"]
    if options.min_current_a is not None:
        arguments += ["--min-current-a", f"{options.min_current_a:g}"]
    if options.price_csv is not None:
        arguments += ["--price-csv", str(options.price_csv)]
    if options.price_weight is not None:
        arguments += ["--price-weight", f"{options.price_weight:g}"]
    return arguments


def _price_text(options: argparse.Namespace) -> str | None:
    if options.price_csv is None:
        return None
    weight = "" if options.price_weight is None else f" with weight {options.price_weight:g}"
    return options.price_csv.name + weight


def _run_all(options: argparse.Namespace, arguments: list[str], folder: Path, progress: Progress) -> list[Run]:
    """All policies, in the order asked for. The first failure cancels those that have not started."""
    task = progress.add_task("simulating", total=len(options.policies))
    runs: dict[str, Run] = {}
    with ThreadPoolExecutor(PARALLEL_RUNS) as pool:
        futures = [pool.submit(run_policy, options.sim, policy, arguments, folder / policy)
                   for policy in options.policies]
        try:
            for future in as_completed(futures):
                run = future.result()
                runs[run.policy] = run
                progress.update(task, advance=1, description=f"simulated {run.policy}")
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [runs[policy] for policy in options.policies]


def _compare(options: argparse.Namespace, runs_folder: Path, console: Console) -> Comparison:
    sessions = read_sessions_csv(options.sessions)
    site = limit_of_options(options, sessions)
    console.print(f"{len(sessions)} sessions, {requested_kwh(sessions):,.1f} kWh requested; limit {site.text}",
                  highlight=False)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        bound_task = progress.add_task("clairvoyant bound", total=1)
        feeders = feeder_rows(options.station, sessions) if station_file(options.station).is_file() else []
        bound = clairvoyant_bound(sessions, site.limit, max(BOUND_STEP_S, options.tick_s), options.tick_s, feeders)
        progress.update(bound_task, completed=1)
        runs = _run_all(options, _simulator_arguments(options, site), runs_folder, progress)
    return Comparison(
        title=options.title or f"Charging policies on {options.sessions.stem}",
        station=options.station,
        sessions_file=options.sessions.name,
        limit_text=site.text,
        price_text=_price_text(options),
        tick_s=options.tick_s,
        bound_kwh=bound.energy_kwh,
        bound_solve_s=bound.solve_s,
        sessions=sessions,
        runs=runs,
        table=[measures_of(sessions, run, site.limit, bound.energy_kwh) for run in runs],
        problems=[problem for run in runs for problem in rows_above_limit(run, site.limit)],
    )


def _print_table(table: list[Measures], bound_kwh: float, console: Console) -> None:
    """All columns where they fit; in a narrower terminal those that matter most, the rest is in the report."""
    fits = console.width >= WIDTH_OF_ALL_COLUMNS or not console.is_terminal
    headings = [heading for heading in headings_of(table) if fits or heading[0] in MAIN_COLUMNS]
    caption = f"Clairvoyant bound: {bound_kwh:,.1f} kWh" + ("" if fits else "; more columns in the report")
    shown = Table(caption=caption, caption_justify="left", header_style="bold")
    for name, heading, unit in headings:
        shown.add_column(f"{heading}\n{unit}" if unit else heading, justify="left" if name == "policy" else "right",
                         no_wrap=True)
    for row in table:
        shown.add_row(*(cell_text(row, name) for name, _, _ in headings),
                      style="bold red" if row.violations > 0 else None)
    Console(width=max(console.width, WIDTH_OF_ALL_COLUMNS) if fits else None).print(shown)


def _publish(comparison: Comparison, new_runs: Path, folder: Path) -> None:
    write_comparison(comparison, folder)
    shutil.rmtree(folder / "runs", ignore_errors=True)
    new_runs.rename(folder / "runs")


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    console = Console()
    errors = Console(stderr=True)
    if not options.sim.is_file():
        errors.print(f"compare: there is no simulator at {options.sim}. Build it, or name it with --sim.", markup=False)
        return EXIT_RUN_FAILED
    options.sim = options.sim.resolve()
    try:
        options.out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".runs-", dir=options.out) as scratch:
            new_runs = Path(scratch) / "runs"
            comparison = _compare(options, new_runs, console)
            _publish(comparison, new_runs, options.out)
    except (InputError, SimulationError, OSError) as error:
        errors.print(f"compare: {error}", markup=False, highlight=False, soft_wrap=True)
        return EXIT_RUN_FAILED
    _print_table(comparison.table, comparison.bound_kwh, console)
    console.print(f"Report: {options.out / 'report.html'}", markup=False, highlight=False, soft_wrap=True)
    for problem in comparison.problems[:10]:
        errors.print(f"LIMIT EXCEEDED {problem}", style="bold red", markup=False, highlight=False, soft_wrap=True)
    reported = [row.policy for row in comparison.table if row.violations > 0]
    if reported:
        errors.print(f"compare: the site limit was exceeded under {', '.join(reported)}", markup=False)
        return EXIT_LIMIT_EXCEEDED
    return 0


if __name__ == "__main__":
    sys.exit(main())
