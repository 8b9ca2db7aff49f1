#!/usr/bin/env python3
"""Turns a CSV of ACN-Data charging sessions into a sessions CSV that the simulator replays.

ACN-Data holds no battery size and no state of charge (SOC), so both are drawn:

  battery   one of 24, 30, 40, 50, 60, 75, 82 and 100 kWh, each equally likely among those of which the request is at
            most 80 %. If the request is too large for all of them, the battery is request / 0.8.
  SOC       soc_arrival is uniform between 0.05 and 1 - request / battery, and
            soc_target = soc_arrival + request / battery, so it is never above 1.

The draw of a session depends on --seed and its session_id alone, so that it stays the same in a subset of the file or
in another order. Times count from the local midnight before the first arrival. The connector is left empty (first
free), because the dataset numbers its own stations.
"""

import argparse
import csv
import hashlib
import io
import math
import sys
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from taperlib.files import InputError, number_at, read_text
from taperlib.numbers import positive, share, whole_positive
from taperlib.sessions import Session, peak_present, requested_kwh, write_sessions_csv

USUAL_BATTERIES_KWH = (24.0, 30.0, 40.0, 50.0, 60.0, 75.0, 82.0, 100.0)
LARGEST_REQUEST_SHARE = 0.8
LEAST_SOC_AT_ARRIVAL = 0.05
REQUEST_COLUMNS = {"requested": "requested_energy (kWh)", "delivered": "delivered_energy (kWh)"}
ACN_COLUMNS = ("arrival", "departure", *REQUEST_COLUMNS.values(), "session_id", "estimated_departure")


@dataclass(frozen=True)
class AcnRow:
    session_id: str
    arrival: datetime
    departure: datetime
    estimated_departure: datetime
    request_kwh: float
    station_id: str = ""  # of the dataset; tools/acnsim.py replays sessions where they took place


@dataclass(frozen=True)
class Battery:
    kwh: float
    soc_arrival: float
    soc_target: float


def draw_battery(session_id: str, request_kwh: float, seed: int) -> Battery:
    """Battery and SOC as the module's text says. Only Generator.random() is used: two draws per session."""
    digest = hashlib.sha256(f"{seed}:{session_id}".encode()).digest()
    rng = np.random.Generator(np.random.PCG64(int.from_bytes(digest[:16], "big")))
    size_draw, soc_draw = rng.random(2)
    fitting_kwh = [kwh for kwh in USUAL_BATTERIES_KWH if request_kwh <= LARGEST_REQUEST_SHARE * kwh]
    if fitting_kwh:
        battery_kwh = fitting_kwh[int(size_draw * len(fitting_kwh))]
    else:
        battery_kwh = math.ceil(request_kwh / LARGEST_REQUEST_SHARE * 1000) / 1000
    request_share = request_kwh / battery_kwh
    soc_arrival = LEAST_SOC_AT_ARRIVAL + soc_draw * (1 - request_share - LEAST_SOC_AT_ARRIVAL)
    soc_arrival = math.floor(soc_arrival * 1e4) / 1e4
    return Battery(battery_kwh, soc_arrival, min(round(soc_arrival + request_share, 6), 1.0))


def _time_at(text: str | None, where: str) -> datetime:
    try:
        time = datetime.fromisoformat((text or "").strip())
    except ValueError:
        raise InputError(f"{where}: '{text or ''}' is not an ISO 8601 time") from None
    if time.tzinfo is None:
        raise InputError(f"{where}: '{text}' has no offset from UTC")
    return time


def _acn_row(row: dict[str, str | None], where: str, request_column: str) -> AcnRow:
    acn = AcnRow(
        session_id=(row["session_id"] or "").strip(),
        arrival=_time_at(row["arrival"], f"{where}, column arrival"),
        departure=_time_at(row["departure"], f"{where}, column departure"),
        estimated_departure=_time_at(row["estimated_departure"], f"{where}, column estimated_departure"),
        request_kwh=number_at(row[request_column], f"{where}, column {request_column}"),
        station_id=(row.get("station_id") or "").strip(),
    )
    if not acn.session_id:
        raise InputError(f"{where}, column session_id: is empty")
    if acn.departure <= acn.arrival:
        raise InputError(f"{where}, column departure: {acn.departure} is not after the arrival")
    if acn.request_kwh <= 0:
        raise InputError(f"{where}, column {request_column}: {acn.request_kwh:g} is not greater than 0")
    return acn


def read_acn_csv(path: Path, request_column: str) -> list[AcnRow]:
    reader = csv.DictReader(io.StringIO(read_text(path)))
    missing = [name for name in ACN_COLUMNS if name not in (reader.fieldnames or [])]
    if missing:
        raise InputError(f"{path}, line 1: the header lacks {', '.join(missing)}")
    rows: list[AcnRow] = []
    seen: set[str] = set()
    for row in reader:
        where = f"{path}, line {reader.line_num}"
        acn = _acn_row(row, where, request_column)
        if acn.session_id in seen:
            raise InputError(f"{where}, column session_id: '{acn.session_id}' occurs twice")
        seen.add(acn.session_id)
        rows.append(acn)
    if not rows:
        raise InputError(f"{path}: holds no sessions")
    return rows


def sessions_of(
    rows: list[AcnRow], seed: int, max_kw: float, taper_share: float, driver_departure: bool
) -> list[Session]:
    first = min(row.arrival for row in rows)
    midnight = first.replace(hour=0, minute=0, second=0, microsecond=0)

    def seconds(time: datetime) -> float:
        return (time - midnight).total_seconds()

    sessions = []
    for row in rows:
        battery = draw_battery(row.session_id, row.request_kwh, seed)
        sessions.append(
            Session(
                session_id=row.session_id,
                arrival_s=math.floor(seconds(row.arrival)),
                departure_s=math.ceil(seconds(row.departure)),
                battery_kwh=battery.kwh,
                soc_arrival=battery.soc_arrival,
                soc_target=battery.soc_target,
                max_kw=max_kw,
                taper_kw=max_kw * taper_share,
                expected_departure_s=round(seconds(row.estimated_departure)) if driver_departure else None,
            )
        )
    return sorted(sessions, key=lambda session: (session.arrival_s, session.session_id))


def _round_inwards(session: Session, step_s: int) -> Session:
    arrival_s = math.ceil(session.arrival_s / step_s) * step_s
    expected_s = session.expected_departure_s
    if expected_s is not None:
        expected_s = max(math.floor(expected_s / step_s) * step_s, arrival_s + step_s)
    departure_s = math.floor(session.departure_s / step_s) * step_s
    return replace(session, arrival_s=arrival_s, departure_s=departure_s, expected_departure_s=expected_s)


def round_to_steps(sessions: list[Session], step_s: int) -> tuple[list[Session], list[Session]]:
    """Arrivals up and departures down to the step. Returns (kept, lost): a lost one has no whole step left."""
    rounded = [_round_inwards(session, step_s) for session in sessions]
    kept = [session for session in rounded if session.departure_s > session.arrival_s]
    lost = [session for session in rounded if session.departure_s <= session.arrival_s]
    return sorted(kept, key=lambda session: (session.arrival_s, session.session_id)), lost


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input", type=Path, help="CSV of ACN-Data sessions")
    parser.add_argument("--out", type=Path, required=True, help="sessions CSV to write")
    parser.add_argument("--step-s", type=whole_positive, help="round arrivals up and departures down to this step [s]")
    parser.add_argument("--max-kw", type=positive, default=7.2, help="power at SOC 0 [kW] (default 7.2)")
    parser.add_argument("--taper-share", type=share, default=0.6,
                        help="share of --max-kw lost between SOC 0 and SOC 1 (default 0.6)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the drawn batteries (default 0)")
    parser.add_argument("--request", choices=tuple(REQUEST_COLUMNS), default="requested",
                        help="energy wanted: what the driver asked for, or what was delivered (default requested)")
    parser.add_argument("--driver-departure", action="store_true",
                        help="add expected_departure_s, the departure that the driver stated")
    return parser


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    try:
        rows = read_acn_csv(options.input, REQUEST_COLUMNS[options.request])
        sessions = sessions_of(rows, options.seed, options.max_kw, options.taper_share, options.driver_departure)
        if options.step_s:
            sessions, lost = round_to_steps(sessions, options.step_s)
            for session in lost:
                print(f"dropped: {session.session_id} has no whole step of {options.step_s} s", file=sys.stderr)
        if not sessions:
            raise InputError(f"{options.input}: no session is left after rounding to {options.step_s} s")
        write_sessions_csv(options.out, sessions)
    except (InputError, OSError) as error:
        print(f"import_acn: {error}", file=sys.stderr)
        return 1
    print(f"{options.out}: {len(sessions)} sessions, {requested_kwh(sessions):.1f} kWh requested, "
          f"{peak_present(sessions)} cars at once")
    return 0


if __name__ == "__main__":
    sys.exit(main())
