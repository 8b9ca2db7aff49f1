"""What an image does when it runs: instructions and stack, measured by a short simulation that is always the same."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from taperlib.emulator import Emulator

SECONDS = 60
ARRIVAL_s = 3600
_HEAD = "session_id,connector,arrival_s,departure_s,expected_departure_s,battery_kwh,soc_arrival,soc_target,max_kw,taper_kw"

@dataclass(frozen=True)
class Scene:
    """A full station at a limit that is less than it could use."""

    station: str
    connectors: int
    limit_kw: float
    seconds: int = SECONDS

    def sessions(self) -> str:
        """A vehicle on every connector, all within a few seconds, and no two alike."""
        return "\n".join([_HEAD, *self._rows()]) + "\n"

    def _rows(self) -> Iterator[str]:
        leaves_s = ARRIVAL_s + self.seconds
        for k in range(self.connectors):
            soc = 0.15 + 0.05 * (k % 9)
            yield (f"v{k + 1},{k + 1},{ARRIVAL_s + k % 4},{leaves_s},{ARRIVAL_s + 3600 * (1 + k % 8)},"
                   f"{24 + 6 * (k % 7)},{soc:.2f},{soc + 0.4:.2f},7.2,4.32")

    def arguments(self, sessions: Path, tick_s: int, iterations: int) -> list[str]:
        return ["--station", self.station, "--sessions", str(sessions), "--policy", "soc-mpc", "--limit-kw",
                f"{self.limit_kw:g}", "--tick-s", str(tick_s), "--iterations", str(iterations)]


SCENES = {"hub": Scene("hub", 8, 20.0), "garage": Scene("garage", 54, 100.0, 130)}
WHOLE_SOLVE = 500


class RunFailed(Exception):
    """The simulation did not end well; its own words."""


def simulate(program: Path, image: Path, scene: Scene, iterations: int, folder: Path) -> dict:
    """summary.json of the scene on an emulated board."""
    sessions = folder / "sessions.csv"
    sessions.write_text(scene.sessions())
    board = Emulator(image)
    try:
        command = [str(program), *scene.arguments(sessions, 1, iterations), "--bus", f"slcan:127.0.0.1:{board.port}",
                   "--out", str(folder / "out")]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        if done.returncode != 0:
            raise RunFailed(f"{' '.join(command)}: {done.stderr.strip()}\n{board.text()}")
    finally:
        board.stop()
    return json.loads((folder / "out/summary.json").read_text())


def figures(program: Path, image: Path, scene: Scene, iterations: int, folder: Path) -> dict[str, int]:
    """Instructions and stack. One run is with the board's own slices, one with whole solves, so that most ticks have none."""
    short = simulate(program, image, scene, iterations, folder)
    whole = simulate(program, image, scene, WHOLE_SOLVE, folder)
    ticks, all_at_once = short["board"]["instructions_per_tick"], whole["board"]["instructions_per_tick"]
    solve = all_at_once["max"] - all_at_once["max_without_slice"]
    return {
        "tick_median": round(all_at_once["p50"]),
        "tick_worst_without_slice": max(ticks["max_without_slice"], all_at_once["max_without_slice"]),
        "tick_worst": ticks["max"],
        "poll_worst": short["board"]["max_instructions_per_poll"],
        "iteration": round(solve / whole["iterations"]["max"]),
        "stack_used_B": max(run["board"]["stack_used_b"] for run in (short, whole)),
    }


# ---- The same on the host, under valgrind


def host_figures(program: Path, scene: Scene, iterations: int, folder: Path) -> dict[str, int]:
    """Instructions of this machine; `program` is taper-sim in float without sanitizers. They repeat exactly."""
    sessions = folder / "sessions.csv"
    sessions.write_text(scene.sessions())
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={folder}/calls", "--collect-atstart=no",
               "--toggle-collect=taper_station_step", "--dump-after=taper_station_step", "--separate-threads=no",
               str(program), *scene.arguments(sessions, 1, iterations)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    if done.returncode != 0:
        raise RunFailed(f"{' '.join(command)}: {done.stderr.strip()}")
    steps = [Calls(path.read_text()) for path in sorted(folder.glob("calls.*"), key=lambda path: int(path.suffix[1:]))]
    return summary([step for step in steps if step.total > 0])


class Calls:
    """One dump of callgrind: a call of taper_station_step()."""

    def __init__(self, text: str) -> None:
        found = re.search(r"^(?:summary|totals): (\d+)", text, re.MULTILINE)
        self.total = int(found[1]) if found else 0
        self.iterations, self.iterating = inclusive(text, "taper_iterate", "update_xz_tilde")
        self.plans = "taper_planner_run" in text or "taper_planner_start" in text


def inclusive(text: str, function: str, counted: str) -> tuple[int, int]:
    """Calls of `counted`, and instructions of `function` with all that it calls."""
    names: dict[str, str] = {}
    counts = {function: 0, counted: 0}
    costs = {function: 0, counted: 0}
    callee = None
    lines = iter(text.splitlines())
    for line in lines:
        if found := re.match(r"(c?fn)=\((\d+)\)(?: (\S+))?", line):
            name = names.setdefault(found[2], (found[3] or "").removeprefix("taper_osqp_"))
            callee = name if found[1] == "cfn" else callee
        elif (found := re.match(r"calls=(\d+)", line)) and callee is not None:
            for wanted in counts:
                if callee == wanted or callee.endswith(f"_{wanted}"):
                    counts[wanted] += int(found[1])
                    costs[wanted] += int(next(lines).split()[-1])
    return counts[counted], costs[function]


def summary(steps: list[Calls]) -> dict[str, int]:
    """The figures of the host, of the dumps of a run."""
    without = sorted(step.total for step in steps if not step.plans)
    iterations, iterating = sum(step.iterations for step in steps), sum(step.iterating for step in steps)
    if not without or iterations == 0:
        raise RunFailed("callgrind saw no tick without a slice, or no iteration")
    return {
        "host_tick_median": without[len(without) // 2],
        "host_tick_worst_without_slice": without[-1],
        "host_tick_worst": max(step.total for step in steps),
        "host_iteration": round(iterating / iterations),
    }
