"""tools/results.py: what it promises, and that it says so when a promise is broken. The cases themselves are too long."""

from pathlib import Path

import pytest
import results
from taperlib.limits import read_limit_csv


def row(share=99.9, satisfied=100, cost=0.20, violations=0):
    return {"energy_kwh": f"{10 * share}", "share_of_bound_percent": f"{share}", "sessions": "120",
            "satisfied": f"{satisfied}", "cost_per_kwh": f"{cost}", "violations": f"{violations}"}


def drop(**ours):
    return results.broken_by_drop({"soc-mpc": row(**ours), "edf-soc": row(97.0, 99), "llf": row(99.5, 98)})


def test_a_drop_keeps_the_share_and_the_sessions():
    assert drop(share=99.3, satisfied=99) == []


def test_a_drop_that_costs_energy_is_told():
    assert drop(share=99.29) == ["below 99.3 % of the bound"]


def test_a_drop_that_costs_sessions_is_told_of_each_baseline():
    assert drop(satisfied=98) == ["fewer satisfied than edf-soc"]
    assert drop(satisfied=97) == ["fewer satisfied than llf", "fewer satisfied than edf-soc"]


def test_a_price_promise_is_a_saving_without_fewer_sessions():
    llf = row(cost=0.2, satisfied=100)
    assert results.broken_by_price({"soc-mpc": row(cost=0.179), "llf": llf}) == []
    assert results.broken_by_price({"soc-mpc": row(cost=0.181), "llf": llf}) == ["less than 10.0 % cheaper than llf"]
    assert results.broken_by_price({"soc-mpc": row(cost=0.17, satisfied=99), "llf": llf}) == ["fewer satisfied than llf"]


def test_a_week_and_a_day_keep_what_they_promise():
    rows = {"soc-mpc": row(99.8, 99), "edf-soc": row(97.0, 99), "llf": row(99.85, 99)}
    assert results.broken_by_week(rows) == []
    assert results.broken_by_synthetic(rows) == []
    rows["soc-mpc"] = row(99.3, 98)
    assert results.broken_by_week(rows) == ["below 99.4 % of the bound", "fewer satisfied than edf-soc"]
    assert "less energy than llf" in results.broken_by_synthetic(rows)


def test_an_exceeded_limit_is_told_with_its_policy():
    assert results.violated({"soc-mpc": row(), "llf": row(violations=2)}) == ["limit exceeded by llf"]


def test_the_limit_drops_each_day_between_the_hours(tmp_path, monkeypatch):
    monkeypatch.setattr(results, "OUT", tmp_path)
    limit = read_limit_csv(results.limit_csv("case", 40.0, 10.0, (12, 15), days=2))
    hours = [0, 11.99, 12, 14.99, 15, 35.99, 36, 39]
    assert [float(limit.at(3600 * hour)) for hour in hours] == [40, 40, 10, 10, 40, 40, 10, 40]


def test_the_week_of_the_price_promise_is_there_whatever_the_folder_holds():
    stem = results.SAVING_CASE[0]
    assert [source.stem for source in results.price_weeks([])] == [stem]
    elsewhere = [Path("/elsewhere") / name for name in (f"{stem}.csv", "acn-a.csv")]
    assert results.price_weeks(elsewhere) == elsewhere[::-1]
    assert all(source.is_file() for source in results.price_weeks([]))


def test_a_tool_that_fails_ends_the_run():
    with pytest.raises(SystemExit, match="bound.py --sessions /none .*exit code 1"):
        results.run("bound.py", "--sessions", "/none", "--limit-kw", "1")


def test_an_exceeded_limit_does_not_end_the_run_before_it_is_told(monkeypatch):
    monkeypatch.setattr(results.subprocess, "run", lambda *_, **__: type("Done", (), {"returncode": 3}))
    results.run("compare.py")
