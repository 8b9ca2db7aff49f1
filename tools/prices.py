#!/usr/bin/env python3
"""A day-ahead price of energy, hour by hour, for taper-sim --price-csv: synthetic, with the shape that such prices have.

Every day is the sum of a base, a peak in the morning (8 h) and a higher one in the evening (19 h), a valley at midday
(13 h), where the sun delivers, and one in the night (3 h). All are bells of a few hours. On Saturdays and Sundays the
morning peak is a third and the midday valley deeper. Each day's peaks and valleys are as high as a factor says that is
drawn from the seed, each hour has a little noise, and the valley may go below 0. No market's data is in it.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from taperlib.files import write_atomically
from taperlib.numbers import positive, whole_positive

HOURS_PER_DAY = 24
SECONDS_PER_HOUR = 3600
DAYS = ("mon", "tue", "wed", "thu", "fri", "sat", "sun")
# Hour, width [h], height as a share of the mean price: on working days, and at the weekend.
BELLS = ((8, 1.6, 0.55, 0.18), (19, 2.0, 0.85, 0.75), (13, 2.4, -0.55, -0.85), (3, 2.6, -0.35, -0.30))
SPREAD_OF_DAYS = 0.25
SPREAD_OF_HOURS = 0.03


def day_ahead(days: int, mean: float, seed: int, first_day: str) -> np.ndarray:
    """The price of every hour, per kWh, rounded to the thousandths that the bus carries."""
    random = np.random.RandomState(seed)  # its draws are the same in every version of numpy
    hours = np.arange(HOURS_PER_DAY)
    prices = []
    for day in range(days):
        weekend = (DAYS.index(first_day) + day) % 7 >= 5
        shape = np.ones(HOURS_PER_DAY)
        for hour, width, work, rest in BELLS:
            away = np.minimum(np.abs(hours - hour), HOURS_PER_DAY - np.abs(hours - hour))
            factor = 1 + SPREAD_OF_DAYS * random.standard_normal()
            shape += factor * (rest if weekend else work) * np.exp(-0.5 * (away / width) ** 2)
        prices.append(mean * (shape + SPREAD_OF_HOURS * random.standard_normal(HOURS_PER_DAY)))
    return np.round(np.concatenate(prices), 3)


def price_csv(prices: np.ndarray) -> str:
    rows = [f"{hour * SECONDS_PER_HOUR},{price:.3f}" for hour, price in enumerate(prices)]
    return "\n".join(["time_s,price_per_kwh", *rows]) + "\n"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="CSV to write: time_s,price_per_kwh; second 0 is midnight")
    parser.add_argument("--days", type=whole_positive, default=8, help="how many (default 8)")
    parser.add_argument("--mean", type=positive, default=0.20, help="price per kWh without peaks and valleys (default 0.20)")
    parser.add_argument("--first-day", choices=DAYS, default="sun",
                        help="weekday of the first day (default sun, as in the weeks of host_sim/data)")
    parser.add_argument("--seed", type=int, default=0, help="of days and hours (default 0)")
    return parser


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    prices = day_ahead(options.days, options.mean, options.seed, options.first_day)
    write_atomically(options.out, price_csv(prices))
    print(f"{options.out}: {prices.size} hours, {prices.min():.3f} to {prices.max():.3f}, mean {prices.mean():.3f} per kWh")
    return 0


if __name__ == "__main__":
    sys.exit(main())
