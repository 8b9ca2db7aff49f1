"""The limits of a station as rows, as the planner has them: the same list that the firmware derives (taper/rows.h).

A row is a weighted sum of the connectors' currents, for one group and one kind of limit. Which rows there are, and which
connectors each of them has, follows from the description alone.
"""

from dataclasses import dataclass
from math import ceil

from station_model import Connector, Group, Station

# taper_row_kind_t, in its order. The second rows, "_B", only say something new where a connector is between two lines.
POWER = "POWER"
LINES = ("L1", "L2", "L3")
LINES_B = ("L1_B", "L2_B", "L3_B")
DELTA = ("DELTA_L1", "DELTA_L2", "DELTA_L3")
DELTA_B = ("DELTA_L1_B", "DELTA_L2_B", "DELTA_L3_B")
DIFFERENCES = ("L1_L2", "L2_L3", "L3_L1")
KINDS = (POWER, *LINES, *LINES_B, *DELTA, *DELTA_B, *DIFFERENCES)

SHORTER = 0.733  # sqrt(3) - 1, rounded up: of the lesser of two pairs that share a line
BALANCED = 1.733  # sqrt(3), rounded up: of a three-phase current on a delta side


@dataclass(frozen=True)
class Row:
    """One limit of one group; `weights` are those of the connectors in it, that is other than 0: W/A, or A/A."""

    group: int
    kind: str
    weights: dict[int, float]


def planned_rows(station: Station) -> list[Row]:
    """All rows of the station by ascending group and kind; taper_row_is_planned() of each is true."""
    rows = []
    for number, group in enumerate(station.groups):
        below = station.connectors_below(number)
        for kind in _limited_kinds(group, station.line_to_line):
            weights = {i: _weight(station, station.connectors[i], kind) for i in below}
            weights = {i: weight for i, weight in weights.items() if weight != 0}
            if weights:
                rows.append(Row(number, kind, weights))
    return rows


def _limited_kinds(group: Group, line_to_line: bool) -> list[str]:
    limits = {POWER: group.limit_W}
    limits |= dict.fromkeys(LINES, group.limit_mA) | dict.fromkeys(DELTA, group.delta_mA)
    if line_to_line:
        limits |= dict.fromkeys(LINES_B, group.limit_mA) | dict.fromkeys(DELTA_B, group.delta_mA)
    limits |= dict.fromkeys(DIFFERENCES, group.imbalance_mA)
    return [kind for kind in KINDS if limits.get(kind, 0) > 0]


def _weight(station: Station, connector: Connector, kind: str) -> float:
    """What 1 A of setpoint adds at most: taper_row_weight() of taper_booking_nominal(), per 1 A."""
    if kind == POWER:
        return float(connector.W_per_A)
    phases, permille = _phases(connector), 1000
    if connector.kind == "DC":
        permille = ceil(connector.W_per_A * 1_000_000 / (3 * station.site_voltage_mV))
    pair = min(p for p in range(3) if phases == {p, (p + 1) % 3}) if connector.line_to_line else None
    if kind in DIFFERENCES:
        line = DIFFERENCES.index(kind)
        share = float((line in phases) - ((line + 1) % 3 in phases))
    elif kind in LINES + LINES_B:
        share = _line_share(phases, pair, int(kind[1]) - 1, kind in LINES_B)
    else:
        share = _delta_share(phases, pair, int(kind[7]) - 1, kind in DELTA_B)
    return share * permille / 1000


def _phases(connector: Connector) -> set[int]:
    """Supply phases, 0..2, of the conductors in use."""
    if connector.kind == "DC":
        return {0, 1, 2}
    conductors = 2 if connector.line_to_line else connector.phases
    return {int(phase) - 1 for phase in connector.rotation[:conductors]}


def _line_share(phases: set[int], pair: int | None, line: int, second: bool) -> float:
    if line not in phases:
        return 0.0
    return 1.0 if pair is None or (pair == line) != second else SHORTER


def _delta_share(phases: set[int], pair: int | None, line: int, second: bool) -> float:
    before = (line + 2) % 3
    if pair is not None:
        facet = (line + second) % 3
        return 2.0 if pair == before else float(pair == facet)
    return (0.0, 1.0, BALANCED)[len(phases & {line, before})]
