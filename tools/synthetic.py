#!/usr/bin/env python3
"""The synthetic day of Chen and Zhang, "State-of-Charge Aware EV Charging" (PES General Meeting 2022).

200 cars come during one day of 96 steps of 900 s. In the paper's units (kWh per step): battery 8, peak 0.6, site limit
14, and a car takes at most 0.6 - alpha * x when its battery holds x kWh. In physical units: 8 kWh, 2.4 kW, 56 kW, and
taper_kw = alpha * 8 kWh * 4 steps per hour.

The draws, from numpy's legacy RandomState(seed), each a vector over the cars, in this order:

  1. Poisson(9), the hour; sorted, times 4
  2. 0..3, the quarter of the hour; added, then the sum sorted again
  3. 6..35, the stay in steps; the departure is at most step 96 (midnight)
  4. U(0.8, 4), the energy in the battery at arrival [kWh]
  5. U(2, 6), the request [kWh]; the target is at most the battery

With the default seed, 124 cars are there at once, and the clairvoyant bound is 763.9 kWh (alpha 0.02), 757.8 kWh (0.03)
and 738.7 kWh (0.05).
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from taperlib.files import InputError
from taperlib.numbers import share
from taperlib.sessions import Session, peak_present, requested_kwh, write_sessions_csv

PAPER_SEED = 0x5EE2
PAPER_LIMIT_KW = 56.0
STEP_S = 900
STEPS_PER_HOUR = 4
STEPS_PER_DAY = 96
BATTERY_KWH = 8.0
PEAK_KWH_PER_STEP = 0.6


def synthetic_day(alpha: float, seed: int = PAPER_SEED, cars: int = 200) -> list[Session]:
    """The day's sessions, sorted by arrival. alpha: kWh per step that the peak drops per kWh in the battery."""
    rng = np.random.RandomState(seed)
    hour_step = np.sort(rng.poisson(9, cars)) * STEPS_PER_HOUR
    arrival_step = np.sort(hour_step + rng.randint(0, STEPS_PER_HOUR, cars))
    stay_steps = rng.randint(6, 36, cars)
    initial_kwh = rng.uniform(0.8, 4.0, cars)
    request_kwh = rng.uniform(2.0, 6.0, cars)
    departure_step = np.minimum(arrival_step + stay_steps, STEPS_PER_DAY)
    target_kwh = np.minimum(initial_kwh + request_kwh, BATTERY_KWH)
    return [
        Session(
            session_id=f"car-{car:03d}",
            arrival_s=int(arrival_step[car]) * STEP_S,
            departure_s=int(departure_step[car]) * STEP_S,
            battery_kwh=BATTERY_KWH,
            soc_arrival=round(float(initial_kwh[car]) / BATTERY_KWH, 6),
            soc_target=round(float(target_kwh[car]) / BATTERY_KWH, 6),
            max_kw=PEAK_KWH_PER_STEP * STEPS_PER_HOUR,
            taper_kw=alpha * BATTERY_KWH * STEPS_PER_HOUR,
        )
        for car in range(cars)
        if departure_step[car] > arrival_step[car]
    ]


def _alpha(text: str) -> float:
    value = share(text)
    steepest = PEAK_KWH_PER_STEP / BATTERY_KWH
    if value > steepest:
        raise argparse.ArgumentTypeError(f"'{text}' is above {steepest:g}: no power would be left for a full battery")
    return value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="sessions CSV to write")
    parser.add_argument("--alpha", type=_alpha, default=0.02, help="the taper; the paper has 0.02, 0.03, 0.05")
    parser.add_argument("--seed", type=lambda text: int(text, 0), default=PAPER_SEED, help="default 0x5ee2")
    return parser


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    sessions = synthetic_day(options.alpha, options.seed)
    try:
        write_sessions_csv(options.out, sessions)
    except (InputError, OSError) as error:
        print(f"synthetic: {error}", file=sys.stderr)
        return 1
    print(f"{options.out}: {len(sessions)} sessions, {requested_kwh(sessions):.1f} kWh requested, "
          f"{peak_present(sessions)} cars at once, site limit {PAPER_LIMIT_KW:g} kW")
    return 0


if __name__ == "__main__":
    sys.exit(main())
