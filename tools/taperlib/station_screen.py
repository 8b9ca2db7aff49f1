"""A station's state as text and tables, as much as the terminal has room for."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timezone

from rich.console import Group
from rich.table import Table
from rich.text import Text

from taperlib.station_view import Bus, Connector, Emergency, Station, StationView

DAY_S = 86_400
EMCY_LINES = 5
LEAST_ROWS = 3
GAP = 2
STYLE_OF_REASON = {
    **dict.fromkeys(("offline", "fault", "version", "locked out", "over draw"), "red"),
    **dict.fromkeys(("waiting", "hand over", "site limit", "feeder limit", "phase limit", "imbalance limit",
                     "failsafe limit", "grid pause"), "yellow"),
    "complete": "green",
}
STYLE_OF_MODE = {"plan": "green", "fallback": "yellow"}
STYLE_OF_SEVERITY = {"fault": "red", "warning": "yellow"}


@dataclass(frozen=True)
class Context:
    """What cells need besides their row."""
    now_s: float
    station: Station
    utc: bool

    def clock(self, unix_s: float) -> str:
        zone = timezone.utc if self.utc else None
        moment = datetime.fromtimestamp(unix_s, zone)
        present_s = self.station.clock_unix_s or self.now_s
        return moment.strftime("%H:%M" if abs(unix_s - present_s) < DAY_S else "%d.%m.")


@dataclass(frozen=True)
class Column:
    heading: str
    width: int
    cell: Callable[[Connector, Context], str]
    rank: int  # of its importance: 0 always stays
    right: bool = True


def number(value: float | None, digits: int = 1, unit: str = "") -> str:
    return "-" if value is None else f"{value:.{digits}f}{unit}"


def _soc(row: Connector, _context: Context) -> str:
    """An estimate, because the vehicle's own report is old, is marked."""
    return ("~" if row.soc_estimated else "") + number(row.soc_percent, 0, "%")


def ordinal(place: int) -> str:
    ending = "th" if place % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(place % 10, "th")
    return f"{place}{ending}"


def _measured(row: Connector, _context: Context) -> str:
    """One number when the phases are alike, else all three."""
    texts = [number(value) for value in row.measured_a]
    return "-" if not texts else texts[0] if len(set(texts)) == 1 else "/".join(texts)


def _validity(row: Connector, _context: Context) -> str:
    return number(row.validity_left_s, 1)


def _departure(row: Connector, context: Context) -> str:
    return "-" if row.departure_unix_s is None else context.clock(row.departure_unix_s)


def _reason(row: Connector, _context: Context) -> str:
    """A question mark after what no OUTLOOK said and the bus does not show: it is inferred."""
    sure = row.reason_told or row.reason in ("offline", "no vehicle")
    place = "" if row.waiting_place is None else f", {ordinal(row.waiting_place)} of {row.waiting_of}"
    return row.reason + ("" if sure else "?") + place


COLUMNS = (
    Column("n", 2, lambda row, _: str(row.node), 0),
    Column("state", 9, lambda row, _: row.state, 0, right=False),
    Column("ses", 3, lambda row, _: "-" if row.session is None else str(row.session), 12),
    Column("SOC", 4, _soc, 3),
    Column("age s", 5, lambda row, _: number(row.soc_age_s, 0), 13),
    Column("to", 4, lambda row, _: number(row.target_percent, 0, "%"), 9),
    Column("need", 5, lambda row, _: number(row.need_kwh), 5),
    Column("until", 6, _departure, 4),
    Column("set A", 5, lambda row, _: number(row.setpoint_a), 1),
    Column("left s", 6, _validity, 10),
    Column("echo", 4, lambda row, _: {None: "-", True: "ok", False: "NO"}[row.echo_ok], 7),
    Column("is A", 14, _measured, 11),
    Column("kW", 5, lambda row, _: number(row.power_kw), 2),
    Column("plan", 5, lambda row, _: number(row.planned_kw), 8),
    Column("kWh", 5, lambda row, _: number(row.energy_kwh), 6),
    Column("will", 4, lambda row, _: number(row.expected_soc_percent, 0, "%"), 14),
    Column("short", 5, lambda row, _: number(row.short_kwh), 15),
    Column("why", 18, _reason, 0, right=False),
)


def columns_for(width: int) -> list[Column]:
    """The most important columns that fit, in their order."""
    chosen: list[Column] = []
    for column in sorted(COLUMNS, key=lambda column: column.rank):
        if sum(other.width + GAP for other in (*chosen, column)) <= width or column.rank == 0:
            chosen.append(column)
    return [column for column in COLUMNS if column in chosen]


def connector_table(rows: list[Connector], context: Context, width: int) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, GAP, 0, 0), header_style="bold")
    columns = columns_for(width)
    for column in columns:
        table.add_column(column.heading, justify="right" if column.right else "left", width=column.width,
                         no_wrap=True, overflow="ellipsis")
    for row in rows:
        style = "red" if not row.online else STYLE_OF_REASON.get(row.reason, "" if row.vehicle else "dim")
        table.add_row(*(Text(column.cell(row, context)) for column in columns), style=style)
    return table


def _joined(parts: list[str]) -> str:
    return "  ".join(part for part in parts if part)


def station_lines(station: Station, context: Context) -> list[Text]:
    if station.limit_kw is not None:
        limit = f"of {number(station.limit_kw)} kW"
    else:
        limit = "of the station's limit" if station.limit_source == "station" else ""
    first = Text.assemble("mode ", (station.mode, STYLE_OF_MODE.get(station.mode, "red")), "  ", _joined([
        f"setpoints {number(station.setpoints_kw)} kW {limit}".rstrip(),
        f"measured {number(station.measured_kw)} kW"]))
    clock = "not set" if station.clock_unix_s is None else context.clock(station.clock_unix_s)
    quality = "" if station.clock_quality is None else f" (quality {station.clock_quality})"
    other = station.other_load_a and "other load " + "/".join(number(value) for value in station.other_load_a) + " A"
    second = _joined([f"limit by {station.limit_source or '-'}", f"gateway: {station.gateway}",
                      f"failsafe {number(station.failsafe_kw, 1, ' kW')}", f"clock {clock}{quality}", other or ""])
    third = _joined([f"active {_or_dash(station.active)}", f"waiting {_or_dash(station.waiting)}",
                     f"plan {_or_dash(station.plan_version)}", f"solver {_or_dash(station.verdict)}",
                     f"{_or_dash(station.iterations)} iterations"])
    return [first, Text(second), Text(third)]


def _or_dash(value: object) -> str:
    return "-" if value is None else str(value)


def bus_line(bus: Bus, source: str) -> Text:
    wrong = {"unknown": bus.unknown, "CRC errors": bus.crc_errors, "repeated": bus.repeated, "lost": bus.lost,
             "out of sequence": bus.out_of_sequence}
    parts = [f"{source}: {bus.frames_per_s:.0f} frames/s", f"{bus.frames} frames", f"{bus.error_frames} error frames",
             *(f"{count} {what}" for what, count in wrong.items() if count)]
    return Text(_joined(parts), style="yellow" if bus.crc_errors or bus.error_frames else "")


def counter_line(counters: dict[str, int]) -> Text:
    return Text("counters: " + (_joined([f"{name} {value}" for name, value in counters.items()]) or "none told"))


def emergency_line(entry: Emergency, context: Context) -> Text:
    sender = {0: "controller", 62: "gateway"}.get(entry.node, f"connector {entry.node}")
    parts = [f"{context.now_s - entry.last_s:.0f} s ago", sender, f"{entry.severity}: {entry.what}",
             f"node {entry.about}" if entry.about else "", f"session {entry.session}" if entry.session else "",
             "" if entry.reaction == "none" else entry.reaction, f"data {entry.data}" if entry.data else "",
             f"({entry.frames} frames)"]
    return Text(_joined(parts), style=STYLE_OF_SEVERITY.get(entry.severity, ""))


def screen(view: StationView, now_s: float, source: str, utc: bool, width: int, height: int | None) -> Group:
    """Everything; with a height, connectors without a vehicle make room first. `source` is what is listened to."""
    rows = view.connectors(now_s)
    station = view.station(now_s, rows)
    context = Context(now_s, station, utc)
    entries = list(view.emergencies.values())[:-EMCY_LINES - 1:-1]
    around = [*station_lines(station, context), bus_line(view.bus(now_s), source),
              counter_line(view.nonzero_counters()), *(emergency_line(entry, context) for entry in entries)]
    if height is None:
        shown, hidden = rows, 0
    else:
        used = sum(-(-max(line.cell_len, 1) // width) for line in around)
        shown, hidden = _fitting(rows, max(height - used - 3, LEAST_ROWS))
    table = connector_table(shown, context, width)
    note = [Text(f"and {hidden} more connectors: enlarge the terminal", style="dim")] if hidden else []
    if not rows:
        note = [Text("no connector was heard", style="dim")]
    return Group(*around[:3], Text(""), table, *note, *around[3:])


def _fitting(rows: list[Connector], room: int) -> tuple[list[Connector], int]:
    first = sorted(rows, key=lambda row: (not row.vehicle and row.online, row.node))[:room]
    return sorted(first, key=lambda row: row.node), len(rows) - len(first)
