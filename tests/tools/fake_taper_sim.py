#!/usr/bin/env python3
"""TEST DOUBLE of the simulator, for the tests of tools/compare.py. It is not a model of anything: do not read results
from it. It takes the real one's arguments and writes files of the same form: the earliest to leave (or, for llf, the
shortest slack) gets all the power that its taper allows.

FAKE_SIM makes it misbehave: "fail:POLICY" exits with code 4, "exceed:POLICY" writes one step above the limit,
"boast:POLICY" also claims a higher limit in that step, "cut:POLICY" leaves steps.csv out.
"""

import argparse
import csv
import json
import os
import sys
from pathlib import Path

CONNECTORS = {"hub": 8, "garage": 54, "paper": 130, "depot": 60}


def parse():
    parser = argparse.ArgumentParser()
    for name in ("--sessions", "--policy", "--out"):
        parser.add_argument(name, required=True)
    parser.add_argument("--station", choices=CONNECTORS, required=True)
    parser.add_argument("--limit-kw", type=float, required=True)
    parser.add_argument("--tick-s", type=float, required=True)
    parser.add_argument("--price-csv")
    parser.add_argument("--price-weight", type=float)
    return parser.parse_args()


def simulate(cars, options):
    hours = options.tick_s / 3600
    steps = []
    for tick in range(int(max(float(car["departure_s"]) for car in cars) / options.tick_s) + 1):
        now = tick * options.tick_s
        there = [car for car in cars if float(car["arrival_s"]) <= now < float(car["departure_s"])]
        order = [(float(car["departure_s"]) + (car["short"] * 600 if options.policy == "llf" else 0), car)
                 for car in there]
        used = 0.0
        for _, car in sorted(order, key=lambda entry: entry[0])[:CONNECTORS[options.station]]:
            power = min(float(car["max_kw"]) - float(car["taper_kw"]) * car["soc"], options.limit_kw - used,
                        car["short"] / hours)
            used += power
            car["soc"] += power * hours / float(car["battery_kwh"])
            car["energy"] += power * hours
            car["short"] = max(car["short"] - power * hours, 0.0)
        steps.append([now, options.limit_kw, used, len(there), "PLAN"])
    return steps


def write_csv(path, header, rows):
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)


def main():
    options = parse()
    mood, _, moody_policy = os.environ.get("FAKE_SIM", "").partition(":")
    mood = mood if moody_policy == options.policy else ""
    with open(options.sessions, newline="") as file:
        cars = list(csv.DictReader(file))
    for car in cars:
        car["soc"], car["energy"] = float(car["soc_arrival"]), 0.0
        car["short"] = (float(car["soc_target"]) - car["soc"]) * float(car["battery_kwh"])
    if mood == "fail":
        print("taper-sim: the fake was told to fail", file=sys.stderr)
        return 4
    steps = simulate(cars, options)
    if mood in ("exceed", "boast"):
        steps[len(steps) // 2][2] = options.limit_kw + 0.5
    if mood == "boast":
        steps[len(steps) // 2][1] = options.limit_kw + 1.0
    out = Path(options.out)
    satisfied = [car["soc"] >= float(car["soc_target"]) - 0.01 for car in cars]
    solves = len(steps) if "mpc" in options.policy else 0
    some = {"p50": 50, "p99": 90, "max": 120} if solves else {"p50": 0, "p99": 0, "max": 0}
    (out / "summary.json").write_text(json.dumps({
        "policy": options.policy, "station": options.station, "sessions": len(cars),
        "requested_kwh": sum(car["energy"] + car["short"] for car in cars),
        "delivered_kwh": sum(car["energy"] for car in cars), "satisfied": sum(satisfied), "limit_violations": 0,
        "fallback_ticks": 0, "solves": solves, "iterations": some, "solve_ms": some,
        "peak_kw": max(step[2] for step in steps),
        "energy_cost": 0.2 * sum(car["energy"] for car in cars) if options.price_csv else None}))
    write_csv(out / "sessions.csv",
              ["session_id", "connector", "energy_kwh", "soc_departure", "satisfied", "short_kwh", "queued_s"],
              [[car["session_id"], 0, car["energy"], car["soc"], int(good), car["short"], 0]
               for car, good in zip(cars, satisfied)])
    if mood != "cut":
        write_csv(out / "steps.csv", ["time_s", "limit_kw", "power_kw", "active", "mode"], steps)
    return 0


if __name__ == "__main__":
    sys.exit(main())
