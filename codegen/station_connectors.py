"""The connectors of a station file: `[[connectors]]`, each a run of equal ones."""

from dataclasses import dataclass, replace
from typing import Any

from station_model import (
    MAX_CONNECTORS,
    MAX_CURRENT_dA,
    MAX_REACTION_ms,
    MAX_VOLTAGE_mV,
    MIN_AC_CURRENT_dA,
    NODES_PER_BUS,
    ROTATIONS,
    STRAIGHT,
    Connector,
    Group,
    way_to,
)
from toml_table import Table

EFFICIENCY_permille = 950  # of a DC converter, if the file does not say
REACTION_ms = {"AC": 5000, "DC": 1000}  # IEC 61851-1 gives a vehicle 5 s; a DC vehicle is the converter's master

# What a file calls them, and the rotation whose first one or two conductors they are.
ROTATION_NAMES = {"-".join(f"L{phase}" for phase in code): code for code in ROTATIONS}
PHASE_NAMES = {"L1": "123", "L2": "231", "L3": "312"}
PAIR_NAMES = {
    "L1-L2": "123",
    "L2-L1": "123",
    "L2-L3": "231",
    "L3-L2": "231",
    "L3-L1": "312",
    "L1-L3": "312",
}


@dataclass(frozen=True)
class Run:
    """`[[connectors]]` of the file, and the equal connectors that it stands for."""

    table: Table
    connectors: tuple[Connector, ...]


def read_connectors(root: Table, groups: tuple[Group, ...]) -> list[Run]:
    runs: list[Run] = []
    taken = 0
    for table in root.tables("connectors", MAX_CONNECTORS):
        count = table.integer("count", 1, MAX_CONNECTORS)
        if taken + count > MAX_CONNECTORS:
            raise table.error("count", f"makes {taken + count} connectors, at most {MAX_CONNECTORS}")
        one = _connector(table, groups)
        runs.append(Run(table, tuple(_at(one, index) for index in range(taken, taken + count))))
        taken += count
    return runs


def _at(connector: Connector, index: int) -> Connector:
    return replace(connector, bus=index // NODES_PER_BUS, node=index % NODES_PER_BUS + 1)


def _connector(table: Table, groups: tuple[Group, ...]) -> Connector:
    name = table.string("group")
    group = next((index for index, group in enumerate(groups) if group.name == name), None)
    if group is None:
        raise table.error("group", f'no group named "{name}"')
    kind = table.string("kind")
    if kind not in ("AC", "DC"):
        raise table.error("kind", f'must be "AC" or "DC", not "{kind}"')
    telling = [groups[k].name for k in way_to(groups, group) if groups[k].limits_phases]
    wiring = _ac_wiring(table, telling) if kind == "AC" else _dc_wiring(table)
    reaction_ms = table.quantity("reaction_s", 0, MAX_REACTION_ms, per_unit=1000, default=REACTION_ms[kind])
    currents = _currents(table, kind)
    voltage_mV = table.quantity("voltage_V", 1, MAX_VOLTAGE_mV, per_unit=1000)
    table.end()
    return Connector(
        kind=kind, voltage_mV=voltage_mV, reaction_ms=reaction_ms, group=group, bus=0, node=1, **wiring, **currents
    )


def _currents(table: Table, kind: str) -> dict[str, int]:
    min_dA = table.quantity("min_A", 0, MAX_CURRENT_dA, per_unit=10)
    if kind == "AC" and 0 < min_dA < MIN_AC_CURRENT_dA:
        raise table.error("min_A", f"must be at least {MIN_AC_CURRENT_dA / 10:g} on AC, or 0 for none, not {min_dA / 10:g}")
    max_dA = table.quantity("max_A", 1, MAX_CURRENT_dA, per_unit=10)
    if min_dA > max_dA:
        raise table.error("min_A", f"above max_A ({min_dA / 10:g} > {max_dA / 10:g})")
    fallback_dA = table.quantity("fallback_A", 0, MAX_CURRENT_dA, per_unit=10, default=0)
    if fallback_dA != 0 and not min_dA <= fallback_dA <= max_dA:
        raise table.error(
            "fallback_A", f"must be 0, or min_A to max_A ({min_dA / 10:g} to {max_dA / 10:g}), not {fallback_dA / 10:g}"
        )
    return {"min_mA": min_dA * 100, "max_mA": max_dA * 100, "fallback_mA": fallback_dA * 100}


def _dc_wiring(table: Table) -> dict[str, Any]:
    _refuse(table, ("phases", "rotation", "phase", "between"), "is for AC only")
    efficiency = table.quantity("efficiency", 1, 1000, per_unit=1000, default=EFFICIENCY_permille)
    return {"phases": 1, "efficiency_permille": efficiency}


def _ac_wiring(table: Table, telling: list[str]) -> dict[str, Any]:
    """`telling`: the groups above whose limits depend on the phase."""
    _refuse(table, ("efficiency",), "is for DC only")
    phases = table.integer("phases", 1, 3)
    if phases == 2:
        raise table.error("phases", "must be 1 or 3, not 2")
    if phases == 3:
        _refuse(table, ("phase", "between"), "is for one phase only")
        return {"phases": 3, "rotation": _named(table, "rotation", ROTATION_NAMES, STRAIGHT)}
    _refuse(table, ("rotation",), "is for three phases only")
    if table.has("between"):
        _refuse(table, ("phase",), "is not for a connector between two lines")
        return {"phases": 1, "rotation": _named(table, "between", PAIR_NAMES, STRAIGHT), "line_to_line": True}
    if telling and not table.has("phase"):
        raise table.error("phase", f'missing; "{telling[0]}" limits each phase (or say `between` for line to line)')
    return {"phases": 1, "rotation": _named(table, "phase", PHASE_NAMES, STRAIGHT)}


def _refuse(table: Table, keys: tuple[str, ...], reason: str) -> None:
    for key in keys:
        if table.has(key):
            raise table.error(key, reason)


def _named(table: Table, key: str, codes: dict[str, str], default: str) -> str:
    """The rotation that the file names, or `default`."""
    if not table.has(key):
        return default
    name = table.string(key)
    if name not in codes:
        raise table.error(key, f'must be one of {", ".join(codes)}, not "{name}"')
    return codes[name]
