"""What a user meets who writes a station file: one line for each mistake, and no half-written output."""

from pathlib import Path

import pytest
from conftest import CODEGEN, STATIONS, Run, content
from station import Station, read_station
from toml_table import TomlError

GOOD = """\
name = "x"
description = "A test station"
[horizon]
steps = 4
step_s = 900
[control]
tick_ms = 1000
min_on_s = 300
min_off_s = 300
[site]
failsafe_kW = 4.2
[[groups]]
name = "feeder-b"
parent = "feeder-a"
limit_kW = 20.0
[[groups]]
name = "site"
limit_kW = 110.0
[[groups]]
name = "feeder-a"
parent = "site"
limit_kW = 66.0
[[connectors]]
count = 61
group = "feeder-b"
kind = "AC"
phases = 3
voltage_V = 230
min_A = 6.0
max_A = 32.0
[[connectors]]
count = 1
group = "site"
kind = "DC"
voltage_V = 400
min_A = 0
max_A = 125.5
"""

# (what to replace in GOOD, by what, key, reason)
MISTAKES = {
    "no value": ("tick_ms = 1000", "tick_ms =", "line 7", "Invalid value"),
    "twice the same key": ("steps = 4", "steps = 4\nsteps = 5", "line 5", "Cannot overwrite a value"),
    "no name": ('name = "x"\n', "", "name", "missing"),
    "name is not the file's": (
        'name = "x"',
        'name = "y"',
        "name",
        '"y" differs from the file\'s name "x"',
    ),
    "name is no identifier": (
        'name = "x"',
        'name = "x-1"',
        "name",
        '"x-1" is not a C identifier (lower case, up to 31 characters)',
    ),
    "name of the firmware's": ('name = "x"', 'name = "osqp"', "name", '"osqp" is taken by the firmware itself'),
    "comment end in description": (
        "A test station",
        "A */ station",
        "description",
        "must be one line of printable text without comment marks",
    ),
    "no section": ("[site]\nfailsafe_kW = 4.2\n", "", "site", "missing"),
    "section is a value": ("[horizon]", "horizon = 3\n[other]", "horizon", "must be a table, not an integer"),
    "unknown section": ("[site]", "[colour]\n[site]", "colour", "unknown key"),
    "unknown key": ("steps = 4", "steps = 4\nsize = 1", "horizon.size", "unknown key"),
    "unknown key of a connector": ('kind = "DC"', 'kind = "DC"\nplug = 1', "connectors[2].plug", "unknown key"),
    "odd key": ("steps = 4", 'steps = 4\n"a b" = 1', "horizon.'a b'", "unknown key"),
    "missing key": ("steps = 4\n", "", "horizon.steps", "missing"),
    "text for a number": ("steps = 4", 'steps = "4"', "horizon.steps", "must be an integer, not a string"),
    "fraction for an integer": ("steps = 4", "steps = 4.0", "horizon.steps", "must be an integer, not a number"),
    "boolean for an integer": ("steps = 4", "steps = true", "horizon.steps", "must be an integer, not a boolean"),
    "boolean for a number": (
        "failsafe_kW = 4.2",
        "failsafe_kW = true",
        "site.failsafe_kW",
        "must be a number, not a boolean",
    ),
    "date for a number": (
        "failsafe_kW = 4.2",
        "failsafe_kW = 2024-01-01",
        "site.failsafe_kW",
        "must be a number, not a date or time",
    ),
    "nan": ("limit_kW = 110.0", "limit_kW = nan", "groups[2].limit_kW", "must be finite, not nan"),
    "infinite": ("max_A = 125.5", "max_A = inf", "connectors[2].max_A", "must be finite, not inf"),
    "huge integer": ("voltage_V = 400", f"voltage_V = 1{'0' * 400}", "connectors[2].voltage_V", "is too large"),
    "no steps": ("steps = 4", "steps = 0", "horizon.steps", "must be 2 to 255, not 0"),
    "too many steps": ("steps = 4", "steps = 256", "horizon.steps", "must be 2 to 255, not 256"),
    "short step": ("step_s = 900", "step_s = 59", "horizon.step_s", "must be 60 to 3600, not 59"),
    "long step": ("step_s = 900", "step_s = 3601", "horizon.step_s", "must be 60 to 3600, not 3601"),
    "no tick": ("tick_ms = 1000", "tick_ms = 0", "control.tick_ms", "must be 1 to 60000, not 0"),
    "negative time": ("min_on_s = 300", "min_on_s = -1", "control.min_on_s", "must be 0 to 86400, not -1"),
    "negative failsafe": (
        "failsafe_kW = 4.2",
        "failsafe_kW = -1",
        "site.failsafe_kW",
        "must be 0 to 3276.7, not -1",
    ),
    "failsafe above the site": (
        "failsafe_kW = 4.2",
        "failsafe_kW = 110.1",
        "site.failsafe_kW",
        "above the site's limit of 110 kW",
    ),
    "limit zero": ("limit_kW = 66.0", "limit_kW = 0", "groups[3].limit_kW", "must be 0.001 to 3276.7, not 0"),
    "limit that the bus cannot say": (
        "limit_kW = 110.0",
        "limit_kW = 4000",
        "groups[2].limit_kW",
        "must be 0.001 to 3276.7, not 4000",
    ),
    "limit in parts of a watt": (
        "limit_kW = 66.0",
        "limit_kW = 66.0001",
        "groups[3].limit_kW",
        "must be a multiple of 0.001, not 66.0001",
    ),
    "odd group name": (
        'name = "feeder-a"',
        'name = "a*/b"',
        "groups[3].name",
        '"a*/b" may have letters, digits, blanks and _ . - only',
    ),
    "group twice": ('name = "feeder-a"', 'name = "site"', "groups[3].name", 'a second group is named "site"'),
    "no such parent": (
        'parent = "feeder-a"',
        'parent = "feeder-z"',
        "groups[1].parent",
        'no group named "feeder-z"',
    ),
    "two sites": (
        'parent = "site"\n',
        "",
        "groups[3].parent",
        'missing; the site, which has none, is already "site"',
    ),
    "no site": (
        'name = "site"\n',
        'name = "site"\nparent = "feeder-a"\n',
        "groups",
        "all have a parent; one must have none: the site",
    ),
    "cycle": ('parent = "site"', 'parent = "feeder-b"', "groups[1].parent", '"feeder-b" is below itself'),
    "own parent": ('parent = "feeder-a"', 'parent = "feeder-b"', "groups[1].parent", '"feeder-b" is below itself'),
    "group without connectors": (
        'group = "feeder-b"',
        'group = "site"',
        "groups",
        'no connector is in "feeder-a" or below it',
    ),
    "no connectors": (GOOD[GOOD.index("[[connectors]]") :], "", "connectors", "missing"),
    "connectors are one table": (
        GOOD[GOOD.index("[[connectors]]") :],
        "[connectors]",
        "connectors",
        "must be an array, not a table",
    ),
    "no such group": ('group = "feeder-b"', 'group = "feeder-z"', "connectors[1].group", 'no group named "feeder-z"'),
    "kind": ('kind = "DC"', 'kind = "dc"', "connectors[2].kind", 'must be "AC" or "DC", not "dc"'),
    "phases of DC": ('kind = "DC"', 'kind = "DC"\nphases = 1', "connectors[2].phases", "is for AC only"),
    "two phases": ("phases = 3", "phases = 2", "connectors[1].phases", "must be 1 or 3, not 2"),
    "AC without phases": ("phases = 3\n", "", "connectors[1].phases", "missing"),
    "no voltage": ("voltage_V = 400", "voltage_V = 0", "connectors[2].voltage_V", "must be 0.001 to 1500, not 0"),
    "minimum above maximum": ("max_A = 32.0", "max_A = 5.9", "connectors[1].min_A", "above max_A (6 > 5.9)"),
    "AC below 6 A": ("min_A = 6.0", "min_A = 5.9", "connectors[1].min_A", "must be at least 6 on AC, or 0 for none, not 5.9"),
    "current too fine": (
        "max_A = 125.5",
        "max_A = 125.55",
        "connectors[2].max_A",
        "must be a multiple of 0.1, not 125.55",
    ),
    "current that the bus cannot say": (
        "max_A = 125.5",
        "max_A = 409.5",
        "connectors[2].max_A",
        "must be 0.1 to 409.4, not 409.5",
    ),
    "too many connectors": ("count = 1\n", "count = 180\n", "connectors[2].count", "makes 241 connectors, at most 240"),
    "no connector in a run": ("count = 1\n", "count = 0\n", "connectors[2].count", "must be 1 to 240, not 0"),
    "too many groups": (
        "[[connectors]]\ncount = 61",
        "".join(f'[[groups]]\nname = "g{k}"\nparent = "site"\nlimit_kW = 1\n' for k in range(252))
        + "[[connectors]]\ncount = 61",
        "groups",
        "at most 254, not 255",
    ),
}


def read(folder: Path, text: str) -> Station:
    (folder / "x.toml").write_text(text, encoding="utf-8")
    return read_station(folder / "x.toml", "stations/x.toml")


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_gives_one_line_with_file_key_and_reason(mistake: str, tmp_path: Path) -> None:
    old, new, key, reason = MISTAKES[mistake]
    assert old in GOOD
    with pytest.raises(TomlError) as error:
        read(tmp_path, GOOD.replace(old, new, 1))
    line = str(error.value)
    assert "\n" not in line
    assert line.startswith(f"stations/x.toml: {key}: {reason}")


def test_a_file_that_is_not_text_tells_the_line(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_bytes(b'name = "x"\ndescription = "\xff"\n')
    with pytest.raises(TomlError, match=r"^x: line 2: not UTF-8$"):
        read_station(tmp_path / "x.toml", "x")


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(TomlError, match=r"^x: file: No such file or directory$"):
        read_station(tmp_path / "x.toml", "x")


def test_all_bad_files_are_told_and_nothing_is_written(generate: Run, tmp_path: Path) -> None:
    stations = tmp_path / "stations"
    stations.mkdir()
    (stations / "x.toml").write_text(GOOD)
    (stations / "bad.toml").write_text("name = ")
    (stations / "worse.toml").write_text(GOOD)
    arguments = ("--real", "double", "--out", "out", "--station-dir", "stations")
    assert generate("--stations", "x", "--no-planner", *arguments, cwd=tmp_path).returncode == 0
    before = content(tmp_path)
    done = generate("--stations", "x,bad,worse,none", *arguments, cwd=tmp_path)
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.splitlines() == [
        "stations/bad.toml: line 1: Invalid value, at the end of the file",
        'stations/worse.toml: name: "x" differs from the file\'s name "worse"',
        "stations/none.toml: file: No such file or directory",
    ]
    assert content(tmp_path) == before


def test_a_parent_stands_before_its_children_and_the_site_first(tmp_path: Path) -> None:
    station = read(tmp_path, GOOD)
    assert [(group.name, group.parent) for group in station.groups] == [
        ("site", None),
        ("feeder-a", 0),
        ("feeder-b", 1),
    ]
    assert station.groups_of(0) == [0, 1, 2]
    assert station.groups_of(61) == [0]
    assert station.connectors_below(1) == list(range(61))


def test_units_are_those_of_the_firmware(tmp_path: Path) -> None:
    station = read(tmp_path, GOOD)
    assert (station.failsafe_W, station.min_on_ms, station.groups[1].limit_W) == (4200, 300_000, 66_000)
    dc = station.connectors[61]
    assert (dc.phases, dc.voltage_mV, dc.min_mA, dc.max_mA) == (1, 400_000, 0, 125_500)


def test_every_sixty_connectors_share_a_bus(tmp_path: Path) -> None:
    connectors = read(tmp_path, GOOD).connectors
    assert [(connectors[k].bus, connectors[k].node) for k in (0, 59, 60, 61)] == [(0, 1), (0, 60), (1, 1), (1, 2)]


@pytest.mark.parametrize(("name", "count"), list(zip(STATIONS, (8, 54, 130, 60, 54), strict=True)))
def test_the_stations_of_the_repository_are_good(name: str, count: int) -> None:
    assert len(read_station(CODEGEN / f"stations/{name}.toml").connectors) == count


def test_caltech_is_wired_as_the_literature_says() -> None:
    """54 sockets of 32 A at 208 V: 26 + 14 + 14 on the pairs of lines, two pods of eight behind 80 A, 150 kVA."""
    station = read_station(CODEGEN / "stations/caltech.toml")
    assert all(c.line_to_line and c.phases == 1 for c in station.connectors)
    assert {(c.voltage_mV, c.max_mA) for c in station.connectors} == {(208_000, 32_000)}
    pairs = [c.rotation for c in station.connectors]
    assert [pairs.count(pair) for pair in ("123", "231", "312")] == [26, 14, 14]
    site, *pods = station.groups
    assert station.site_voltage_mV == 120_000
    assert site.limit_W == 150_000
    assert site.limit_mA == pytest.approx(150_000_000 / 3 / 120, abs=100)
    assert site.delta_mA == pytest.approx(150_000_000 / 3 / 277 * 4, abs=100)  # 480 V to 120 V
    assert [(pod.limit_mA, pod.limit_W, pod.parent) for pod in pods] == [(80_000, 0, 0)] * 2
    below = [[station.connectors[i].rotation for i in station.connectors_below(k)] for k in (1, 2)]
    assert below == [["123"] * 8] * 2


@pytest.mark.parametrize("name", ["hub", "garage", "depot", "caltech"])
def test_every_station_but_the_papers_falls_back_to_the_least_current(name: str) -> None:
    station = read_station(CODEGEN / f"stations/{name}.toml")
    assert {c.fallback_mA for c in station.connectors} == {6_000}
    assert (station.ramp_mA_per_s, station.deadband_mA) == (2_000, 500)


def test_the_garage_is_spread_over_the_phases_and_limited_in_power_alone() -> None:
    station = read_station(CODEGEN / "stations/garage.toml")
    rotations = [c.rotation for c in station.connectors]
    assert [rotations.count(rotation) for rotation in ("123", "231", "312")] == [18, 18, 18]
    assert not any(group.limits_phases for group in station.groups)
