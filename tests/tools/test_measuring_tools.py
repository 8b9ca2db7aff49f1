"""The tools behind docs/results.md, on small cases: that they run, and that their figures add up."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

TOOLS = Path(__file__).resolve().parents[2] / "tools"
STATIONS = ("hub", "garage", "paper", "depot", "caltech")


def run(tool: str, *arguments: str) -> str:
    return subprocess.run([sys.executable, TOOLS / tool, *arguments], check=True, capture_output=True, text=True).stdout


def test_memory_has_a_row_for_every_station_and_real_type() -> None:
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in run("memory.py").splitlines()[2:]]
    assert {(row[0], row[1]) for row in rows} == {(s, r) for s in STATIONS for r in ("double", "float")}
    ram = {(row[0], row[1]): int(row[4].replace(",", "")) for row in rows}
    assert all(ram[station, "float"] < ram[station, "double"] for station in STATIONS)
    assert ram["hub", "float"] < ram["garage", "float"] < ram["depot", "float"] < ram["paper", "float"]


def test_the_benchmark_solves_the_same_problems_twice(tmp_path: Path) -> None:
    header = "session_id,connector,arrival_s,departure_s,battery_kwh,soc_arrival,soc_target,max_kw,taper_kw\n"
    rows = [f"car-{k},,{600 * k},{14400 + 600 * k},60,0.2,0.6,11,6\n" for k in range(6)]
    sessions = tmp_path / "sessions.csv"
    sessions.write_text(header + "".join(rows))
    output = run(
        "benchmark.py", "--sessions", str(sessions), "--station", "hub", "--limit-kw", "30",
        "--sim", os.environ["TAPER_SIM"], "--probe", os.environ["TAPER_PLANNER_PROBE"],
    )  # fmt: skip
    assert int(re.search(r"(\d+) problems of station hub", output).group(1)) > 10
    iterations = {name: int(re.search(rf"\| {name} \| (\d+) ", output).group(1))
                  for name in (r"firmware \(generated C\)", "osqp for Python")}
    assert all(10 <= count <= 500 for count in iterations.values())
