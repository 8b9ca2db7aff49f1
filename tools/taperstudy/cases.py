"""Cases of the study, and the jobs that workers get: a case with all of its inputs as text."""

import hashlib
import json
from dataclasses import asdict, dataclass

from taperlib.feeders import station_file
from taperlib.sessions import sessions_csv

from .recipes import STEP_S, Inputs, Sessions, SiteLimit, limit_csv, truth_of

BOUND = "bound"  # in the place of a policy: the clairvoyant bound
FORMAT = "1"  # of what a job leaves behind; a new one makes all cases run anew


@dataclass(frozen=True)
class Setting:
    """What all policies that are compared share. `horizon`: steps of the station's horizon instead of its own."""

    name: str
    sessions: Sessions
    limit: SiteLimit
    station: str
    tick_s: float = STEP_S
    options: tuple[str, ...] = ()
    horizon: int | None = None


@dataclass(frozen=True)
class Case:
    """One run of taper-sim, or the clairvoyant bound of a setting."""

    setting: Setting
    policy: str
    options: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        return " ".join([self.setting.name, self.policy, *self.options])


@dataclass(frozen=True)
class Job:
    """All that a case depends on, besides the programs: it can run on any machine that has these."""

    policy: str
    station: str
    sessions_csv: str
    limit_csv: str
    tick_s: float
    options: tuple[str, ...]
    station_toml: str = ""  # of the bound: what the wiring allows

    def key(self, program_sha256: str) -> str:
        """Names the case's results. `program_sha256`: of the simulator, or of the bound's code."""
        content = json.dumps([FORMAT, program_sha256, asdict(self)], sort_keys=True)
        return hashlib.sha256(content.encode()).hexdigest()[:32]


def case_of(setting: Setting, method: str) -> Case:
    """A method is a policy with options of its own, such as `soc-mpc --learn-taper`."""
    policy, *options = method.split()
    return Case(setting, policy, tuple(options))


def bound_of(setting: Setting) -> Case:
    return Case(setting, BOUND)


def station_name(setting: Setting) -> str:
    """Of the generated station: a longer horizon has its own solver."""
    return setting.station if setting.horizon is None else f"{setting.station}{setting.horizon}"


def job_of(case: Case, inputs: Inputs) -> Job:
    setting = case.setting
    is_bound = case.policy == BOUND
    sessions = inputs.sessions(truth_of(setting.sessions) if is_bound else setting.sessions)
    limit = limit_csv(setting.limit, sessions)
    if is_bound:
        toml = station_file(setting.station).read_text(encoding="utf-8")
        return Job(BOUND, setting.station, sessions_csv(sessions), limit, setting.tick_s, (), toml)
    return Job(case.policy, station_name(setting), sessions_csv(sessions), limit, setting.tick_s,
               (*setting.options, *case.options))
