"""Taper in ACN-Sim: its network and ours are the same, and days there break nothing and lose nothing."""

import json

import acnsim
import numpy as np
import pytest
from conftest import LIBRARY, ROOT
from taperlib import acn_world as world
from taperlib.acn_taper import STATION, connectors_of, set_limits
from taperlib.files import InputError
from taperlib.scheduler import Scheduler

# A day that the test has time for: a small transformer is full by the morning.
SHORT_DAY = ["--cars", "60", "--transformer-kw", "60", "--until-hour", "10.5", "--library", str(LIBRARY)]
NEAR_A = 0.02  # in sum: limits and currents are in mA here


@pytest.fixture(scope="module")
def network():
    return world.network_of(basic=True, transformer_kw=150.0)


@pytest.fixture
def caltech(network):
    with Scheduler(STATION, library=LIBRARY) as scheduler:
        set_limits(network, scheduler)
        yield scheduler


def test_every_evse_has_a_connector_on_its_lines_and_in_its_pod(network, caltech):
    connectors = connectors_of(network, caltech)
    assert sorted(connectors.values()) == list(range(54))
    pods = {name: [caltech.connectors[connectors[station]].group for k, station in enumerate(network.station_ids)
                   if network.constraint_matrix[network.constraint_index.index(name), k] != 0]
            for name in ("AV Pod", "CC Pod")}
    assert pods == {"AV Pod": [1] * 8, "CC Pod": [2] * 8}


def test_limits_are_the_networks_and_none_is_looser(network, caltech):
    limits = dict(zip(network.constraint_index, network.magnitudes, strict=True))
    site, av_pod, cc_pod = caltech.groups
    assert 0 <= limits["Secondary A"] - site.line_A < 0.001
    assert 0 <= limits["Primary A"] - site.delta_A / 4 < 0.001
    assert (av_pod.line_A, cc_pod.line_A) == (limits["AV Pod"], limits["CC Pod"]) == (80, 80)


def _limit_of(direction, holds):
    """The factor at which `direction` stops to hold, by bisection."""
    low, high = 0.0, 64.0 / direction.max()
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle * direction) else (low, middle)
    return low


def test_both_networks_end_in_every_direction_at_the_same_currents(network, caltech):
    """Two judgements that share no code: acnportal's complex matrix, and the firmware's guard in integers."""
    connectors = connectors_of(network, caltech)
    order = [connectors[station] for station in network.station_ids]
    random = np.random.RandomState(7)

    def ours(currents_a):
        told = np.zeros(54)
        told[order] = currents_a
        return caltech.holds(told.tolist())

    pairs = np.round(network._phase_angles).astype(int)
    for trial in range(60):
        weights = {angle: random.random_sample() ** 3 for angle in (30, -90, 150)}
        direction = np.array([weights[angle] for angle in pairs]) * (random.random_sample(54) < 0.7)
        if trial % 3 == 0:
            direction[pairs == 30] = 0.001  # the pods say nothing
        theirs = _limit_of(direction, lambda currents_a: network.is_feasible(currents_a[:, np.newaxis]))
        assert np.abs(theirs - _limit_of(direction, ours)) * direction.sum() < NEAR_A, (trial, weights)


@pytest.mark.parametrize("more", [["--algorithms", "edf,llf"], ["--evse", "real", "--no-soc", "--algorithms", "llf"]],
                         ids=["any current", "steps, and no SOC told"])
def test_a_generated_day_breaks_nothing_and_delivers_no_less_than_the_best(more, tmp_path):
    assert acnsim.main([*SHORT_DAY, *more, "--out", str(tmp_path / "day.json")]) == 0
    taper, _, *others = json.loads((tmp_path / "day.json").read_text())["days"][0]["outcomes"]
    assert taper["name"] == "taper soc-mpc"
    assert taper["of_pilots"]["periods"] == taper["of_rates"]["periods"] == 0
    assert taper["delivered_kwh"] >= max(one["delivered_kwh"] for one in others)
    assert max(one["utilisation"] for one in others) > 0.95  # the day is busy enough to be about something


def outcome(name, delivered_kwh, violations=0):
    none = world.Violations(0, 0.0)
    return world.Outcome(name, delivered_kwh, 100.0, 5, 10, 100.0, 1.0, world.Violations(violations, 1.0), none, 1.0, 1.0)


@pytest.mark.parametrize(("taper", "words"), [
    (outcome("taper soc-mpc", 89.98), "less than edf"),
    (outcome("taper soc-mpc", 95.0, violations=1), "violates constraints in 1 periods"),
])
def test_a_day_on_which_taper_fails_is_told(taper, words):
    assert words in "\n".join(acnsim.verdict([taper, outcome("edf", 90.0), outcome("uncontrolled", 99.0)], ["edf"]))


def test_a_violation_is_found_and_measured():
    """The judgement of runs, on currents of which it is known: uncontrolled charging of everybody."""
    network = world.network_of(basic=True, transformer_kw=150.0)
    found = world.violations_of(network, np.tile(np.array([32.0, 10.0]), (54, 1)))
    assert found.periods == 1
    excess_a = np.abs(network.constraint_current(np.full((54, 1), 32.0)))[:, 0] - network.magnitudes
    assert found.most_a == pytest.approx(excess_a.max())


def test_generated_days_repeat_and_fit_the_network():
    stations = world.network_of(basic=True, transformer_kw=150.0).station_ids
    first, again, other = (world.generated_day(stations, 110, seed) for seed in (1, 1, 2))
    assert first == again != other
    for stay in first:
        assert stay.station_id in stations
        assert 0 <= stay.initial_kwh <= stay.capacity_kwh - stay.request_kwh
        assert not [one for one in first if one is not stay and one.station_id == stay.station_id
                    and one.arrival < stay.departure and stay.arrival < one.departure]


def test_the_recorded_week_is_replayed_at_its_own_sockets():
    stations = world.network_of(basic=True, transformer_kw=150.0).station_ids
    stays = acnsim.recorded_week(ROOT / "host_sim/data/acn-caltech-2019-07-14.csv", stations, seed=0)
    assert len(stays) == 204
    with pytest.raises(InputError, match="none of the network's stations"):
        acnsim.recorded_week(ROOT / "host_sim/data/acn-jpl-2019-10-06.csv", stations, seed=0)


def test_an_unknown_algorithm_is_refused(capsys):
    assert acnsim.main(["--algorithms", "edf,lottery"]) == 1
    assert "'lottery' is none of edf, llf" in capsys.readouterr().err
