#!/usr/bin/env python3
"""Taper in a world that is not ours: ACN-Sim, the simulator of acnportal, with its Caltech network, against its algorithms.

Every algorithm charges the same cars in the same 54 sockets, in periods of 5 minutes: acnportal's network (three primary and
three secondary lines of a delta-wye transformer, two pods), its EVSEs, its batteries of two stages. Taper comes as a library
(host_sim/scheduler/README.md). The day is generated from --seed, or a recorded week with --week.

The exit code is 0 only if Taper violates no constraint of the network in any period, in pilots and in what was drawn, and
delivers no less energy than the best of acnportal's sorted algorithms. Energy counts up to what was requested; less by no
more than ACN-Sim's own threshold of a full charge, 1 Wh a session, counts as equal.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path

from rich.console import Console
from rich.table import Table

from import_acn import REQUEST_COLUMNS, draw_battery, read_acn_csv
from taperlib import acn_world as world
from taperlib.acn_taper import TaperScheduling
from taperlib.acn_world import PERIOD_MIN, PERIODS_PER_HOUR, Outcome, Stay, algorithms
from taperlib.files import InputError, write_atomically
from taperlib.numbers import positive, whole_positive
from taperlib.scheduler import DEFAULT_LIBRARY, POLICIES, SchedulerError

Make = Callable[[], algorithms.BaseAlgorithm]

SORTS = {
    "edf": algorithms.earliest_deadline_first,
    "llf": algorithms.least_laxity_first,
    "fcfs": algorithms.first_come_first_served,
    "lcfs": algorithms.last_come_first_served,
    "lrpt": algorithms.largest_remaining_processing_time,
}
ROUND_ROBIN_STEP_A = 1.0  # acnportal's 0.1 A takes a minute a day, for the same result
SOCKET_KW = world.VOLTAGE_V * 32 / 1000


def sorted_algorithms(names: Sequence[str]) -> dict[str, Make]:
    made: dict[str, Make] = {name: lambda sort=sort: algorithms.SortedSchedulingAlgo(sort)
                             for name, sort in SORTS.items() if name in names}
    if "round-robin" in names:
        made["round-robin"] = lambda: algorithms.RoundRobin(SORTS["edf"], continuous_inc=ROUND_ROBIN_STEP_A)
    return made


def _period(time: datetime, midnight: datetime) -> int:
    return int((time - midnight).total_seconds() // (60 * PERIOD_MIN))


def recorded_week(path: Path, stations: Sequence[str], seed: int) -> list[Stay]:
    """
    A CSV of ACN-Data, each session at its own socket, wanting what it was delivered. Batteries are drawn as by
    tools/import_acn.py. Times are rounded down to periods; a socket has one vehicle at a time.
    """
    rows = sorted(read_acn_csv(path, REQUEST_COLUMNS["delivered"]), key=lambda row: row.arrival)
    midnight = rows[0].arrival.replace(hour=0, minute=0, second=0, microsecond=0)
    stays: list[Stay] = []
    free_from: dict[str, int] = {}
    for row in rows:
        if row.station_id not in stations:
            raise InputError(f"{path}: session {row.session_id}: '{row.station_id}' is none of the network's stations")
        arrival = max(_period(row.arrival, midnight), free_from.get(row.station_id, 0))
        departure = max(_period(row.departure, midnight), arrival + 1)
        free_from[row.station_id] = departure
        battery = draw_battery(row.session_id, row.request_kwh, seed)
        stays.append(Stay(row.session_id, row.station_id, arrival, departure, row.request_kwh, battery.kwh,
                          battery.soc_arrival * battery.kwh, SOCKET_KW))
    return stays


def until(stays: Sequence[Stay], hour: float) -> list[Stay]:
    """Whoever would come later does not, and whoever would stay longer leaves then."""
    end = int(hour * PERIODS_PER_HOUR)
    return [replace(stay, departure=min(stay.departure, end)) for stay in stays if stay.arrival < end]


def stays_of(options: argparse.Namespace, seed: int) -> list[Stay]:
    stations = world.network_of(options.evse == "continuous", options.transformer_kw).station_ids
    if options.week is not None:
        stays = recorded_week(options.week, stations, seed)
    else:
        stays = world.generated_day(stations, options.cars, seed)
    return until(stays, options.until_hour) if options.until_hour is not None else stays


def run_taper(options: argparse.Namespace, stays: Sequence[Stay], policy: str) -> Outcome:
    taper = TaperScheduling(policy=policy, tells_soc=options.soc, fill=options.fill, library=options.library)
    try:
        network = world.network_of(options.evse == "continuous", options.transformer_kw)
        return world.run(f"taper {policy}", taper, network, stays)
    finally:
        taper.close()


def outcomes_of(options: argparse.Namespace, seed: int) -> list[Outcome]:
    stays = stays_of(options, seed)
    others = sorted_algorithms(options.algorithms)
    if options.uncontrolled:
        others["uncontrolled"] = algorithms.UncontrolledCharging
    outcomes = [run_taper(options, stays, policy) for policy in POLICIES]
    for name, make in others.items():
        network = world.network_of(options.evse == "continuous", options.transformer_kw)
        outcomes.append(world.run(name, make(), network, stays))
    return outcomes


def verdict(outcomes: Sequence[Outcome], names: Sequence[str]) -> list[str]:
    """What speaks against Taper; empty: nothing does."""
    taper = outcomes[0]
    best = max((one for one in outcomes if one.name in names), key=lambda one: one.delivered_kwh)
    wrong = []
    if taper.violations > 0:
        wrong.append(f"{taper.name} violates constraints in {taper.of_pilots.periods} periods by its pilots and in "
                     f"{taper.of_rates.periods} by what was drawn")
    if taper.delivered_kwh < best.delivered_kwh - world.FULL_KWH * taper.sessions:
        wrong.append(f"{taper.name} delivers {taper.delivered_kwh:.2f} kWh, "
                     f"less than {best.name} with {best.delivered_kwh:.2f}")
    return wrong


# ---- Output


def _of(violations: world.Violations) -> str:
    return f"{violations.periods} ({violations.most_a:.1f} A)" if violations.periods else "0"


def table_of(outcomes: Sequence[Outcome], title: str) -> Table:
    table = Table(title=title)
    for name in ("algorithm", "energy", "of requested", "satisfied", "peak", "fullest limit", "violated by pilots",
                 "by currents", "call, median", "longest"):
        table.add_column(name, justify="left" if name == "algorithm" else "right")
    for one in outcomes:
        table.add_row(one.name, f"{one.delivered_kwh:.2f} kWh", f"{100 * one.delivered_kwh / one.requested_kwh:.3f} %",
                      f"{one.satisfied} of {one.sessions}", f"{one.peak_a:.0f} A", f"{100 * one.utilisation:.1f} %",
                      _of(one.of_pilots), _of(one.of_rates), f"{one.call_ms:.1f} ms", f"{one.slowest_ms:.0f} ms")
    return table


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1, help="of the day, or of the week's batteries (default 1)")
    parser.add_argument("--seeds", type=whole_positive, default=1, help="so many days, with seeds from --seed on (default 1)")
    parser.add_argument("--cars", type=whole_positive, default=110, help="that come in the generated day (default 110)")
    parser.add_argument("--week", type=Path,
                        help="CSV of ACN-Data at Caltech instead, such as host_sim/data/acn-caltech-2019-07-14.csv")
    parser.add_argument("--until-hour", type=positive, help="end then, counted from the first midnight (default: all have left)")
    parser.add_argument("--transformer-kw", type=positive, default=150.0, help="capacity of the transformer (default 150)")
    parser.add_argument("--evse", choices=("continuous", "real"), default="continuous",
                        help="pilots of any current, or the steps of the garage's AeroVironment and ClipperCreek EVSEs "
                             "(default continuous)")
    parser.add_argument("--no-soc", dest="soc", action="store_false",
                        help="Taper is told request and departure alone, as the sorted algorithms are")
    parser.add_argument("--no-fill", dest="fill", action="store_false",
                        help="leave to rounding and to the linear rows what they cost (host_sim/scheduler/README.md)")
    parser.add_argument("--algorithms", type=lambda text: text.split(","), default=[*SORTS, "round-robin"],
                        help=f"acnportal's, with commas between (default {','.join([*SORTS, 'round-robin'])})")
    parser.add_argument("--uncontrolled", action="store_true", help="and charging without any control, for scale")
    parser.add_argument("--library", type=Path, default=DEFAULT_LIBRARY,
                        help="libtaper_scheduler.so (default: that of host-release)")
    parser.add_argument("--out", type=Path, help="JSON to write: all that the tables say")
    return parser


def _check(options: argparse.Namespace) -> None:
    unknown = [name for name in options.algorithms if name not in (*SORTS, "round-robin")]
    if unknown or not options.algorithms:
        raise InputError(f"--algorithms: '{','.join(unknown)}' is none of {', '.join([*SORTS, 'round-robin'])}")


def compare(options: argparse.Namespace, console: Console) -> list[str]:
    """Runs all seeds, shows and writes what came out; what speaks against Taper."""
    wrong: list[str] = []
    days: list[dict[str, object]] = []
    for seed in range(options.seed, options.seed + options.seeds):
        outcomes = outcomes_of(options, seed)
        what = options.week.name if options.week is not None else "generated day"
        title = f"{what}, seed {seed}, {options.evse} pilots, transformer of {options.transformer_kw:g} kW"
        console.print(table_of(outcomes, title))
        wrong += [f"seed {seed}: {line}" for line in verdict(outcomes, options.algorithms)]
        days.append({"seed": seed, "outcomes": [asdict(one) for one in outcomes]})
    if options.out is not None:
        write_atomically(options.out, json.dumps({"days": days, "wrong": wrong}, indent=1) + "\n")
    return wrong


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    try:
        _check(options)
        wrong = compare(options, Console(width=150))
    except (InputError, SchedulerError, OSError) as error:
        print(f"acnsim: {error}", file=sys.stderr)
        return 1
    for line in wrong:
        print(f"acnsim: {line}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
