"""The stations' C tables: they compile without a warning and hold what the station files say."""

import subprocess
import tomllib
from pathlib import Path

import pytest
from conftest import CODEGEN, ROOT, STATIONS, Run, compile_c
from station_texts import EDGES, WIRED, twelve_groups
from test_station_files import GOOD

DUMP = Path(__file__).with_name("dump_stations.c")
STRICT = ("-Wpedantic", "-Wconversion", "-Wshadow")
INCLUDES = [ROOT / f"firmware/{layer}/include" for layer in ("types", "app")]
CHECK = [ROOT / f"firmware/{source}" for source in ("app/src/config_check.c", "types/src/rows.c")]

# taper_rotation_t: of three phases, and of the first conductors of one phase or of a pair of lines.
ROTATIONS = {"L1-L2-L3": 1, "L2-L3-L1": 2, "L3-L1-L2": 3, "L1-L3-L2": 4, "L2-L1-L3": 5, "L3-L2-L1": 6}
FIRST = {"L1": 1, "L2": 2, "L3": 3, "L1-L2": 1, "L2-L3": 2, "L3-L1": 3}


def dumped(tree: Path, folder: Path) -> list[str]:
    """What a C program reads out of the tables; it fails if the boot-time check refuses them."""
    compile_c([DUMP, tree / "stations.c", *CHECK], [tree / "include", *INCLUDES], folder / "dump", *STRICT)
    return subprocess.run([folder / "dump"], capture_output=True, text=True, check=True).stdout.splitlines()


def thousandths(table: dict, key: str, default: float = 0) -> int:
    return round(table.get(key, default) * 1000)


def line(*values: object) -> str:
    return " ".join(str(int(value) if isinstance(value, bool) else value) for value in values)


def expected(station: dict) -> list[str]:
    """The same lines straight from the TOML, for a file whose groups are in the right order already."""
    names = [group["name"] for group in station["groups"]]
    lines = [expected_station(station), expected_planning(station.get("planning", {}))]
    for group in station["groups"]:
        parent = names.index(group["parent"]) if "parent" in group else 255
        volts = station["site"].get("voltage_V", 230)
        delta_mA = int(thousandths(group, "delta_side_A") * group.get("delta_side_V", 0) / volts)
        limits = thousandths(group, "limit_kW"), thousandths(group, "limit_A")
        lines.append(line("group", *limits, delta_mA, thousandths(group, "imbalance_A"), parent))
    number = 0
    for run in station["connectors"]:
        for _ in range(run["count"]):
            place = names.index(run["group"]), number // 60, number % 60 + 1
            lines.append(line("connector", *expected_connector(run), *place, run["kind"] == "DC"))
            number += 1
    return lines


def expected_station(station: dict) -> str:
    site, control = station["site"], station["control"]
    load = thousandths(site, "other_load_kW"), thousandths(site, "other_load_A"), thousandths(site, "voltage_V", 230)
    times = [control["tick_ms"], *(thousandths(control, f"min_{to}_s") for to in ("on", "off"))]
    times += [thousandths(control, "turn_s", 900), thousandths(control, "change_s", 5)]
    movement = thousandths(control, "ramp_A_per_s"), thousandths(control, "deadband_A")
    price = thousandths(station.get("planning", {}), "price_weight")
    between = any("between" in run for run in station["connectors"])
    horizon = station["horizon"]["step_s"], station["horizon"]["steps"]
    failsafe_W = thousandths(site, "failsafe_kW")
    return line(station["name"], failsafe_W, *load, *times, *movement, price, between, *horizon)


def expected_planning(planning: dict) -> str:
    objective = ("throughput", "log-utility").index(planning.get("objective", "throughput"))
    counts = planning.get("horizon_steps", 0), planning.get("outer_iterations", 0), planning.get("taper_lines", 1)
    switches = planning.get("replan") == "events", planning.get("learn_taper", False)
    return line("planning", objective, *counts, *switches, thousandths(planning, "lambda_per_kWh2"))


def expected_connector(run: dict) -> tuple[int, ...]:
    is_dc = run["kind"] == "DC"
    currents = (thousandths(run, f"{kind}_A") for kind in ("min", "max", "fallback"))
    reaction_ms = thousandths(run, "reaction_s", 1 if is_dc else 5)
    efficiency = thousandths(run, "efficiency", 0.95 if is_dc else 1)
    first = FIRST[run.get("between", run.get("phase", "L1"))]
    rotation = ROTATIONS[run["rotation"]] if "rotation" in run else first
    wiring = efficiency, run.get("phases", 1), rotation, "between" in run
    return *currents, thousandths(run, "voltage_V"), reaction_ms, *wiring


def test_the_tables_say_what_the_station_files_say(tree: Path, tmp_path: Path) -> None:
    lines: list[str] = []
    for name in STATIONS:
        lines += expected(tomllib.loads((CODEGEN / f"stations/{name}.toml").read_text()))
    assert dumped(tree, tmp_path) == lines


def tables_of(generate: Run, text: str, folder: Path) -> list[str]:
    (folder / "x.toml").write_text(text)
    arguments = ("--stations", "x", "--real", "float", "--station-dir", folder, "--no-planner")
    assert generate(*arguments, "--out", folder / "out").returncode == 0
    return dumped(folder / "out", folder)


def test_groups_are_sorted_and_what_is_left_out_has_its_default(generate: Run, tmp_path: Path) -> None:
    lines = tables_of(generate, GOOD, tmp_path)
    assert lines[:5] == [
        "x 4200 0 0 230000 1000 300000 300000 900000 5000 0 0 0 0 900 4",
        "planning 0 0 0 1 0 0 0",
        "group 110000 0 0 0 255",
        "group 66000 0 0 0 0",
        "group 20000 0 0 0 1",
    ]
    assert lines[5] == "connector 6000 32000 0 230000 5000 1000 3 1 0 2 0 1 0"
    assert lines[-1] == "connector 0 125500 0 400000 1000 950 1 1 0 0 1 2 1"


def test_every_quantity_of_a_file_reaches_its_place(generate: Run, tmp_path: Path) -> None:
    lines = tables_of(generate, WIRED, tmp_path)
    assert lines == [
        "x 20000 40000 120000 120000 1000 300000 240000 600000 7500 1500 300 250 1 900 4",
        "planning 1 3 4 2 1 1 12500",
        "group 150000 416600 0 0 255",
        "group 0 200000 722000 20000 0",
        "connector 6000 32000 6000 120000 5000 1000 3 5 0 1 0 1 0",
        "connector 6000 32000 8000 120000 2500 1000 1 3 0 1 0 2 0",
        "connector 6000 32000 0 208000 5000 1000 1 3 1 1 0 3 0",
        "connector 1000 60000 1000 400000 500 925 1 1 0 1 0 4 1",
    ]


@pytest.mark.parametrize("text", [twelve_groups(), EDGES], ids=["twelve groups", "edges"])
def test_what_a_file_may_say_passes_the_check_at_boot(text: str, generate: Run, tmp_path: Path) -> None:
    lines, said = tables_of(generate, text, tmp_path), expected(tomllib.loads(text))
    assert lines[0] == said[0]
    assert len(lines) == len(said)


def test_sizes_are_the_greatest_of_the_stations(tree: Path, real: str) -> None:
    sizes = (tree / "include/taper/sizes.h").read_text()
    assert "#define TAPER_MAX_CONNECTORS 130\n" in sizes
    assert "#define TAPER_MAX_STEPS 24\n" in sizes
    assert "#define TAPER_MAX_GROUPS 4\n" in sizes
    assert f"#define TAPER_REAL_IS_DOUBLE {int(real == 'double')}\n" in sizes
