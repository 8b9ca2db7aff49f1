"""The feeder tree of a station file: `[[groups]]`."""

import re
from dataclasses import dataclass

from station_model import MAX_DELTA_mA, MAX_DELTA_SIDE_mV, MAX_GROUPS, MAX_LIMIT_mA, MAX_LIMIT_W, Group
from toml_table import Table


@dataclass(frozen=True)
class _Entry:
    """A group as the file has it: its parent is still a name."""

    table: Table
    name: str
    parent: str | None
    limits: dict[str, int]


def read_groups(root: Table, site_voltage_mV: int | None) -> tuple[Group, ...]:
    """The site first, and a parent before its children. `site_voltage_mV`: None if the file does not tell it."""
    entries = [_entry(table, site_voltage_mV) for table in root.tables("groups", MAX_GROUPS)]
    by_name: dict[str, _Entry] = {}
    for entry in entries:
        if entry.name in by_name:
            raise entry.table.error("name", f'a second group is named "{entry.name}"')
        by_name[entry.name] = entry
    _check_tree(root, entries, by_name)
    ordered = sorted(entries, key=lambda entry: _depth(entry, by_name))  # stable: the file's order in a generation
    if ordered[0].limits["limit_W"] == 0:
        raise ordered[0].table.error("limit_kW", "missing; the site needs one")
    index = {entry.name: number for number, entry in enumerate(ordered)}
    return tuple(Group(name=e.name, parent=None if e.parent is None else index[e.parent], **e.limits) for e in ordered)


def _entry(table: Table, site_voltage_mV: int | None) -> _Entry:
    name = table.string("name")
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,63}", name):
        raise table.error("name", f'"{name}" may have letters, digits, blanks and _ . - only')
    parent = table.string("parent") if table.has("parent") else None
    limits = {
        "limit_W": table.quantity("limit_kW", 1, MAX_LIMIT_W, per_unit=1000, default=0),
        "limit_mA": _amperes(table, "limit_A"),
        "delta_mA": _delta_mA(table, site_voltage_mV),
        "imbalance_mA": _amperes(table, "imbalance_A"),
    }
    table.end()
    if limits["limit_W"] == 0 and limits["limit_mA"] == 0:
        raise table.error("limit_kW", "missing, and so is limit_A; a group needs one of them")
    return _Entry(table, name, parent, limits)


def _amperes(table: Table, key: str) -> int:
    return table.quantity(key, 100, MAX_LIMIT_mA, per_unit=1000, default=0)


def _delta_mA(table: Table, site_voltage_mV: int | None) -> int:
    """The current of a line on the delta side as the wye side has it: times the ratio of windings, rounded down."""
    current_mA = _amperes(table, "delta_side_A")
    voltage_mV = table.quantity("delta_side_V", 1000, MAX_DELTA_SIDE_mV, per_unit=1000, default=0)
    if current_mA == 0 and voltage_mV == 0:
        return 0
    if current_mA == 0:
        raise table.error("delta_side_A", "missing beside delta_side_V")
    if voltage_mV == 0:
        raise table.error("delta_side_V", "missing beside delta_side_A")
    if site_voltage_mV is None:
        raise table.error("delta_side_V", "needs voltage_V of the site, phase to neutral on the wye side")
    delta_mA = current_mA * voltage_mV // site_voltage_mV
    if not 100 <= delta_mA <= MAX_DELTA_mA:
        raise table.error("delta_side_A", f"is {delta_mA / 1000:.10g} A on the wye side, which must be 0.1 to 20000")
    return delta_mA


def _check_tree(root: Table, entries: list[_Entry], by_name: dict[str, _Entry]) -> None:
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


def _depth(entry: _Entry, by_name: dict[str, _Entry]) -> int:
    """Steps from the group up to the site; more than there are groups if the way never ends."""
    depth = 0
    while entry.parent is not None and depth <= len(by_name):
        entry = by_name[entry.parent]
        depth += 1
    return depth
