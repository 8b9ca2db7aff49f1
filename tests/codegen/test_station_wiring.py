"""What a station file says of phases, wiring, fallback currents and movement, and the mistakes there."""

from pathlib import Path

import pytest
from station import Station
from station_texts import WIRED, twelve_groups
from test_station_files import read
from toml_table import TomlError

# (what to replace in WIRED, by what, key, reason)
MISTAKES = {
    "turn below the least time on": ("turn_s = 600", "turn_s = 299", "control.turn_s", "below min_on_s (299 < 300)"),
    "turn of more than a day": ("turn_s = 600", "turn_s = 86401", "control.turn_s", "must be 0 to 86400, not 86401"),
    "negative change": ("change_s = 7.5", "change_s = -1", "control.change_s", "must be 0 to 600, not -1"),
    "negative ramp": (
        "ramp_A_per_s = 1.5",
        "ramp_A_per_s = -1",
        "control.ramp_A_per_s",
        "must be 0 to 409.4, not -1",
    ),
    "text for a ramp": (
        "ramp_A_per_s = 1.5",
        'ramp_A_per_s = "none"',
        "control.ramp_A_per_s",
        "must be a number, not a string",
    ),
    "huge deadband": ("deadband_A = 0.3", "deadband_A = 500", "control.deadband_A", "must be 0 to 409.4, not 500"),
    "price weight above 1": (
        "price_weight = 0.25",
        "price_weight = 2",
        "planning.price_weight",
        "must be 0 to 1, not 2",
    ),
    "unknown key of planning": ("price_weight = 0.25", "prices = 1", "planning.prices", "unknown key"),
    "unknown objective": ('"log-utility"', '"energy"', "planning.objective", '"energy" is not one of throughput, log-utility'),
    "log utility without its weight": ("lambda_per_kWh2 = 12.5", "", "planning.lambda_per_kWh2", "missing; the log utility needs it"),
    "lambda of a finer step": ("12.5", "12.5001", "planning.lambda_per_kWh2", "must be a multiple of 0.001, not 12.5001"),
    "no outer iteration": ("outer_iterations = 4", "outer_iterations = 0", "planning.outer_iterations", "must be 1 to 20, not 0"),
    "horizon beyond the steps": ("horizon_steps = 3", "horizon_steps = 5", "planning.horizon_steps", "must be 2 to 4, not 5"),
    "unknown rule of planning anew": ('"events"', '"always"', "planning.replan", '"always" is not one of steps, events'),
    "three lines of a taper": ("taper_lines = 2", "taper_lines = 3", "planning.taper_lines", "must be 1 to 2, not 3"),
    "planning is a value": ("[planning]", "planning = 1\n[other]", "control.planning", "unknown key"),
    "failsafe above the site": (
        "failsafe_kW = 20.0",
        "failsafe_kW = 151",
        "site.failsafe_kW",
        "above the site's limit of 150 kW",
    ),
    "other load of unknown current": (
        "other_load_A = 120.0\n",
        "",
        "site.other_load_A",
        "missing; the site has limit_A, of which other_load_kW takes its part",
    ),
    "other load that its currents cannot be": (
        "other_load_A = 120.0",
        "other_load_A = 111.1",
        "site.other_load_A",
        "three phases of it are less than other_load_kW",
    ),
    "current of no other load": (
        "other_load_kW = 40.0\n",
        "",
        "site.other_load_A",
        "without other_load_kW",
    ),
    "other load on a delta side": (
        "limit_A = 416.6",
        "limit_A = 416.6\ndelta_side_A = 180.5\ndelta_side_V = 480",
        "site.other_load_kW",
        "a site with delta_side_A can have none: how it is wired is not known",
    ),
    "voltage that no mains has": (
        "voltage_V = 120\n",
        "voltage_V = 0.12\n",
        "site.voltage_V",
        "must be 50 to 1500, not 0.12",
    ),
    "site without power": ("limit_kW = 150.0\n", "", "groups[1].limit_kW", "missing; the site needs one"),
    "group without a limit": (
        "limit_A = 200.0\n",
        "",
        "groups[2].limit_kW",
        "missing, and so is limit_A; a group needs one of them",
    ),
    "limit of no current": ("limit_A = 200.0", "limit_A = 0", "groups[2].limit_A", "must be 0.1 to 10000, not 0"),
    "no imbalance at all": (
        "imbalance_A = 20.0",
        "imbalance_A = 0",
        "groups[2].imbalance_A",
        "must be 0.1 to 10000, not 0",
    ),
    "delta side without its voltage": (
        "delta_side_V = 480\n",
        "",
        "groups[2].delta_side_V",
        "missing beside delta_side_A",
    ),
    "delta side without its current": (
        "delta_side_A = 180.5\n",
        "",
        "groups[2].delta_side_A",
        "missing beside delta_side_V",
    ),
    "delta side without the wye side": (
        "voltage_V = 120\n",
        "",
        "groups[2].delta_side_V",
        "needs voltage_V of the site, phase to neutral on the wye side",
    ),
    "delta side of too much current": (
        "delta_side_A = 180.5",
        "delta_side_A = 5001",
        "groups[2].delta_side_A",
        "is 20004 A on the wye side, which must be 0.1 to 20000",
    ),
    "rotation that is none": (
        'rotation = "L2-L1-L3"',
        'rotation = "L1-L1-L3"',
        "connectors[1].rotation",
        "must be one of L1-L2-L3, L2-L3-L1, L3-L1-L2, L1-L3-L2, L2-L1-L3, L3-L2-L1, not \"L1-L1-L3\"",
    ),
    "phase of three phases": ("rotation =", "phase =", "connectors[1].phase", "is for one phase only"),
    "three phases between two lines": (
        'rotation = "L2-L1-L3"',
        'between = "L1-L2"',
        "connectors[1].between",
        "is for one phase only",
    ),
    "rotation of one phase": (
        'phase = "L3"',
        'rotation = "L1-L2-L3"',
        "connectors[2].rotation",
        "is for three phases only",
    ),
    "phase that is none": (
        'phase = "L3"',
        'phase = "N"',
        "connectors[2].phase",
        'must be one of L1, L2, L3, not "N"',
    ),
    "number for a phase": ('phase = "L3"', "phase = 3", "connectors[2].phase", "must be a string, not an integer"),
    "phase not told below limits of phases": (
        'phase = "L3"\n',
        "",
        "connectors[2].phase",
        'missing; "site" limits each phase (or say `between` for line to line)',
    ),
    "phase and pair": (
        'between = "L1-L3"',
        'between = "L1-L3"\nphase = "L1"',
        "connectors[3].phase",
        "is not for a connector between two lines",
    ),
    "pair that is none": (
        'between = "L1-L3"',
        'between = "L1-N"',
        "connectors[3].between",
        'must be one of L1-L2, L2-L1, L2-L3, L3-L2, L3-L1, L1-L3, not "L1-N"',
    ),
    "DC has no phases": ('kind = "DC"', 'kind = "DC"\nphases = 3', "connectors[4].phases", "is for AC only"),
    "DC has no rotation": (
        'kind = "DC"',
        'kind = "DC"\nrotation = "L1-L2-L3"',
        "connectors[4].rotation",
        "is for AC only",
    ),
    "DC has no phase": ('kind = "DC"', 'kind = "DC"\nphase = "L1"', "connectors[4].phase", "is for AC only"),
    "DC is between no lines": (
        'kind = "DC"',
        'kind = "DC"\nbetween = "L1-L2"',
        "connectors[4].between",
        "is for AC only",
    ),
    "AC has no converter": (
        'phase = "L3"',
        'phase = "L3"\nefficiency = 0.95',
        "connectors[2].efficiency",
        "is for DC only",
    ),
    "efficiency zero": (
        "efficiency = 0.925",
        "efficiency = 0",
        "connectors[4].efficiency",
        "must be 0.001 to 1, not 0",
    ),
    "efficiency above 1": (
        "efficiency = 0.925",
        "efficiency = 95",
        "connectors[4].efficiency",
        "must be 0.001 to 1, not 95",
    ),
    "efficiency that is a mistake": (
        "efficiency = 0.925",
        "efficiency = 0.009",
        "connectors[4].efficiency",
        "1 A would take more than 100 A of the supply",
    ),
    "slow reaction": ("reaction_s = 2.5", "reaction_s = 61", "connectors[2].reaction_s", "must be 0 to 60, not 61"),
    "fallback below the least current": (
        "fallback_A = 8.0",
        "fallback_A = 5.9",
        "connectors[2].fallback_A",
        "must be 0, or min_A to max_A (6 to 32), not 5.9",
    ),
    "fallback above the greatest current": (
        "fallback_A = 8.0",
        "fallback_A = 32.1",
        "connectors[2].fallback_A",
        "must be 0, or min_A to max_A (6 to 32), not 32.1",
    ),
    "fallback of more than the failsafe limit": (
        "failsafe_kW = 20.0",
        "failsafe_kW = 2.159",
        "connectors[1].fallback_A",
        "2.16 kW, above the site's failsafe_kW of 2.159",
    ),
    "least current of more power than a feeder has": (
        "limit_A = 200.0",
        "limit_A = 200.0\nlimit_kW = 2.159",
        "connectors[1].min_A",
        '6 A need 2.16 kW, above limit_kW of "feeder"',
    ),
    "least current of more than a phase has": (
        "limit_A = 200.0",
        "limit_A = 5.9",
        "connectors[1].min_A",
        '6 A need 6 A of a phase, above limit_A of "feeder"',
    ),
    "least current of more than the site has": (
        "limit_A = 416.6",
        "limit_A = 5.9",
        "connectors[1].min_A",
        '6 A need 6 A of a phase, above limit_A of "site"',
    ),
    "least current of three phases of more than a delta side has": (
        "delta_side_A = 180.5",
        "delta_side_A = 2.599",  # 10.396 A on the wye side, below sqrt(3) times 6 A
        "connectors[1].min_A",
        '6 A are too much for delta_side_A of "feeder"',
    ),
    "least current of a pair of more than a delta side has": (
        "delta_side_A = 180.5",
        "delta_side_A = 2.9",
        "connectors[3].min_A",
        '6 A are too much for delta_side_A of "feeder"',
    ),
    "least current of one phase above the imbalance": (
        "imbalance_A = 20.0",
        "imbalance_A = 5.9",
        "connectors[2].min_A",
        '6 A on one phase are above imbalance_A of "feeder"',
    ),
    "least direct current of more than a phase has": (
        "voltage_V = 400\nmin_A = 1.0\nmax_A = 60.0\nfallback_A = 1.0",
        "voltage_V = 1000\nmin_A = 80.0\nmax_A = 80.0",
        "connectors[4].min_A",
        '80 A need 240.48 A of a phase, above limit_A of "feeder"',
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_gives_one_line_with_file_key_and_reason(mistake: str, tmp_path: Path) -> None:
    old, new, key, reason = MISTAKES[mistake]
    assert WIRED.count(old) >= 1
    with pytest.raises(TomlError) as error:
        read(tmp_path, WIRED.replace(old, new, 1))
    assert str(error.value) == f"stations/x.toml: {key}: {reason}"


def changed(folder: Path, *changes: tuple[str, str]) -> Station:
    text = WIRED
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return read(folder, text)


@pytest.mark.parametrize(
    ("name", "code"),
    [
        ("L1-L2-L3", "123"),
        ("L2-L3-L1", "231"),
        ("L3-L1-L2", "312"),
        ("L1-L3-L2", "132"),
        ("L2-L1-L3", "213"),
        ("L3-L2-L1", "321"),
    ],
)
def test_a_rotation_names_the_supply_phases_of_three_conductors(name: str, code: str, tmp_path: Path) -> None:
    assert changed(tmp_path, ("L2-L1-L3", name)).connectors[0].rotation == code


@pytest.mark.parametrize(("name", "code"), [("L1", "123"), ("L2", "231"), ("L3", "312")])
def test_a_phase_is_the_first_of_a_rotation(name: str, code: str, tmp_path: Path) -> None:
    assert changed(tmp_path, ('phase = "L3"', f'phase = "{name}"')).connectors[1].rotation == code


@pytest.mark.parametrize(
    ("name", "code"),
    [("L1-L2", "123"), ("L2-L1", "123"), ("L2-L3", "231"), ("L3-L2", "231"), ("L3-L1", "312"), ("L1-L3", "312")],
)
def test_a_pair_of_lines_is_the_first_two_of_a_rotation_in_any_order(name: str, code: str, tmp_path: Path) -> None:
    connector = changed(tmp_path, ('between = "L1-L3"', f'between = "{name}"')).connectors[2]
    assert (connector.rotation, connector.line_to_line, connector.phases) == (code, True, 1)


def test_a_station_is_line_to_line_if_some_connector_is(tmp_path: Path) -> None:
    assert changed(tmp_path).line_to_line
    assert not changed(tmp_path, ('between = "L1-L3"', 'phase = "L1"')).line_to_line


def test_the_phase_may_be_left_out_where_no_group_above_limits_phases(tmp_path: Path) -> None:
    """Another feeder may limit them."""
    power_only = ("limit_A = 416.6\n", "")
    lonely = ('group = "feeder"\nkind = "AC"\nphases = 1\nphase = "L3"', 'group = "site"\nkind = "AC"\nphases = 1')
    assert changed(tmp_path, power_only, lonely).connectors[1].rotation == "123"


@pytest.mark.parametrize("limit", ["limit_A = 300", "imbalance_A = 30", "delta_side_A = 90\ndelta_side_V = 480"])
def test_any_limit_of_phases_on_the_way_up_needs_the_phase(limit: str, tmp_path: Path) -> None:
    site = ("other_load_kW = 40.0\nother_load_A = 120.0\n", ""), ("limit_A = 416.6", limit)
    feeder = ("limit_A = 200.0\ndelta_side_A = 180.5\ndelta_side_V = 480\nimbalance_A = 20.0", "limit_kW = 90")
    with pytest.raises(TomlError, match=r'connectors\[2\]\.phase: missing; "site" limits each phase'):
        changed(tmp_path, *site, feeder, ('phase = "L3"\n', ""))


def test_a_limit_of_the_delta_side_counts_on_the_wye_side(tmp_path: Path) -> None:
    assert changed(tmp_path).groups[1].delta_mA == 722_000  # 480 V / 120 V of windings
    uneven = changed(tmp_path, ("delta_side_V = 480", "delta_side_V = 400"))
    assert uneven.groups[1].delta_mA == 601_666  # rounded down


def test_a_turn_is_a_quarter_of_an_hour_or_the_least_time_on_if_that_is_longer(tmp_path: Path) -> None:
    assert changed(tmp_path, ("turn_s = 600\n", "")).turn_ms == 900_000
    assert changed(tmp_path, ("turn_s = 600\n", ""), ("min_on_s = 300", "min_on_s = 1200")).turn_ms == 1_200_000


def test_a_limit_that_just_has_room_for_the_least_current_is_enough(tmp_path: Path) -> None:
    limits = ("limit_A = 200.0", "limit_A = 7\nlimit_kW = 2.16"), ("imbalance_A = 20.0", "imbalance_A = 6")
    pair = ("delta_side_A = 180.5", "delta_side_A = 3")  # 12 A on the wye side: 6 A in each of two windings
    assert changed(tmp_path, *limits, pair).groups[1].limit_mA == 7_000


def test_a_child_may_have_a_higher_limit_than_its_parent(tmp_path: Path) -> None:
    station = changed(tmp_path, ("limit_A = 200.0", "limit_A = 900.0\nlimit_kW = 500.0"))
    assert station.groups[1].limit_mA > station.groups[0].limit_mA


def test_power_of_a_connector_counts_conductors_and_losses(tmp_path: Path) -> None:
    assert [connector.W_per_A for connector in changed(tmp_path).connectors] == [360, 120, 208, 433]


def test_a_tree_of_twelve_groups_is_laid_out_from_the_site_down(tmp_path: Path) -> None:
    station = read(tmp_path, twelve_groups())
    names = [group.name for group in station.groups]
    assert names[:2] == ["site", "f1"]
    assert len(names) == 12
    assert all(group.parent is None or group.parent < k for k, group in enumerate(station.groups))
    ways = [[names[k] for k in station.groups_of(3 * pod)] for pod in range(3)]
    assert ways == [["site", "f1", "p0"], ["site", "f1", "f2", "p1"], ["site", "f1", "f2", "f3", "p2"]]
    assert len(station.connectors_below(names.index("f1"))) == 24
    assert len(station.connectors_below(names.index("f3"))) == 6
