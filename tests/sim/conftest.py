"""Runs taper-sim, whose path is in the environment variable TAPER_SIM, on cases that the tests write down."""

import csv
import io
import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

REQUIRED = ("session_id", "connector", "arrival_s", "departure_s", "battery_kwh", "soc_arrival", "soc_target",
            "max_kw", "taper_kw")
TOLD = "expected_departure_s"
OPTIONAL = (TOLD, "phases", "second_max_kw", "second_taper_kw", "curve")


def session(session_id, **changed):
    """A session as a row: a car of 40 kWh that comes at 0 s, stays 4 h, and wants 8 kWh at up to 7 kW."""
    row = dict(session_id=session_id, connector="", arrival_s=0, departure_s=4 * 3600, battery_kwh=40,
               soc_arrival=0.5, soc_target=0.7, max_kw=7, taper_kw=4)
    assert set(changed) <= {*row, *OPTIONAL}
    return row | changed


def csv_text(rows, columns=None):
    if columns is None:
        columns = REQUIRED + tuple(name for name in OPTIONAL if any(name in row for row in rows))
    stream = io.StringIO()
    writer = csv.DictWriter(stream, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def read_csv(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@dataclass(frozen=True)
class Run:
    code: int
    stdout: str
    stderr: str
    out: Path

    @property
    def summary(self):
        return json.loads((self.out / "summary.json").read_text())

    @property
    def sessions(self):
        return {row["session_id"]: row for row in read_csv(self.out / "sessions.csv")}

    @property
    def steps(self):
        return read_csv(self.out / "steps.csv")

    @property
    def connectors(self):
        return read_csv(self.out / "connectors.csv")

    def of_session(self, session_id):
        """The ticks of one session."""
        return [row for row in self.connectors if row["session_id"] == session_id]


class Simulator:
    def __init__(self, program, folder):
        self.program = program
        self.folder = folder

    def call(self, *arguments, out="out"):
        """Run with these arguments as they are, in an empty folder of the test."""
        done = subprocess.run([self.program, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True,
                              timeout=120, check=False)
        return Run(done.returncode, done.stdout, done.stderr, self.folder / out)

    def write(self, name, text):
        (self.folder / name).write_text(text, encoding="utf-8", newline="")
        return name

    def run(self, rows, *arguments, policy="edf", station="hub", out="out"):
        """Replay rows (or the text of a file) and write the results to `out`."""
        text = rows if isinstance(rows, str) else csv_text(rows)
        self.write("sessions.csv", text)
        return self.call("--sessions", "sessions.csv", "--policy", policy, "--station", station, "--out", out,
                         *arguments, out=out)

    def files(self):
        """Everything below the folder."""
        return sorted(str(path.relative_to(self.folder)) for path in self.folder.rglob("*"))


@pytest.fixture
def sim(tmp_path):
    program = os.environ.get("TAPER_SIM")
    if not program:
        pytest.fail("TAPER_SIM does not say where taper-sim is")
    return Simulator(str(Path(program).resolve()), tmp_path)


def has_planner(simulator):
    """Whether the planner was built in."""
    simulator.write("none.csv", csv_text([]))
    has = "has no planner" not in simulator.call("--sessions", "none.csv", "--policy", "soc-mpc").stderr
    assert has == (os.environ["TAPER_WITH_PLANNER"] == "ON"), "the program is not what the build was told to make"
    return has


@pytest.fixture
def planning_sim(sim):
    if not has_planner(sim):
        pytest.skip("this build leaves the planner out")
    return sim
