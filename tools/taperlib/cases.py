"""The site limit as a command-line choice: kW, a share of what the cars could take, or a CSV."""

import argparse
from dataclasses import dataclass
from pathlib import Path

from .limits import Limit, constant_limit, read_limit_csv
from .numbers import not_negative, positive
from .sessions import Session, peak_present

KW_PER_CAR = 7.2  # single phase, 30 A at 240 V: the connectors of the ACN-Data sites


@dataclass(frozen=True)
class SiteLimit:
    limit: Limit
    text: str
    simulator_arguments: tuple[str, ...]


def add_limit_arguments(parser: argparse.ArgumentParser, required: bool = True) -> None:
    group = parser.add_mutually_exclusive_group(required=required)
    group.add_argument("--limit-kw", type=not_negative, help="site limit [kW]")
    group.add_argument("--limit-share", type=positive,
                       help=f"site limit as a share of {KW_PER_CAR} kW for every car at the busiest moment")
    group.add_argument("--limit-csv", type=Path, help="CSV time_s,limit_kw: each limit holds until the next")


def shared_kw(share: float, sessions: list[Session]) -> float:
    """A share of what the cars could take at the busiest moment [kW]."""
    return round(share * peak_present(sessions) * KW_PER_CAR, 3)


def limit_of_options(options: argparse.Namespace, sessions: list[Session]) -> SiteLimit:
    if options.limit_csv is not None:
        limit = read_limit_csv(options.limit_csv)
        text = f"{options.limit_csv.name}, {limit.kw.min():g} to {limit.kw.max():g} kW"
        return SiteLimit(limit, text, ("--limit-csv", str(options.limit_csv)))
    if options.limit_kw is not None:
        kw, text = options.limit_kw, f"{options.limit_kw:g} kW"
    else:
        cars = peak_present(sessions)
        kw = shared_kw(options.limit_share, sessions)
        text = f"{kw:g} kW = {options.limit_share:g} x {cars} cars at once x {KW_PER_CAR} kW"
    return SiteLimit(constant_limit(kw), text, ("--limit-kw", str(kw)))
