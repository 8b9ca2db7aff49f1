#!/usr/bin/env python3
"""The most energy that any policy could deliver to these sessions: the clairvoyant linear programme.

It knows every arrival, departure and state of charge in advance, keeps the site limit and the taper of every vehicle,
with --station also the limits of its feeders and phases for the sessions that name their connector, and ignores the
number of connectors and minimum currents. taperlib/clairvoyant.py states it in full.
"""

import argparse
import sys
from pathlib import Path

from taperlib.cases import add_limit_arguments, limit_of_options
from taperlib.clairvoyant import clairvoyant_bound
from taperlib.feeders import feeder_rows
from taperlib.files import InputError
from taperlib.numbers import positive
from taperlib.sessions import read_sessions_csv, requested_kwh


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=Path, required=True, help="sessions CSV")
    add_limit_arguments(parser)
    parser.add_argument("--station", help="hold the limits of this station's feeder tree too (codegen/stations/NAME.toml)")
    parser.add_argument("--step-s", type=positive, default=900.0, help="step of the programme [s] (default 900)")
    parser.add_argument("--tick-s", type=positive,
                        help="the controller's tick [s]: the power follows the taper within a step (default: --step-s)")
    return parser


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    try:
        sessions = read_sessions_csv(options.sessions)
        site = limit_of_options(options, sessions)
        feeders = feeder_rows(options.station, sessions) if options.station else []
        bound = clairvoyant_bound(sessions, site.limit, options.step_s, options.tick_s, feeders)
    except InputError as error:
        print(f"bound: {error}", file=sys.stderr)
        return 1
    wanted_kwh = requested_kwh(sessions)
    print(f"sessions     {len(sessions)}")
    print(f"limit        {site.text}")
    print(f"requested    {wanted_kwh:.2f} kWh")
    print(f"bound        {bound.energy_kwh:.2f} kWh"
          + (f" ({100 * bound.energy_kwh / wanted_kwh:.2f} % of the request)" if wanted_kwh > 0 else ""))
    print(f"solved in    {bound.solve_s:.2f} s ({bound.variables} variables, {bound.constraints} constraints)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
