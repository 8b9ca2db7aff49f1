"""What a station's feeder tree allows, as rows over the power of sessions: for the clairvoyant bound.

They are the linear rows of codegen/rows.py, that is of firmware/types/include/taper/rows.h, without the imbalance, which
is one of setpoints. A session counts by the connector that it names. One that names none counts like the connector of the
station that counts least, often not at all: so the bound stays one.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .files import InputError
from .sessions import Session

ROOT = Path(__file__).resolve().parents[2]
STATION_FOLDERS = (ROOT / "codegen" / "stations", ROOT / "tools" / "taperstudy" / "stations")
sys.path.append(str(ROOT / "codegen"))

from rows import DIFFERENCES, POWER, planned_rows  # noqa: E402
from station import read_station  # noqa: E402
from station_model import Station  # noqa: E402
from toml_table import TomlError  # noqa: E402

Key = tuple[int, str]  # group and kind of a row


@dataclass(frozen=True)
class FeederRow:
    """The sum over the sessions of per_kw * power [kW] is at most `limit` (kW or A)."""

    limit: float
    per_kw: np.ndarray


def station_file(name: str) -> Path:
    """Of codegen/stations, or of those that only the study uses; the former if there is none."""
    files = [folder / f"{name}.toml" for folder in STATION_FOLDERS]
    return next((file for file in files if file.is_file()), files[0])


def _load(name: str) -> Station:
    try:
        return read_station(station_file(name), name)
    except (OSError, TomlError) as error:
        raise InputError(f"station {name}: {error}") from None


def connector_count(name: str) -> int:
    """Raises InputError."""
    return len(_load(name).connectors)


def _one_phase(station: Station) -> Station:
    """The same, as vehicles that use one phase only see it."""
    return replace(station, connectors=tuple(replace(connector, phases=1) for connector in station.connectors))


def _per_kw(station: Station) -> dict[Key, np.ndarray]:
    """What 1 kW of each connector adds to each row."""
    found = {}
    kw_per_a = np.array([connector.voltage_mV * connector.phases / 1e6 for connector in station.connectors])
    for row in planned_rows(station):
        per_a = np.zeros(kw_per_a.size)
        per_a[list(row.weights)] = list(row.weights.values())
        found[row.group, row.kind] = per_a / kw_per_a / (1000 if row.kind == POWER else 1)
    return found


def _limit(station: Station, key: Key) -> float:
    group, kind = station.groups[key[0]], key[1]
    if kind == POWER:
        return group.limit_W / 1000
    return (group.delta_mA if kind.startswith("DELTA") else group.limit_mA) / 1000


def _weight(by_connector: np.ndarray, session: Session, station: Station) -> float:
    if not session.connector:
        return float(by_connector.min())
    connector = int(float(session.connector))
    if not 1 <= connector <= by_connector.size:
        raise InputError(f"session {session.session_id}: station {station.name} has no connector {session.connector}")
    return float(by_connector[connector - 1])


def feeder_rows(name: str, sessions: list[Session]) -> list[FeederRow]:
    """The rows of a station in which some session counts."""
    station = _load(name)
    all_phases, one_phase = _per_kw(station), _per_kw(_one_phase(station))
    rows = []
    for key, by_connector in all_phases.items():
        if key[1] in DIFFERENCES:
            continue
        single = one_phase.get(key, np.zeros_like(by_connector))
        least = np.minimum(by_connector, single)  # without a connector it is open how many phases there are
        per_kw = np.array([
            _weight(least if not session.connector else single if session.phases == 1 else by_connector, session, station)
            for session in sessions
        ])
        if np.any(per_kw > 0):
            rows.append(FeederRow(_limit(station, key), per_kw))
    return rows
