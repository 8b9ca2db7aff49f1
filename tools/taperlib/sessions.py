"""Charging sessions: the CSV that the simulator replays, read, checked and written.

Columns, in any order: session_id, connector, arrival_s, departure_s, battery_kwh, soc_arrival, soc_target, max_kw,
taper_kw, and optionally expected_departure_s, phases, second_max_kw, second_taper_kw and curve. Times are seconds from
the start of the simulation; SOC is 0 to 1. A vehicle tells that it takes at most max_kw - taper_kw * soc, and at most
second_max_kw - second_taper_kw * soc if that is given, never below 0. It takes this, unless it has a curve, which it then
obeys instead: points "soc:kw soc:kw ...", linear in between. An empty connector means the first free one, empty phases
all that the connector has.
"""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

from .charge_curve import Curve, Line, curve_text, hull_lines, parse_curve
from .files import InputError, number_at, read_text, write_atomically

TEXT_COLUMNS = ("session_id", "connector")
NUMBER_COLUMNS = ("arrival_s", "departure_s", "battery_kwh", "soc_arrival", "soc_target", "max_kw", "taper_kw")
COLUMNS = TEXT_COLUMNS + NUMBER_COLUMNS
EXPECTED_COLUMN = "expected_departure_s"
PHASES_COLUMN = "phases"
SECOND_COLUMNS = ("second_max_kw", "second_taper_kw")
CURVE_COLUMN = "curve"


@dataclass(frozen=True)
class Session:
    session_id: str
    arrival_s: float
    departure_s: float
    battery_kwh: float
    soc_arrival: float
    soc_target: float
    max_kw: float
    taper_kw: float
    connector: str = ""
    expected_departure_s: float | None = None
    phases: int | None = None
    second_max_kw: float | None = None
    second_taper_kw: float | None = None
    curve: Curve | None = None

    @property
    def told_lines(self) -> list[Line]:
        """What the vehicle tells: the least of these lines, and of the flat limit that the curve's maximum is."""
        lines = [(self.max_kw, self.taper_kw)]
        if self.second_max_kw is not None and self.second_taper_kw is not None:
            lines.append((self.second_max_kw, self.second_taper_kw))
        return lines

    @property
    def limit_lines(self) -> list[Line]:
        """Lines (kW at SOC 0, fall until SOC 1) that its power is never above: of the curve, its concave hull."""
        return self.told_lines if self.curve is None else hull_lines(self.curve)

    @property
    def requested_kwh(self) -> float:
        return (self.soc_target - self.soc_arrival) * self.battery_kwh


def _problem_in(session: Session) -> tuple[str, str] | None:
    """The first column whose value makes no sense, and why."""
    if session.arrival_s < 0:
        return "arrival_s", "is before the start of the simulation (0)"
    if session.departure_s <= session.arrival_s:
        return "departure_s", "is not after arrival_s"
    if session.battery_kwh <= 0:
        return "battery_kwh", "is not greater than 0"
    if not 0 <= session.soc_arrival <= 1:
        return "soc_arrival", "is not between 0 and 1"
    if not session.soc_arrival <= session.soc_target <= 1:
        return "soc_target", "is not between soc_arrival and 1"
    if session.max_kw <= 0:
        return "max_kw", "is not greater than 0"
    if not 0 <= session.taper_kw <= session.max_kw:
        return "taper_kw", "is not between 0 and max_kw"
    return _problem_in_second_line(session)


def _problem_in_second_line(session: Session) -> tuple[str, str] | None:
    max_kw, taper_kw = session.second_max_kw, session.second_taper_kw
    if max_kw is None and taper_kw is None:
        return None
    if taper_kw is None:
        return "second_max_kw", "is given without second_taper_kw"
    if max_kw is None:
        return "second_taper_kw", "is given without second_max_kw"
    if max_kw <= 0:
        return "second_max_kw", "is not greater than 0"
    if not 0 <= taper_kw <= max_kw:
        return "second_taper_kw", "is not between 0 and second_max_kw"
    return None


def _optional_number(row: dict[str, str | None], name: str, where: str) -> float | None:
    text = (row.get(name) or "").strip()
    return number_at(text, f"{where}, column {name}") if text else None


def _curve_of_row(row: dict[str, str | None], where: str) -> Curve | None:
    text = (row.get(CURVE_COLUMN) or "").strip()
    return parse_curve(text, f"{where}, column {CURVE_COLUMN}") if text else None


def _session_of_row(row: dict[str, str | None], where: str) -> Session:
    numbers = {name: number_at(row[name], f"{where}, column {name}") for name in NUMBER_COLUMNS}
    expected_s, phases, *second = (_optional_number(row, name, where)
                                   for name in (EXPECTED_COLUMN, PHASES_COLUMN, *SECOND_COLUMNS))
    if phases not in (None, 1, 3):
        raise InputError(f"{where}, column {PHASES_COLUMN}: {phases:g} is neither 1 nor 3")
    session = Session(
        session_id=(row["session_id"] or "").strip(),
        connector=(row["connector"] or "").strip(),
        expected_departure_s=expected_s,
        phases=None if phases is None else int(phases),
        curve=_curve_of_row(row, where),
        **dict(zip(SECOND_COLUMNS, second, strict=True)),
        **numbers,
    )
    if not session.session_id:
        raise InputError(f"{where}, column session_id: is empty")
    problem = _problem_in(session)
    if problem:
        column, reason = problem
        raise InputError(f"{where}, column {column}: {getattr(session, column):g} {reason}")
    return session


def read_sessions_csv(path: Path) -> list[Session]:
    """All sessions of a file, in its order. Raises InputError that names file, line, column and reason."""
    reader = csv.DictReader(io.StringIO(read_text(path)))
    missing = [name for name in COLUMNS if name not in (reader.fieldnames or [])]
    if missing:
        raise InputError(f"{path}, line 1: the header lacks {', '.join(missing)}")
    sessions: list[Session] = []
    line_of_id: dict[str, int] = {}
    for row in reader:
        where = f"{path}, line {reader.line_num}"
        session = _session_of_row(row, where)
        if session.session_id in line_of_id:
            first_line = line_of_id[session.session_id]
            raise InputError(f"{where}, column session_id: '{session.session_id}' is already in line {first_line}")
        line_of_id[session.session_id] = reader.line_num
        sessions.append(session)
    if not sessions:
        raise InputError(f"{path}: holds no sessions")
    return sessions


def _number_text(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


# Of the optional columns: the text of a session's value.
_OPTIONAL = {
    EXPECTED_COLUMN: lambda value: _number_text(value, 3),
    PHASES_COLUMN: str,
    SECOND_COLUMNS[0]: lambda value: _number_text(value, 6),
    SECOND_COLUMNS[1]: lambda value: _number_text(value, 6),
    CURVE_COLUMN: curve_text,
}


def _row_of_session(session: Session, optional: list[str]) -> list[str]:
    row = [
        session.session_id,
        session.connector,
        _number_text(session.arrival_s, 3),
        _number_text(session.departure_s, 3),
        _number_text(session.battery_kwh, 3),
        _number_text(session.soc_arrival, 6),
        _number_text(session.soc_target, 6),
        _number_text(session.max_kw, 6),
        _number_text(session.taper_kw, 6),
    ]
    values = ((name, getattr(session, name)) for name in optional)
    return row + ["" if value is None else _OPTIONAL[name](value) for name, value in values]


def sessions_csv(sessions: list[Session]) -> str:
    """Optional columns only where some session has a value."""
    optional = [name for name in _OPTIONAL if any(getattr(session, name) is not None for session in sessions)]
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow((*COLUMNS, *optional))
    writer.writerows(_row_of_session(session, optional) for session in sessions)
    return buffer.getvalue()


def write_sessions_csv(path: Path, sessions: list[Session]) -> None:
    write_atomically(path, sessions_csv(sessions))


def requested_kwh(sessions: list[Session]) -> float:
    return sum(session.requested_kwh for session in sessions)


def peak_present(sessions: list[Session]) -> int:
    """The largest number of cars there at the same time; one that leaves makes room for one that comes."""
    changes = [(session.departure_s, -1) for session in sessions] + [(session.arrival_s, 1) for session in sessions]
    present = peak = 0
    for _, change in sorted(changes):
        present += change
        peak = max(peak, present)
    return peak
