"""What a worker does: runs one job in a folder of its own, and returns what it left as bytes.

A worker needs the project's folder and the simulator at the same paths as on the machine that asks, and the same
versions of both; it checks that before it runs.
"""

import functools
import gzip
import hashlib
import json
import tempfile
import tomllib
from dataclasses import asdict, dataclass
from pathlib import Path

from taperlib.clairvoyant import clairvoyant_bound
from taperlib.feeders import feeder_rows
from taperlib.files import InputError
from taperlib.limits import read_limit_csv
from taperlib.measures import measures_of
from taperlib.sessions import read_sessions_csv
from taperlib.simulator import SimulationError, run_policy

from .cases import BOUND, Job

TOOLS = Path(__file__).resolve().parents[1]
CODE_OF_BOUND = tuple(TOOLS / "taperlib" / name for name in (
    "clairvoyant.py", "charge_curve.py", "feeders.py", "limits.py", "sessions.py"))
CODE_OF_MEASURES = tuple(TOOLS / "taperlib" / name for name in ("measures.py", "simulator.py"))
MEASURES = "measures.json"
STEPS = "steps.csv.gz"
DEPARTURES = "sessions.csv"
WALL_TIMES = ("solve_ms_p50", "solve_ms_max")  # differ from run to run, so that no table has them

Files = dict[str, bytes]


@dataclass(frozen=True)
class Failure:
    """Why a job has no files, in words for the user."""

    reason: str


def sha256_of(*paths: Path) -> str:
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.read_bytes())
    return digest.hexdigest()


@functools.cache
def _sha256_once(paths: tuple[Path, ...]) -> str:
    return sha256_of(*paths)


@dataclass(frozen=True)
class Programs:
    """What runs the jobs, and what it was when the study began."""

    simulator: Path
    simulator_sha256: str
    code_sha256: str

    @staticmethod
    def of(simulator: Path) -> "Programs":
        return Programs(simulator, sha256_of(simulator), sha256_of(*CODE_OF_BOUND, *CODE_OF_MEASURES))

    def sha256_for(self, policy: str) -> str:
        """What a case's results depend on: another simulator does not change the bound."""
        return self.code_sha256 if policy == BOUND else f"{self.simulator_sha256} {self.code_sha256}"

    def check(self) -> None:
        """Raises InputError where this machine has other programs than the one that asks."""
        if not self.simulator.is_file():
            raise InputError(f"there is no simulator at {self.simulator}: workers need the project's folder at the same "
                             "path, with build/study/build of the machine that asks")
        if _sha256_once((self.simulator,)) != self.simulator_sha256:
            raise InputError(f"the simulator at {self.simulator} is another one than that of the machine that asks: "
                             "copy it, and start the worker anew")
        if _sha256_once(CODE_OF_BOUND + CODE_OF_MEASURES) != self.code_sha256:
            raise InputError(f"{TOOLS} is of another version than that of the machine that asks: bring it up to date, and "
                             "start the worker anew")


def _json(value: dict) -> bytes:
    return (json.dumps(value, indent=1, sort_keys=True) + "\n").encode()


def _bound(job: Job, folder: Path) -> Files:
    sessions = read_sessions_csv(folder / "sessions.csv")
    limit = read_limit_csv(folder / "limit.csv")
    step_s = max(tomllib.loads(job.station_toml)["horizon"]["step_s"], job.tick_s)  # as the station plans
    bound = clairvoyant_bound(sessions, limit, step_s, job.tick_s, feeder_rows(job.station, sessions))
    return {MEASURES: _json({"energy_kwh": bound.energy_kwh})}


def _simulator_arguments(job: Job, folder: Path) -> list[str]:
    limits = read_limit_csv(folder / "limit.csv")
    limit = ["--limit-kw", str(limits.kw[0])] if limits.kw.size == 1 else ["--limit-csv", str(folder / "limit.csv")]
    return ["--sessions", str(folder / "sessions.csv"), "--station", job.station, "--tick-s", f"{job.tick_s:g}",
            *limit, *job.options]


def _simulation(job: Job, folder: Path, simulator: Path) -> Files:
    run = run_policy(simulator, job.policy, _simulator_arguments(job, folder), folder / "run")
    sessions = read_sessions_csv(folder / "sessions.csv")
    measures = asdict(measures_of(sessions, run, read_limit_csv(folder / "limit.csv"), bound_kwh=0))
    for name in ("share_of_bound_percent", *WALL_TIMES):
        del measures[name]
    return {
        MEASURES: _json(measures),
        DEPARTURES: (folder / "run" / "sessions.csv").read_bytes(),
        STEPS: gzip.compress((folder / "run" / "steps.csv").read_bytes(), mtime=0),
    }


def run_job(job: Job, programs: Programs) -> Files:
    """Raises InputError or SimulationError in words for the user."""
    programs.check()
    with tempfile.TemporaryDirectory(prefix="taper-study-") as name:
        folder = Path(name)
        (folder / "sessions.csv").write_text(job.sessions_csv, encoding="utf-8")
        (folder / "limit.csv").write_text(job.limit_csv, encoding="utf-8")
        return _bound(job, folder) if job.policy == BOUND else _simulation(job, folder, programs.simulator)


def attempt(job: Job, programs: Programs) -> Files | Failure:
    """The same without exceptions, of which Dask's workers would write an account of their own."""
    try:
        return run_job(job, programs)
    except (InputError, SimulationError, OSError) as error:
        return Failure(str(error))
