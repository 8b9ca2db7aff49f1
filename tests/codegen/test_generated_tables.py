"""The stations' C tables: they compile without a warning and hold what the station files say."""

import subprocess
import tomllib
from pathlib import Path

from conftest import CODEGEN, ROOT, STATIONS, Run, compile_c
from test_station_files import GOOD

DUMP = Path(__file__).with_name("dump_stations.c")
STRICT = ("-Wpedantic", "-Wconversion", "-Wshadow")
TYPES = ROOT / "firmware/types/include"


def dumped(tree: Path, folder: Path) -> list[str]:
    """What a C program reads out of the tables."""
    compile_c([DUMP, tree / "stations.c"], [tree / "include", TYPES], folder / "dump", *STRICT)
    return subprocess.run([folder / "dump"], capture_output=True, text=True, check=True).stdout.splitlines()


def expected(station: dict) -> list[str]:
    """The same lines straight from the TOML, for a file whose groups are in the right order already."""
    horizon, control = station["horizon"], station["control"]
    times = (control["tick_ms"], control["min_on_s"] * 1000, control["min_off_s"] * 1000)
    failsafe_W = round(station["site"]["failsafe_kW"] * 1000)
    lines = [" ".join(map(str, (station["name"], failsafe_W, *times, horizon["step_s"], horizon["steps"])))]
    names = [group["name"] for group in station["groups"]]
    for group in station["groups"]:
        parent = names.index(group["parent"]) if "parent" in group else 255
        lines.append(f"group {round(group['limit_kW'] * 1000)} {parent}")
    number = 0
    for run in station["connectors"]:
        for _ in range(run["count"]):
            currents = f"{round(run['min_A'] * 1000)} {round(run['max_A'] * 1000)}"
            place = f"{names.index(run['group'])} {number // 60} {number % 60 + 1}"
            kind = int(run["kind"] == "DC")
            lines.append(f"connector {currents} {run['voltage_V'] * 1000} {run.get('phases', 1)} {place} {kind}")
            number += 1
    return lines


def test_the_tables_say_what_the_station_files_say(tree: Path, tmp_path: Path) -> None:
    lines: list[str] = []
    for name in STATIONS:
        lines += expected(tomllib.loads((CODEGEN / f"stations/{name}.toml").read_text()))
    assert dumped(tree, tmp_path) == lines


def test_groups_are_sorted_and_direct_current_is_told(generate: Run, tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_text(GOOD)
    arguments = ("--stations", "x", "--real", "float", "--station-dir", tmp_path, "--no-planner")
    assert generate(*arguments, "--out", tmp_path / "out").returncode == 0
    lines = dumped(tmp_path / "out", tmp_path)
    assert lines[:4] == ["x 4200 1000 300000 300000 900 4", "group 110000 255", "group 66000 0", "group 20000 1"]
    assert lines[-1] == "connector 0 125500 400000 1 0 1 2 1"


def test_sizes_are_the_greatest_of_the_stations(tree: Path, real: str) -> None:
    sizes = (tree / "include/taper/sizes.h").read_text()
    assert "#define TAPER_MAX_CONNECTORS 130\n" in sizes
    assert "#define TAPER_MAX_STEPS 24\n" in sizes
    assert "#define TAPER_MAX_GROUPS 4\n" in sizes
    assert f"#define TAPER_REAL_IS_DOUBLE {int(real == 'double')}\n" in sizes
