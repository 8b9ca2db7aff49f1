"""Builds the simulator with all stations that the study needs, in build/study/build.

Stations with another horizon are made from those of codegen/stations, so that nothing is written twice.
"""

import re
import subprocess
from pathlib import Path

from taperlib.feeders import station_file
from taperlib.files import InputError, write_atomically

from .recipes import ROOT
from .settings import STATIONS

FOLDER = ROOT / "build" / "study"
LOG_LINES = 30


def with_horizon(toml: str, name: str, steps: int) -> str:
    """The text of a station's description with another horizon and a name of its own, NAMEsteps.

    The first line of each key is the one: groups and connectors come later in the file.
    """
    for pattern, line in ((r"(?m)^name\s*=.*$", f'name = "{name}{steps}"'), (r"(?m)^steps\s*=.*$", f"steps = {steps}")):
        toml, found = re.subn(pattern, line, toml, count=1)
        if found != 1:
            raise InputError(f"{station_file(name)}: has no line like '{line}'")
    return toml


def station_texts(stations: tuple[tuple[str, int | None], ...]) -> dict[str, str]:
    """Descriptions by name. `stations`: names, and their horizon if it is not their own."""
    texts = {}
    for name, steps in stations:
        try:
            toml = station_file(name).read_text(encoding="utf-8")
        except OSError as error:
            raise InputError(f"station {name}: {station_file(name)} cannot be read: {error.strerror}") from None
        texts[name if steps is None else f"{name}{steps}"] = toml if steps is None else with_horizon(toml, name, steps)
    return texts


def _write_if_new(path: Path, text: str) -> None:
    """What did not change keeps its time, and is not built again."""
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        write_atomically(path, text)


def _run(command: list[str]) -> None:
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode != 0:
        last = "\n".join(done.stdout.splitlines()[-LOG_LINES:])
        raise InputError(f"{' '.join(command)} failed with exit code {done.returncode}:\n{last}")


def build_simulator() -> Path:
    """The simulator with all stations: one binary for all cases. Does nothing that is done already."""
    texts = station_texts(STATIONS)
    for name, text in texts.items():
        _write_if_new(FOLDER / "stations" / f"{name}.toml", text)
    build = FOLDER / "build"
    _run(["cmake", "--preset", "host-release", "-B", str(build), f"-DTAPER_STATION_DIR={FOLDER / 'stations'}",
          f"-DTAPER_STATIONS={';'.join(sorted(texts))}", "-DBUILD_TESTING=OFF"])
    _run(["cmake", "--build", str(build), "-t", "taper-sim"])
    return build / "host_sim" / "taper-sim"
