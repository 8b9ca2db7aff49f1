"""A station as its TOML file describes it, checked: what this module returns can be built.

Units are the firmware's: integers in mA, mV, W, ms and s.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from toml_table import Table, load

# Bounds of the firmware's types (taper/types.h) and of the fields on the bus (bus.toml).
MAX_CONNECTORS = 240  # four buses of 60; a connector index is one byte
MAX_GROUPS = 254  # a group index is one byte; 255 says "no parent"
MAX_STEPS = 255  # one byte
NODES_PER_BUS = 60  # TAPER_NODES_PER_BUS
MAX_CURRENT_dA = 4094  # EVSE_STATUS.current_l1: 12 bits of 0.1 A, 0xFFF says "absent"
MIN_AC_CURRENT_dA = 60  # IEC 61851-1: a duty cycle of 10 % says 6 A, there is nothing below
MAX_LIMIT_W = 3_276_700  # SITE_LIMIT.limit: 15 bits of 100 W
MAX_VOLTAGE_mV = 1_500_000  # low voltage ends at 1500 V DC
MAINS_mV = 230_000  # phase to neutral, IEC 60038
MAX_SWITCH_s = 86_400
MAX_TICK_ms = 60_000

# `osqp_`, `qdldl_` and `taper_` begin the names of other symbols in the image, and a station's name begins its own.
RESERVED_NAMES = ("osqp", "qdldl", "taper")


@dataclass(frozen=True)
class Group:
    """A node of the feeder tree. `parent` is an index into the station's groups, None for the site."""

    name: str
    limit_W: int
    parent: int | None


@dataclass(frozen=True)
class Connector:
    kind: str  # "AC" or "DC"
    phases: int
    voltage_mV: int
    min_mA: int
    max_mA: int
    group: int
    bus: int
    node: int


@dataclass(frozen=True)
class Station:
    """The site is group 0, and a parent stands before its children."""

    name: str
    description: str
    steps: int
    step_s: int
    tick_ms: int
    min_on_ms: int
    min_off_ms: int
    failsafe_W: int
    other_load_W: int
    site_voltage_mV: int
    groups: tuple[Group, ...]
    connectors: tuple[Connector, ...]

    def groups_of(self, connector: int) -> list[int]:
        """The groups that `connector` draws through, ascending: the site first, its own last."""
        path: list[int] = []
        group: int | None = self.connectors[connector].group
        while group is not None:
            path.append(group)
            group = self.groups[group].parent
        return path[::-1]

    def connectors_below(self, group: int) -> list[int]:
        """The connectors of `group` and of all groups below it."""
        return [i for i in range(len(self.connectors)) if group in self.groups_of(i)]


def read_station(path: Path, shown: str | None = None) -> Station:
    """The station in the file at `path`; raises TomlError, whose text calls the file `shown`."""
    root = load(path, shown or str(path))
    name = _name(root, path.stem)
    description = root.string("description")
    if not description.isprintable() or "*/" in description or "/*" in description:
        raise root.error("description", "must be one line of printable text without comment marks")
    horizon = root.table("horizon")
    steps = horizon.integer("steps", 2, MAX_STEPS)
    step_s = horizon.integer("step_s", 60, 3600)
    horizon.end()
    control = root.table("control")
    tick_ms = control.integer("tick_ms", 1, MAX_TICK_ms)
    min_on_s = control.integer("min_on_s", 0, MAX_SWITCH_s)
    min_off_s = control.integer("min_off_s", 0, MAX_SWITCH_s)
    control.end()
    site = root.table("site")
    failsafe_W = site.quantity("failsafe_kW", 0, MAX_LIMIT_W, per_unit=1000)
    # Without these the connection serves nothing but the station.
    other_load_W = site.quantity("other_load_kW", 0, MAX_LIMIT_W, per_unit=1000) if site.has("other_load_kW") else 0
    site_voltage_mV = (
        site.quantity("voltage_V", 1, MAX_VOLTAGE_mV, per_unit=1000) if site.has("voltage_V") else MAINS_mV
    )
    site.end()
    groups = _groups(root)
    if failsafe_W > groups[0].limit_W:
        raise site.error("failsafe_kW", f"above the site's limit of {groups[0].limit_W / 1000:.10g} kW")
    connectors = _connectors(root, {group.name: index for index, group in enumerate(groups)})
    root.end()
    station = Station(
        name=name,
        description=description,
        steps=steps,
        step_s=step_s,
        tick_ms=tick_ms,
        min_on_ms=min_on_s * 1000,
        min_off_ms=min_off_s * 1000,
        failsafe_W=failsafe_W,
        other_load_W=other_load_W,
        site_voltage_mV=site_voltage_mV,
        groups=groups,
        connectors=connectors,
    )
    _check_groups_are_used(root, station)
    return station


def _name(root: Table, stem: str) -> str:
    """The name becomes part of C identifiers and of file names."""
    name = root.string("name")
    if not re.fullmatch(r"[a-z][a-z0-9_]{0,30}", name):
        raise root.error("name", f'"{name}" is not a C identifier (lower case, up to 31 characters)')
    if name in RESERVED_NAMES:
        raise root.error("name", f'"{name}" is taken by the firmware itself')
    if name != stem:
        raise root.error("name", f'"{name}" differs from the file\'s name "{stem}"')
    return name


@dataclass(frozen=True)
class _GroupEntry:
    """A group as the file has it: its parent is still a name."""

    table: Table
    name: str
    limit_W: int
    parent: str | None


def _groups(root: Table) -> tuple[Group, ...]:
    entries = [_group_entry(table) for table in root.tables("groups", MAX_GROUPS)]
    by_name: dict[str, _GroupEntry] = {}
    for entry in entries:
        if entry.name in by_name:
            raise entry.table.error("name", f'a second group is named "{entry.name}"')
        by_name[entry.name] = entry
    _check_tree(root, entries, by_name)
    ordered = sorted(entries, key=lambda entry: _depth(entry, by_name))  # stable: the file's order in a generation
    index = {entry.name: number for number, entry in enumerate(ordered)}
    return tuple(Group(e.name, e.limit_W, None if e.parent is None else index[e.parent]) for e in ordered)


def _group_entry(table: Table) -> _GroupEntry:
    name = table.string("name")
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,63}", name):
        raise table.error("name", f'"{name}" may have letters, digits, blanks and _ . - only')
    parent = table.string("parent") if table.has("parent") else None
    limit_W = table.quantity("limit_kW", 1, MAX_LIMIT_W, per_unit=1000)
    table.end()
    return _GroupEntry(table, name, limit_W, parent)


def _check_tree(root: Table, entries: list[_GroupEntry], by_name: dict[str, _GroupEntry]) -> None:
    for entry in entries:
        if entry.parent is not None and entry.parent not in by_name:
            raise entry.table.error("parent", f'no group named "{entry.parent}"')
    roots = [entry for entry in entries if entry.parent is None]
    if not roots:
        raise root.error("groups", "all have a parent; one must have none: the site")
    if len(roots) > 1:
        raise roots[1].table.error("parent", f'missing; the site, which has none, is already "{roots[0].name}"')
    for entry in entries:
        if _depth(entry, by_name) > len(entries):
            raise entry.table.error("parent", f'"{entry.name}" is below itself')


def _depth(entry: _GroupEntry, by_name: dict[str, _GroupEntry]) -> int:
    """Steps from the group up to the site; more than there are groups if the way never ends."""
    depth = 0
    while entry.parent is not None and depth <= len(by_name):
        entry = by_name[entry.parent]
        depth += 1
    return depth


def _connectors(root: Table, group_index: dict[str, int]) -> tuple[Connector, ...]:
    connectors: list[Connector] = []
    for table in root.tables("connectors", MAX_CONNECTORS):
        count = table.integer("count", 1, MAX_CONNECTORS)
        if len(connectors) + count > MAX_CONNECTORS:
            raise table.error("count", f"makes {len(connectors) + count} connectors, at most {MAX_CONNECTORS}")
        connectors += _run(table, count, len(connectors), group_index)
    return tuple(connectors)


def _run(table: Table, count: int, first: int, group_index: dict[str, int]) -> list[Connector]:
    """`count` equal connectors, of which the first has the index `first`."""
    group = table.string("group")
    if group not in group_index:
        raise table.error("group", f'no group named "{group}"')
    kind = table.string("kind")
    if kind not in ("AC", "DC"):
        raise table.error("kind", f'must be "AC" or "DC", not "{kind}"')
    phases = _phases(table, kind)
    voltage_mV = table.quantity("voltage_V", 1, MAX_VOLTAGE_mV, per_unit=1000)
    min_dA = table.quantity("min_A", 0, MAX_CURRENT_dA, per_unit=10)
    if kind == "AC" and 0 < min_dA < MIN_AC_CURRENT_dA:
        raise table.error("min_A", f"must be at least {MIN_AC_CURRENT_dA / 10:g} on AC, or 0 for none, not {min_dA / 10:g}")
    max_dA = table.quantity("max_A", 1, MAX_CURRENT_dA, per_unit=10)
    if min_dA > max_dA:
        raise table.error("min_A", f"above max_A ({min_dA / 10:g} > {max_dA / 10:g})")
    table.end()
    return [
        Connector(
            kind=kind,
            phases=phases,
            voltage_mV=voltage_mV,
            min_mA=min_dA * 100,
            max_mA=max_dA * 100,
            group=group_index[group],
            bus=index // NODES_PER_BUS,
            node=index % NODES_PER_BUS + 1,
        )
        for index in range(first, first + count)
    ]


def _phases(table: Table, kind: str) -> int:
    if kind == "DC":
        if table.has("phases"):
            raise table.error("phases", "is for AC only")
        return 1
    phases = table.integer("phases", 1, 3)
    if phases == 2:
        raise table.error("phases", "must be 1 or 3, not 2")
    return phases


def _check_groups_are_used(root: Table, station: Station) -> None:
    """A sum over no connector would be an empty row of the quadratic programme."""
    for index, group in enumerate(station.groups):
        if not station.connectors_below(index):
            raise root.error("groups", f'no connector is in "{group.name}" or below it')
