#!/usr/bin/env python3
"""Generates the C code that depends on the stations and on the description of the bus.

All input is checked before anything is written, and the output folder is exchanged as a whole: it holds either what
was there or what this run made. The same input gives the same bytes. A file whose content stays the same keeps its
time, so that what depends on it is not built again; memory.txt is always new.
"""

import argparse
import os
import shutil
import sys
from pathlib import Path

import tables
from bus_c import bus_header, fields_header
from bus_dbc import compact_dbc
from bus_model import Bus, read_bus
from station import Station, read_station
from toml_table import TomlError

_HERE = Path(__file__).resolve().parent
_STAMP = "memory.txt"  # in every folder that this program wrote: it replaces no other


def main(arguments: list[str] | None = None) -> int:
    options = _options(arguments)
    stations = _read_stations(options.stations, options.station_dir)
    bus = _read_bus(options.bus)
    if stations is None or bus is None:
        return 1
    if options.out.exists() and any(options.out.iterdir()) and not (options.out / _STAMP).exists():
        print(f"{options.out}: is not empty, and not made by this program", file=sys.stderr)
        return 1
    files = _files(stations, bus, options)
    _replace_folder(options.out, files)
    print(files[_STAMP], end="")
    return 0


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description="Generate the C code that depends on stations and bus.")
    parser.add_argument("--stations", required=True, type=_names, help="names, separated by commas: hub,garage")
    parser.add_argument("--real", required=True, choices=("double", "float"), help="floating-point type of the planner")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder to write; replaced as a whole")
    parser.add_argument("--station-dir", type=Path, default=_HERE / "stations", metavar="DIR", help="has NAME.toml")
    parser.add_argument("--bus", type=Path, default=_HERE / "bus.toml", metavar="FILE", help="description of the bus")
    parser.add_argument("--no-planner", action="store_true", help="leave out OSQP and the solvers")
    return parser.parse_args(arguments)


def _names(text: str) -> list[str]:
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise argparse.ArgumentTypeError("an empty name")
    if len(set(names)) != len(names):
        raise argparse.ArgumentTypeError("a name is given twice")
    return names


def _read_stations(names: list[str], folder: Path) -> list[Station] | None:
    """All stations, or None after a line for each bad one."""
    stations: list[Station] = []
    for name in names:
        path = folder / f"{name}.toml"
        try:
            stations.append(read_station(path, _shown(path)))
        except TomlError as error:
            print(error, file=sys.stderr)
    return stations if len(stations) == len(names) else None


def _read_bus(path: Path) -> Bus | None:
    """The bus, or None after a line that tells what is wrong."""
    try:
        return read_bus(path)
    except TomlError as error:
        print(error, file=sys.stderr)
        return None


def _shown(path: Path) -> str:
    """The path as a user would type it from here."""
    path, here = path.absolute(), Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


def _files(stations: list[Station], bus: Bus, options: argparse.Namespace) -> dict[str, str]:
    """All output by relative path."""
    from dbc import codec_files  # here: a bad station is told at once, without waiting for large imports

    files = {
        "include/taper/bus.h": bus_header(bus),
        "dbc/taper_fields.h": fields_header(bus),
        "include/taper/sizes.h": tables.sizes_header(stations, options.real),
        "include/taper/stations.h": tables.stations_header(stations),
        "stations.c": tables.stations_source(stations),
        _STAMP: "No planner, so no solver.\n",
    }
    files |= {f"dbc/{name}": text for name, text in codec_files(compact_dbc(bus)).items()}
    if not options.no_planner:
        files |= _planner_files(stations, options.real)
    return files


def _planner_files(stations: list[Station], real: str) -> dict[str, str]:
    import solver
    from memory import account
    from workspace import OsqpChanged

    solvers = [solver.generate_solver(station, "double" if real == "double" else "float") for station in stations]
    if any(one.osqp_files != solvers[0].osqp_files for one in solvers):
        raise OsqpChanged("the shared sources differ between stations")
    files = {
        "include/taper/solvers.h": solver.solvers_header(stations),
        "solver/solvers.c": solver.solvers_source(stations),
        _STAMP: account(solvers, real),
    }
    files |= {f"osqp/{name}": text for name, text in solvers[0].osqp_files.items()}
    for one in solvers:
        files |= {f"solver/{name}": text for name, text in solver.solver_files(one).items()}
    return files


def _replace_folder(out: Path, files: dict[str, str]) -> None:
    """Writes a new folder beside `out` and puts it in its place."""
    out = out.absolute()
    new, old = (out.with_name(f".{out.name}.{kind}-{os.getpid()}") for kind in ("new", "old"))
    try:
        for name, text in files.items():
            path = new / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="\n")
            _keep_time(path, out / name)
        if out.exists():
            out.rename(old)
        new.rename(out)
    except BaseException:
        if old.exists() and not out.exists():
            old.rename(out)
        raise
    finally:
        shutil.rmtree(new, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def _keep_time(path: Path, before: Path) -> None:
    if path.name != _STAMP and before.is_file() and before.read_bytes() == path.read_bytes():
        times = before.stat()
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


if __name__ == "__main__":
    sys.exit(main())
