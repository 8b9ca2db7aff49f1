"""tools/prices.py: a day-ahead price that repeats, and has the shape that it says."""

import numpy as np
import prices as prices_tool
from prices import HOURS_PER_DAY, day_ahead


def of_hour(prices, hour):
    return prices[hour::HOURS_PER_DAY]


def test_the_same_seed_gives_the_same_prices():
    assert np.array_equal(day_ahead(7, 0.2, 3, "mon"), day_ahead(7, 0.2, 3, "mon"))
    assert not np.array_equal(day_ahead(7, 0.2, 3, "mon"), day_ahead(7, 0.2, 4, "mon"))


def test_mornings_and_evenings_are_dear_middays_and_nights_are_cheap():
    year = day_ahead(364, 0.2, 0, "mon")
    morning, midday, evening, night = (of_hour(year, hour).mean() for hour in (8, 13, 19, 3))
    assert evening > morning > year.mean() > night > midday
    assert abs(year.mean() / 0.2 - 1) < 0.1


def test_weekend_mornings_are_cheaper_than_those_of_working_days():
    year = day_ahead(364, 0.2, 0, "thu")
    mornings = of_hour(year, 8).reshape(-1, 7)  # Thursday to Wednesday
    assert mornings[:, 2:4].mean() < mornings[:, [0, 1, 4, 5, 6]].mean() - 0.03


def test_the_file_has_an_hour_a_row_in_thousandths(tmp_path, capsys):
    path = tmp_path / "prices.csv"
    assert prices_tool.main(["--out", str(path), "--days", "2", "--mean", "0.3"]) == 0
    rows = path.read_text().splitlines()
    assert rows[0] == "time_s,price_per_kwh" and len(rows) == 49
    assert [float(row.split(",")[0]) for row in rows[1:]] == [3600 * hour for hour in range(48)]
    assert all(len(row.split(".")[1]) == 3 for row in rows[1:])
    assert "48 hours" in capsys.readouterr().out
