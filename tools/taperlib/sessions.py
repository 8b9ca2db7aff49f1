"""Charging sessions: the CSV that the simulator replays, read, checked and written.

Columns, in any order: session_id, connector, arrival_s, departure_s, battery_kwh, soc_arrival, soc_target, max_kw,
taper_kw, and optionally expected_departure_s and phases. Times are seconds from the start of the simulation; SOC is 0 to
1. The most that a vehicle takes is max_kw - taper_kw * soc, never below 0. An empty connector means the first free one,
empty phases all that the connector has.
"""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

from .files import InputError, number_at, read_text, write_atomically

TEXT_COLUMNS = ("session_id", "connector")
NUMBER_COLUMNS = ("arrival_s", "departure_s", "battery_kwh", "soc_arrival", "soc_target", "max_kw", "taper_kw")
COLUMNS = TEXT_COLUMNS + NUMBER_COLUMNS
EXPECTED_COLUMN = "expected_departure_s"
PHASES_COLUMN = "phases"


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
    return None


def _session_of_row(row: dict[str, str | None], where: str) -> Session:
    numbers = {name: number_at(row[name], f"{where}, column {name}") for name in NUMBER_COLUMNS}
    expected_text = (row.get(EXPECTED_COLUMN) or "").strip()
    expected_s = number_at(expected_text, f"{where}, column {EXPECTED_COLUMN}") if expected_text else None
    phases_text = (row.get(PHASES_COLUMN) or "").strip()
    phases = number_at(phases_text, f"{where}, column {PHASES_COLUMN}") if phases_text else None
    if phases not in (None, 1, 3):
        raise InputError(f"{where}, column {PHASES_COLUMN}: {phases:g} is neither 1 nor 3")
    session = Session(
        session_id=(row["session_id"] or "").strip(),
        connector=(row["connector"] or "").strip(),
        expected_departure_s=expected_s,
        phases=None if phases is None else int(phases),
        **numbers,
    )
    if not session.session_id:
        raise InputError(f"{where}, column session_id: is empty")
    problem = _problem_in(session)
    if problem:
        column, reason = problem
        raise InputError(f"{where}, column {column}: {numbers[column]:g} {reason}")
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


def _row_of_session(session: Session, with_expected: bool, with_phases: bool) -> list[str]:
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
    if with_expected:
        expected_s = session.expected_departure_s
        row.append("" if expected_s is None else _number_text(expected_s, 3))
    if with_phases:
        row.append("" if session.phases is None else str(session.phases))
    return row


def write_sessions_csv(path: Path, sessions: list[Session]) -> None:
    with_expected = any(session.expected_departure_s is not None for session in sessions)
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    with_phases = any(session.phases is not None for session in sessions)
    writer.writerow(COLUMNS + ((EXPECTED_COLUMN,) if with_expected else ()) + ((PHASES_COLUMN,) if with_phases else ()))
    writer.writerows(_row_of_session(session, with_expected, with_phases) for session in sessions)
    write_atomically(path, buffer.getvalue())


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
