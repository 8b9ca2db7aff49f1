"""Runs all experiments of the project, or a campaign of one's own, and writes tables and a report.

Every case is one run of taper-sim or one clairvoyant bound. Finished ones are kept in build/study/cases, by a hash of
all that they depend on (inputs, options, the simulator itself), and not run again: to go on after an interruption, give
the same command again. The simulator is built first, in build/study/build, with all stations and horizons.

Work is spread by Dask over the cores of this machine, or with --scheduler over a cluster. On its machines, in the
project's folder, with HOST the one of the scheduler:

  PYTHONPATH=tools build/venv/bin/dask scheduler
  PYTHONPATH=tools build/venv/bin/dask worker tcp://HOST:8786 --nthreads 1 --nworkers auto

Workers need the project's folder at the path that it has here, with build/study/build, as it is after a study here (a
shared folder will do); each case checks that, and fails otherwise. Inputs and results go over the network; results are
kept here.
"""

import argparse
import os
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table as ScreenTable
from taperlib.files import InputError, write_atomically
from taperlib.numbers import whole_positive

from .campaign import __doc__ as CAMPAIGN_HELP
from .campaign import read_campaign
from .cases import Case, Job, job_of
from .catalogue import QUICK, all_sections
from .headlines import accept_headlines, broken_headlines
from .model import Results, Section
from .output import Found, table_csv, write_study
from .recipes import ROOT, Inputs
from .runner import CaseError, Where, run_jobs
from .simulator_build import FOLDER, build_simulator
from .store import Store
from .worker import Files, Programs

STUDY_OUT = ROOT / "docs" / "study"
EXIT_FAILED = 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="tools/study", description=__doc__, epilog=CAMPAIGN_HELP,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--section", nargs="+", metavar="NAME", help="only these sections (--list names them)")
    what.add_argument("--quick", action="store_true", help=f"only the sections {', '.join(QUICK)}")
    what.add_argument("--campaign", type=Path, metavar="FILE.toml",
                      help="stations x weeks x limits x policies of this file (see below)")
    what.add_argument("--list", action="store_true", help="name the sections, with the number of their cases, and end")
    parser.add_argument("--out", type=Path, help="folder of tables and report (default docs/study; of a part of the "
                        "sections or a campaign: build/study)")
    parser.add_argument("--data", type=Path, metavar="FOLDER", help="more weeks: acn-*.csv in this folder")
    parser.add_argument("--workers", type=whole_positive, default=os.cpu_count() or 1, metavar="N",
                        help="processes on this machine (default: one per core); 1: without Dask")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="run on this Dask cluster, such as tcp://10.0.0.1:8786")
    parser.add_argument("--sim", type=Path, metavar="FILE", help="a simulator that is there already; nothing is built")
    parser.add_argument("--cases", type=Path, default=FOLDER / "cases", metavar="FOLDER",
                        help="where finished cases are (default build/study/cases)")
    parser.add_argument("--results", type=Path, default=ROOT / "docs" / "results.md", metavar="FILE",
                        help="page with the headline numbers (default docs/results.md)")
    parser.add_argument("--accept", action="store_true",
                        help="write the headline numbers found into that page; its bounds must hold all the same")
    return parser


def _chosen_sections(options: argparse.Namespace, inputs: Inputs) -> list[Section]:
    sections = {section.name: section for section in all_sections(inputs)}
    names = QUICK if options.quick else options.section or list(sections)
    unknown = [name for name in names if name not in sections]
    if unknown:
        raise InputError(f"--section {unknown[0]}: there are {', '.join(sections)}")
    return [section for name, section in sections.items() if name in names]


def _simulator(options: argparse.Namespace, console: Console) -> Path:
    if options.sim is not None:
        if not options.sim.is_file():
            raise InputError(f"--sim {options.sim}: there is no such file")
        return options.sim.resolve()
    with console.status("building the simulator with all stations and horizons"):
        return build_simulator()


def _run(cases: list[Case], options: argparse.Namespace, inputs: Inputs, console: Console) -> Results:
    """All cases, those that are not finished anew."""
    programs, store = Programs.of(_simulator(options, console)), Store(options.cases.resolve())
    jobs: dict[str, Job] = {}
    keys: dict[Case, str] = {}
    for case in dict.fromkeys(cases):
        job = job_of(case, inputs)
        keys[case] = job.key(programs.sha256_for(case.policy))
        jobs[keys[case]] = job
    names = {key: case.text for case, key in keys.items()}
    new = {key: job for key, job in jobs.items() if not store.has(key)}
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
               TimeRemainingColumn())
    console.print(f"{len(jobs)} cases, {len(jobs) - len(new)} of them finished before", highlight=False)
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("running", total=len(jobs), completed=len(jobs) - len(new))

        def keep(key: str, files: Files) -> None:
            store.keep(key, files)
            progress.update(task, advance=1, description=f"ran {names[key]}"[:60])

        where = Where(options.workers, options.scheduler, FOLDER / "dask")
        try:
            if new:
                run_jobs(new, programs, where, keep)
        except CaseError as error:
            raise InputError(f"case '{names[error.key]}': {error}") from None
    return Results(inputs, {case: store.result(key) for case, key in keys.items()})


def _print_headlines(headlines: dict[str, float], console: Console) -> None:
    shown = ScreenTable(header_style="bold")
    shown.add_column("headline")
    shown.add_column("found", justify="right")
    for name, value in headlines.items():
        shown.add_row(name, f"{value:.3f}")
    console.print(shown)


def _study(options: argparse.Namespace, inputs: Inputs, console: Console) -> list[str]:
    """Returns the headlines that no longer hold, in words."""
    sections = _chosen_sections(options, inputs)
    whole = not options.quick and not options.section
    results = _run([case for section in sections for case in section.cases], options, inputs, console)
    found = [Found(section, section.outcome(results)) for section in sections]
    out = options.out or (STUDY_OUT if whole else FOLDER)
    write_study(found, out, whole)
    console.print(f"Report: {out / 'report.html'}", markup=False, highlight=False, soft_wrap=True)
    headlines = {name: value for each in found for name, value in each.outcome.headlines.items()}
    _print_headlines(headlines, console)
    if options.accept:
        accept_headlines(options.results, headlines)
    return broken_headlines(options.results, headlines, whole)


def _campaign(options: argparse.Namespace, inputs: Inputs, console: Console) -> None:
    campaign = read_campaign(options.campaign, inputs)
    results = _run(list(campaign.cases), options, inputs, console)
    path = (options.out or FOLDER) / f"{campaign.name}.csv"
    write_atomically(path, table_csv(campaign.table(results)))
    console.print(f"Table: {path}", markup=False, highlight=False, soft_wrap=True)


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    console, errors = Console(), Console(stderr=True)
    broken: list[str] = []
    try:
        inputs = Inputs(options.data)
        if options.list:
            for section in all_sections(inputs):
                console.print(f"{section.name:18} {len(set(section.cases)):4} cases  {section.title}", highlight=False)
        elif options.campaign:
            _campaign(options, inputs, console)
        else:
            broken = _study(options, inputs, console)
    except (InputError, OSError) as error:
        errors.print(f"study: {error}", markup=False, highlight=False, soft_wrap=True)
        return EXIT_FAILED
    except KeyboardInterrupt:
        errors.print("study: interrupted; the same command goes on where it was", markup=False)
        return EXIT_FAILED
    for reason in broken:
        errors.print(f"DOES NOT HOLD: {reason}", markup=False, highlight=False, soft_wrap=True)
    return EXIT_FAILED if broken else 0


if __name__ == "__main__":
    sys.exit(main())
