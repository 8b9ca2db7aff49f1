#!/usr/bin/env python3
"""Charging curves of 113 real vehicles (host_sim/data): how well few straight lines say them, and days made of them.

A vehicle tells a flat limit, the greatest power of its curve, and with 2 or 3 pieces one or two lines that fall with the
state of charge; the least of them is what a station plans with.

  curves.py fits --out FILE            one row per vehicle, pieces and way of fitting, and a summary on the terminal
  curves.py day --out FILE --pieces N  sessions of a day at a hub of DC chargers (tools/taperstudy/stations/dc_hub.toml)

taperlib/curves.py says how lines are fitted and what is drawn.
"""

import argparse
import csv
import io
import sys
from pathlib import Path

import numpy as np

from taperlib.charge_curve import most_kw
from taperlib.curves import FITS, PIECES, VEHICLES_CSV, FitError, Vehicle, dc_day, fit_error, fit_lines, read_vehicles
from taperlib.files import InputError, write_atomically
from taperlib.numbers import positive, whole_positive
from taperlib.sessions import peak_present, requested_kwh, write_sessions_csv

HEAD = ("vehicle_id", "name", "battery_kwh", "most_kw", "fit", "pieces", "max_kw", "taper_kw", "second_max_kw",
        "second_taper_kw", "rms_percent", "worst_percent", "above_percent", "below_percent")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    fits = commands.add_parser("fits", help="errors of the fits, by vehicle")
    fits.add_argument("--out", type=Path, required=True, help="CSV to write")
    fits.add_argument("--curves", type=Path, default=VEHICLES_CSV, help="CSV of curves (default: that of host_sim/data)")
    day = commands.add_parser("day", help="sessions of a day")
    day.add_argument("--out", type=Path, required=True, help="sessions CSV to write")
    day.add_argument("--seed", type=lambda text: int(text, 0), default=0, help="of all that is drawn (default 0)")
    day.add_argument("--pieces", type=int, choices=PIECES, default=3,
                     help="what vehicles tell: the flat limit alone, with one line, with two (default 3)")
    day.add_argument("--fit", choices=FITS, default=FITS[0], help=f"how lines are fitted (default {FITS[0]})")
    day.add_argument("--cars", type=whole_positive, default=200, help="that come; some find no place (default 200)")
    day.add_argument("--connectors", type=whole_positive, default=12, help="places (default 12)")
    day.add_argument("--cap-kw", type=positive, default=150.0, help="what a connector can give [kW] (default 150)")
    return parser


def _row(vehicle: Vehicle, fit: str, pieces: int) -> tuple[list[str], FitError]:
    lines = fit_lines(vehicle.curve, pieces - 1, fit)
    error = fit_error(vehicle.curve, lines)
    told = [f"{value:.10g}" for line in lines for value in line]
    shares = (error.rms_share, error.worst_share, error.above_share, error.below_share)
    row = [vehicle.vehicle_id, vehicle.name, f"{vehicle.battery_kwh:g}", f"{most_kw(vehicle.curve):g}", fit, str(pieces),
           *told, *[""] * (4 - len(told)), *(f"{100 * share:.2f}" for share in shares)]
    return row, error


def _summary(fit: str, pieces: int, errors: list[FitError]) -> str:
    rms, worst = (100 * np.array([getattr(error, name) for error in errors]) for name in ("rms_share", "worst_share"))
    above, below = (100 * np.mean([getattr(error, name) for error in errors]) for name in ("above_share", "below_share"))
    return (f"{fit:6} {pieces}  {np.median(rms):6.2f} {np.quantile(rms, 0.9):6.2f} {rms.max():6.2f}   "
            f"{np.median(worst):6.1f} {np.quantile(worst, 0.9):6.1f} {worst.max():6.1f}   {above:6.2f} {below:6.2f}")


def _fits(options: argparse.Namespace) -> None:
    vehicles = read_vehicles(options.curves)
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(HEAD)
    summary = []
    for fit in FITS:
        for pieces in PIECES:
            rows, errors = zip(*(_row(vehicle, fit, pieces) for vehicle in vehicles), strict=True)
            writer.writerows(rows)
            summary.append(_summary(fit, pieces, list(errors)))
    write_atomically(options.out, buffer.getvalue())
    print(f"{options.out}: {len(vehicles)} vehicles")
    print("            rms, % of most kW      worst, % of most kW    energy, %\n"
          "fit pieces  median    90%  worst   median    90%  worst    above  below")
    print("\n".join(summary))


def _day(options: argparse.Namespace) -> None:
    sessions = dc_day(options.seed, options.pieces, options.cars, options.connectors, options.fit,
                      options.cap_kw)
    write_sessions_csv(options.out, sessions)
    print(f"{options.out}: {len(sessions)} sessions, {requested_kwh(sessions):.1f} kWh requested, "
          f"{peak_present(sessions)} cars at once, {options.cars - len(sessions)} found no place")


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    try:
        (_fits if options.command == "fits" else _day)(options)
    except (InputError, OSError) as error:
        print(f"curves: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
