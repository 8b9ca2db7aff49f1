"""A campaign: every station x week x limit x policy of a TOML file, as one table.

    name = "shares"                        # of the table: NAME.csv
    stations = ["garage", "caltech"]
    weeks = ["acn-jpl-*"]                  # of host_sim/data and --data; * stands for any letters
    limit_shares = [0.25, 0.35, 0.5]       # of what all cars at the busiest moment could draw; or limits_kw = [..]
    policies = ["soc-mpc", "llf"]
    tick_s = 900                           # default 900: sessions in steps of 15 min; else to the second
    options = ["--min-current-a", "0"]     # of taper-sim, default none
    alpha = 0.08                           # with battery_kwh: all batteries equal; default: drawn, as import_acn.py does
    battery_kwh = 12
"""

import fnmatch
import tomllib
from dataclasses import dataclass
from pathlib import Path

from taperlib.files import InputError, read_text

from .cases import Case, Setting
from .model import POLICY_COLUMNS, Results, Table, cases_of, policy_row
from .recipes import STEP_S, AcnWeek, DrawnBatteries, EqualBatteries, Inputs, SiteLimit
from .settings import STATIONS, short_name

LISTS = {"stations": str, "weeks": str, "policies": str}
OPTIONAL = {"limit_shares": list, "limits_kw": list, "tick_s": (int, float), "options": list, "alpha": (int, float),
            "battery_kwh": (int, float)}


@dataclass(frozen=True)
class Campaign:
    name: str
    settings: tuple[Setting, ...]
    policies: tuple[str, ...]

    @property
    def cases(self) -> tuple[Case, ...]:
        return tuple(cases_of(self.settings, self.policies))

    def table(self, results: Results) -> Table:
        rows = []
        for setting in self.settings:
            for policy in self.policies:
                row = policy_row(results, Case(setting, policy))
                rows.append((setting.station, setting.sessions.week, setting.limit.kw, setting.limit.share, *row[1:]))
        return Table(self.name, "Campaign", ("station", "week", "limit_kw", "limit_share", *POLICY_COLUMNS[1:]), rows)


def _checked(path: Path) -> dict:
    try:
        content = tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: {error}") from None
    for key in content:
        if key not in {"name", *LISTS, *OPTIONAL}:
            raise InputError(f"{path}, key {key}: is not known; known are name, {', '.join([*LISTS, *OPTIONAL])}")
    name = content.get("name")
    if not isinstance(name, str) or not name.replace("-", "").replace("_", "").isalnum():
        raise InputError(f"{path}, key name: needs letters, digits, - and _ only")
    for key, kind in LISTS.items():
        value = content.get(key)
        if not isinstance(value, list) or not value or not all(isinstance(entry, kind) for entry in value):
            raise InputError(f"{path}, key {key}: needs a list of texts")
    for key, kind in OPTIONAL.items():
        if key in content and (not isinstance(content[key], kind) or isinstance(content[key], bool)):
            raise InputError(f"{path}, key {key}: needs a {'list' if kind is list else 'number'}")
    return content


def _limits(content: dict, path: Path) -> list[SiteLimit]:
    if ("limit_shares" in content) == ("limits_kw" in content):
        raise InputError(f"{path}: needs either limit_shares or limits_kw")
    key = "limit_shares" if "limit_shares" in content else "limits_kw"
    values = content[key]
    if not values or not all(isinstance(value, (int, float)) and value > 0 for value in values):
        raise InputError(f"{path}, key {key}: needs numbers greater than 0")
    return [SiteLimit(share=value) if key == "limit_shares" else SiteLimit(kw=value) for value in values]


def _weeks(content: dict, path: Path, inputs: Inputs) -> list[str]:
    chosen = []
    for pattern in content["weeks"]:
        found = fnmatch.filter(inputs.weeks(), pattern)
        if not found:
            raise InputError(f"{path}, key weeks: no week is called '{pattern}'; there are {', '.join(inputs.weeks())}")
        chosen += [week for week in found if week not in chosen]
    return chosen


def _batteries(content: dict, path: Path) -> DrawnBatteries | EqualBatteries:
    if ("alpha" in content) != ("battery_kwh" in content):
        raise InputError(f"{path}: needs both alpha and battery_kwh, or none of them")
    return EqualBatteries(content["battery_kwh"], content["alpha"]) if "alpha" in content else DrawnBatteries()


def _stations(content: dict, path: Path) -> list[str]:
    known = [name for name, steps in STATIONS if steps is None]
    for name in content["stations"]:
        if name not in known:
            raise InputError(f"{path}, key stations: '{name}' is none of {', '.join(known)}")
    return content["stations"]


def read_campaign(path: Path, inputs: Inputs) -> Campaign:
    """Raises InputError that names file, key and reason."""
    content = _checked(path)
    batteries, tick_s = _batteries(content, path), content.get("tick_s", STEP_S)
    step_s = STEP_S if tick_s == STEP_S else None
    simulator_options = tuple(map(str, content.get("options", [])))
    settings = tuple(
        Setting(f"{station}, {short_name(week)}, {limit.kw or limit.share:g}", AcnWeek(week, batteries, step_s), limit,
                station, tick_s, simulator_options)
        for station in _stations(content, path) for week in _weeks(content, path, inputs)
        for limit in _limits(content, path))
    return Campaign(content["name"], settings, tuple(content["policies"]))
