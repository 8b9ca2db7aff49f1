"""The same as two_cars.c: two cars at the hub, one nearly full: an hour in periods of 20 minutes."""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "tools"))
from taperlib.scheduler import Scheduler, Vehicle  # noqa: E402

stored_kwh, need_kwh = [20.0, 54.0], [20.0, 5.0]


def told_of(car: int) -> Vehicle | None:
    if need_kwh[car] <= 0:
        return None
    return Vehicle(session=car + 1, need_kwh=need_kwh[car], departs_s=7200.0, max_kw=22.0, capacity_kwh=60.0,
                   stored_kwh=stored_kwh[car], peak_kw=110.0, taper_kw=110.0)


def charge(car: int, current_a: float, hours: float) -> None:
    taken_kw = min(current_a * 3 * 230 / 1000, 110 - 110 * stored_kwh[car] / 60)
    stored_kwh[car] += taken_kw * hours
    need_kwh[car] -= taken_kw * hours


with Scheduler("hub", period_s=1200, library=Path(os.environ["PREFIX"]) / "lib/libtaper_scheduler.so") as scheduler:
    scheduler.set_limit(30.0)
    for minute in range(0, 60, 20):
        for car in range(2):
            scheduler.set_vehicle(car, told_of(car))
        first, second = scheduler.plan(60.0 * minute)[:2]
        print(f"{minute:2d} min: {first.current_a:4.1f} A {second.current_a:4.1f} A")
        charge(0, first.current_a, 1 / 3)
        charge(1, second.current_a, 1 / 3)
