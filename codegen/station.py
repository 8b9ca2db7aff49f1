"""A station as its TOML file describes it, checked: what this module returns can be built."""

import re
from pathlib import Path
from typing import Any

from station_connectors import Run, read_connectors
from station_fit import reason_against
from station_groups import read_groups
from station_model import (
    MAINS_mV,
    MAX_CHANGE_s,
    MAX_CURRENT_dA,
    MAX_LIMIT_mA,
    MAX_LAMBDA_per_kWh2,
    MAX_LIMIT_W,
    MAX_OUTER_ITERATIONS,
    MAX_STEPS,
    MAX_SWITCH_s,
    MAX_TAPER_LINES,
    MAX_TICK_ms,
    MAX_VOLTAGE_mV,
    MIN_SITE_VOLTAGE_mV,
    OBJECTIVES,
    REPLANS,
    Connector,
    Group,
    Planning,
    Station,
)
from toml_table import Table, load

__all__ = ["Connector", "Group", "Station", "read_station"]

# `osqp_`, `qdldl_` and `taper_` begin the names of other symbols in the image, and a station's name begins its own.
RESERVED_NAMES = ("osqp", "qdldl", "taper", "planner", "float", "double")  # the last three: components of the package
TURN_s = 900  # what a turn lasts if the file does not say
CHANGE_ms = 5000  # IEC 61851-1: a vehicle has this long to follow a new duty cycle

Fields = dict[str, Any]  # of Station


def read_station(path: Path, shown: str | None = None) -> Station:
    """The station in the file at `path`; raises TomlError, whose text calls the file `shown`."""
    root = load(path, shown or str(path))
    fields = _names(root, path.stem) | _horizon(root.table("horizon")) | _control(root.table("control"))
    if root.has("planning"):
        fields |= _planning(root.table("planning"), fields["steps"])
    site = root.table("site")
    fields |= _site(site)
    groups = read_groups(root, fields["site_voltage_mV"] if site.has("voltage_V") else None)
    _check_site(site, fields, groups[0])
    runs = read_connectors(root, groups)
    root.end()
    connectors = tuple(connector for run in runs for connector in run.connectors)
    station = Station(groups=groups, connectors=connectors, **fields)
    _check_connectors_fit(station, runs)
    _check_groups_are_used(root, station)
    return station


def _names(root: Table, stem: str) -> Fields:
    """The name becomes part of C identifiers and of file names."""
    name = root.string("name")
    if not re.fullmatch(r"[a-z][a-z0-9_]{0,30}", name):
        raise root.error("name", f'"{name}" is not a C identifier (lower case, up to 31 characters)')
    if name in RESERVED_NAMES:
        raise root.error("name", f'"{name}" is taken by the firmware itself')
    if name != stem:
        raise root.error("name", f'"{name}" differs from the file\'s name "{stem}"')
    description = root.string("description")
    if not description.isprintable() or "*/" in description or "/*" in description:
        raise root.error("description", "must be one line of printable text without comment marks")
    return {"name": name, "description": description}


def _horizon(table: Table) -> Fields:
    fields = {"steps": table.integer("steps", 2, MAX_STEPS), "step_s": table.integer("step_s", 60, 3600)}
    table.end()
    return fields


def _control(table: Table) -> Fields:
    tick_ms = table.integer("tick_ms", 1, MAX_TICK_ms)
    min_on_s = table.integer("min_on_s", 0, MAX_SWITCH_s)
    min_off_s = table.integer("min_off_s", 0, MAX_SWITCH_s)
    turn_s = table.integer("turn_s", 0, MAX_SWITCH_s) if table.has("turn_s") else max(TURN_s, min_on_s)
    if turn_s < min_on_s:
        raise table.error("turn_s", f"below min_on_s ({turn_s} < {min_on_s})")
    most_mA = MAX_CURRENT_dA * 100
    fields = {
        "tick_ms": tick_ms,
        "min_on_ms": min_on_s * 1000,
        "min_off_ms": min_off_s * 1000,
        "turn_ms": turn_s * 1000,
        "change_ms": table.quantity("change_s", 0, MAX_CHANGE_s * 1000, per_unit=1000, default=CHANGE_ms),
        "ramp_mA_per_s": table.quantity("ramp_A_per_s", 0, most_mA, per_unit=1000, default=0),
        "deadband_mA": table.quantity("deadband_A", 0, most_mA, per_unit=1000, default=0),
    }
    table.end()
    return fields


def _planning(table: Table, steps: int) -> Fields:
    planning = Planning(
        objective=_one_of(table, "objective", OBJECTIVES),
        horizon_steps=table.integer("horizon_steps", 2, steps) if table.has("horizon_steps") else 0,
        outer_iterations=_outer_iterations(table),
        on_events=_one_of(table, "replan", REPLANS) == "events",
        learns_taper=table.boolean("learn_taper", False),
        taper_lines=table.integer("taper_lines", 1, MAX_TAPER_LINES) if table.has("taper_lines") else 1,
        lambda_milli_per_kWh2=table.quantity("lambda_per_kWh2", 0, MAX_LAMBDA_per_kWh2 * 1000, per_unit=1000, default=0),
    )
    if planning.objective == "log-utility" and not table.has("lambda_per_kWh2"):
        raise table.error("lambda_per_kWh2", "missing; the log utility needs it")
    fields = {
        "price_weight_permille": table.quantity("price_weight", 0, 1000, per_unit=1000, default=0),
        "planning": planning,
    }
    table.end()
    return fields


def _one_of(table: Table, key: str, names: tuple[str, ...]) -> str:
    """The first one is the default."""
    name = table.string(key, names[0])
    if name not in names:
        raise table.error(key, f'"{name}" is not one of {", ".join(names)}')
    return name


def _outer_iterations(table: Table) -> int:
    key = "outer_iterations"
    return table.integer(key, 1, MAX_OUTER_ITERATIONS) if table.has(key) else 0


def _site(table: Table) -> Fields:
    """The other load is 0 where the connection serves nothing but the station."""
    voltage = ("voltage_V", MIN_SITE_VOLTAGE_mV, MAX_VOLTAGE_mV)
    fields = {
        "failsafe_W": table.quantity("failsafe_kW", 0, MAX_LIMIT_W, per_unit=1000),
        "other_load_W": table.quantity("other_load_kW", 0, MAX_LIMIT_W, per_unit=1000, default=0),
        "other_load_mA": table.quantity("other_load_A", 0, MAX_LIMIT_mA, per_unit=1000, default=0),
        "site_voltage_mV": table.quantity(*voltage, per_unit=1000, default=MAINS_mV),
    }
    table.end()
    return fields


def _check_site(table: Table, fields: Fields, group: Group) -> None:
    if fields["failsafe_W"] > group.limit_W:
        raise table.error("failsafe_kW", f"above the site's limit of {group.limit_W / 1000:.10g} kW")
    load_W, load_mA = fields["other_load_W"], fields["other_load_mA"]
    if load_W > 0 and load_mA == 0 and group.limit_mA > 0:
        raise table.error("other_load_A", "missing; the site has limit_A, of which other_load_kW takes its part")
    if load_mA > 0 and load_W > 3 * load_mA * fields["site_voltage_mV"] // 1_000_000:
        raise table.error("other_load_A", "three phases of it are less than other_load_kW")
    if load_mA > 0 and load_W == 0:
        raise table.error("other_load_A", "without other_load_kW")
    if load_W > 0 and group.delta_mA > 0:
        raise table.error("other_load_kW", "a site with delta_side_A can have none: how it is wired is not known")


def _check_connectors_fit(station: Station, runs: list[Run]) -> None:
    for run in runs:
        mistake = reason_against(station, run.connectors[0])
        if mistake is not None:
            raise run.table.error(*mistake)


def _check_groups_are_used(root: Table, station: Station) -> None:
    """A sum over no connector would be an empty row of the quadratic programme."""
    for index, group in enumerate(station.groups):
        if not station.connectors_below(index):
            raise root.error("groups", f'no connector is in "{group.name}" or below it')
