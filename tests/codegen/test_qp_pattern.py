"""The matrices' structure, which the firmware fills in by position: a small station, written out by hand."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
import qp
from rows import planned_rows
from station import Connector, Group, Station
from station_model import Planning

N, T = 3, 3


@pytest.fixture
def station() -> Station:
    """Connectors 0 and 1 on a feeder, connector 2 on the site itself."""

    def connector(group: int, node: int) -> Connector:
        return Connector("AC", 1, 230_000, 6_000, 32_000, group, 0, node)

    groups = (Group("site", 10_000, None), Group("feeder", 5_000, 0))
    connectors = (connector(1, 1), connector(1, 2), connector(0, 3))
    return Station(
        name="x",
        description="",
        steps=T,
        step_s=900,
        tick_ms=1000,
        min_on_ms=0,
        min_off_ms=0,
        failsafe_W=0,
        other_load_W=0,
        site_voltage_mV=230_000,
        groups=groups,
        connectors=connectors,
    )


def test_rows_stand_in_the_documented_order(station: Station) -> None:
    a = qp.constraint_matrix(station).toarray()
    assert a.shape == (9 + 6 + 3 + 6, 9)
    v = np.arange(1.0, 10.0) ** 2
    x = v.reshape(N, T)
    rates = np.diff(x, axis=1, prepend=0.0)
    site = sqrt(5 / 3) * rates.sum(axis=0)
    feeder = sqrt(5 / 2) * rates[:2].sum(axis=0)
    tapers = x[:, 1:] - 0.97 * x[:, :-1]
    expected = [rates.ravel(), tapers.ravel(), 0.58 * x[:, -1], site, feeder]
    assert a @ v == pytest.approx(np.concatenate(expected))


def test_entries_stand_in_the_order_that_the_firmware_writes(station: Station) -> None:
    a = qp.constraint_matrix(station)
    s, f, keep = sqrt(5 / 3), sqrt(5 / 2), 0.97
    assert a.has_sorted_indices
    columns = [a.data[a.indptr[k] : a.indptr[k + 1]].tolist() for k in range(9)]
    assert columns[0] == pytest.approx([1, -1, -keep, s, -s, f, -f])  # connector 0, first step
    assert columns[1] == pytest.approx([1, -1, 1, -keep, s, -s, f, -f])
    assert columns[2] == pytest.approx([1, 1, 0.58, s, f])  # last step
    assert columns[8] == pytest.approx([1, 1, 0.58, s])  # connector 2 is not on the feeder


def test_second_lines_follow_on_the_first_ones(station: Station) -> None:
    two = replace(station, planning=Planning(taper_lines=2))
    a = qp.constraint_matrix(two)
    assert a.shape == (9 + 6 + 6 + 3 + 6, 9)
    one = qp.constraint_matrix(station).toarray()
    tapers = one[9:15]
    assert np.array_equal(a.toarray(), np.vstack([one[:15], tapers, one[15:]]))
    columns = [a.data[a.indptr[k] : a.indptr[k + 1]].tolist() for k in range(9)]
    s, f, keep = sqrt(5 / 3), sqrt(5 / 2), 0.97
    assert columns[0] == pytest.approx([1, -1, -keep, -keep, s, -s, f, -f])
    assert columns[1] == pytest.approx([1, -1, 1, -keep, 1, -keep, s, -s, f, -f])
    assert columns[2] == pytest.approx([1, 1, 1, 0.58, s, f])


def test_the_cost_is_that_of_the_discounted_power(station: Station) -> None:
    p = qp.cost_matrix(station)
    assert p.has_sorted_indices
    assert p.nnz == N * (2 * T - 1)
    v = np.arange(1.0, 10.0) ** 2
    rates = np.diff(v.reshape(N, T), axis=1, prepend=0.0)
    full = p + p.T - np.diag(p.diagonal())
    cost = (0.1 / 2 * 0.95 ** np.arange(1, T + 1) * rates**2).sum()
    assert v @ full @ v / 2 == pytest.approx(cost)
    assert p.indices.tolist()[:5] == [0, 0, 1, 1, 2]


def test_limits_of_phases_are_rows_of_those_who_draw_from_them(station: Station) -> None:
    """Connector 0 on L1, 1 between L2 and L3, 2 a converter: 400 V at 0.95 are 422 W, or 0.612 A on each phase.

    Of the feeder's delta lines, those are left out in which nobody weighs more than in another one.
    """
    site, feeder = station.groups
    groups = (replace(site, limit_mA=100_000), replace(feeder, limit_W=0, delta_mA=50_000, imbalance_mA=9_000))
    first, second, third = station.connectors
    second = replace(second, voltage_mV=400_000, rotation="231", line_to_line=True)
    third = replace(third, kind="DC", voltage_mV=400_000, efficiency_permille=950)
    rows = planned_rows(replace(station, groups=groups, connectors=(first, second, third)))
    assert [(row.group, row.kind, row.weights) for row in rows] == [
        (0, "POWER", {0: 230, 1: 400, 2: 422}),
        (0, "L1", {0: 1, 2: 0.612}),
        (0, "L2", {1: 1, 2: 0.612}),
        (0, "L3", {1: 0.733, 2: 0.612}),
        (0, "L1_B", {0: 1, 2: 0.612}),
        (0, "L2_B", {1: 0.733, 2: 0.612}),
        (0, "L3_B", {1: 1, 2: 0.612}),
        (1, "DELTA_L2", {0: 1, 1: 1}),
        (1, "DELTA_L3", {1: 2}),
        (1, "L1_L2", {0: 1, 1: -1}),
        (1, "L3_L1", {0: -1, 1: 1}),
    ]


def test_no_row_begins_as_an_equality(station: Station) -> None:
    low, high = qp.neutral_bounds(station)
    assert len(low) == len(high) == qp.layout(station).rows
    assert (low < high).all()
    assert np.isfinite([low, high]).all()


def test_a_horizon_of_one_step_has_no_taper_rows(station: Station) -> None:
    one = replace(station, steps=1)
    assert qp.constraint_matrix(one).shape == (3 + 0 + 3 + 2, 3)
