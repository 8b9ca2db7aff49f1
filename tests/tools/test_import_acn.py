"""tools/import_acn.py: real sessions in, replayable sessions out."""

from pathlib import Path

import pytest
from import_acn import USUAL_BATTERIES_KWH, draw_battery, main
from taperlib.sessions import peak_present, read_sessions_csv

DATA = Path(__file__).resolve().parents[2] / "host_sim" / "data"
HEADER = ("arrival,departure,requested_energy (kWh),delivered_energy (kWh),station_id,session_id,"
          "estimated_departure,claimed")
MORNING = "2019-07-14 08:13:12-07:00,2019-07-14 09:55:16-07:00,8.0,4.121,CA-315,a 1,2019-07-14 09:13:12-07:00,True"
NEXT_DAY = "2019-07-15 00:10:00-07:00,2019-07-15 00:20:00-07:00,2.5,2.0,CA-316,b 2,2019-07-15 00:15:00-07:00,True"


def imported(tmp_path, rows, *options):
    source, target = tmp_path / "acn.csv", tmp_path / "sessions.csv"
    source.write_text("\n".join([HEADER, *rows]) + "\n")
    assert main([str(source), "--out", str(target), *options]) == 0
    return read_sessions_csv(target)


def error_of(tmp_path, capsys, rows, header=HEADER):
    source, target = tmp_path / "acn.csv", tmp_path / "sessions.csv"
    source.write_text("\n".join([header, *rows]) + "\n")
    assert main([str(source), "--out", str(target)]) == 1
    assert list(tmp_path.iterdir()) == [source], "an error leaves no output, not even a part"
    return capsys.readouterr().err


def test_times_count_from_the_local_midnight_before_the_first_arrival(tmp_path):
    first, second = imported(tmp_path, [NEXT_DAY, MORNING])
    assert (first.session_id, first.arrival_s, first.departure_s) == ("a 1", 8 * 3600 + 13 * 60 + 12, 35716)
    assert (second.session_id, second.arrival_s) == ("b 2", 86400 + 600)


def test_a_session_in_another_offset_counts_by_its_true_time(tmp_path):
    in_utc = NEXT_DAY.replace("00:10:00-07:00", "07:10:00+00:00").replace("00:20:00-07:00", "07:20:00+00:00")
    assert imported(tmp_path, [MORNING, in_utc])[1].arrival_s == 86400 + 600


def test_rounding_moves_arrivals_up_and_departures_down(tmp_path):
    (session,) = imported(tmp_path, [MORNING], "--step-s", "900")
    assert (session.arrival_s, session.departure_s) == (8.25 * 3600, 9.75 * 3600)


def test_a_session_without_a_whole_step_is_dropped_and_named(tmp_path, capsys):
    sessions = imported(tmp_path, [MORNING, NEXT_DAY], "--step-s", "900")
    assert [session.session_id for session in sessions] == ["a 1"]
    assert "dropped: b 2" in capsys.readouterr().err


def test_a_file_of_which_nothing_is_left_is_an_error(tmp_path, capsys):
    source = tmp_path / "acn.csv"
    source.write_text(f"{HEADER}\n{NEXT_DAY}\n")
    assert main([str(source), "--out", str(tmp_path / "out.csv"), "--step-s", "900"]) == 1
    assert "no session is left" in capsys.readouterr().err


def test_the_driver_s_departure_is_the_estimated_one(tmp_path):
    (session,) = imported(tmp_path, [MORNING], "--driver-departure")
    assert session.expected_departure_s == 9 * 3600 + 13 * 60 + 12
    assert session.departure_s == 35716


def test_a_rounded_expected_departure_still_leaves_one_step(tmp_path):
    soon = MORNING.replace("2019-07-14 09:13:12-07:00,True", "2019-07-14 08:20:00-07:00,True")
    (session,) = imported(tmp_path, [soon], "--driver-departure", "--step-s", "900")
    assert session.expected_departure_s == session.arrival_s + 900


def test_without_the_option_nothing_is_said_about_the_expected_departure(tmp_path):
    assert imported(tmp_path, [MORNING])[0].expected_departure_s is None


def test_the_energy_asked_for_and_the_energy_delivered_can_each_be_the_request(tmp_path):
    (asked,) = imported(tmp_path, [MORNING])
    (delivered,) = imported(tmp_path, [MORNING], "--request", "delivered")
    assert asked.requested_kwh == pytest.approx(8.0, abs=1e-3)
    assert delivered.requested_kwh == pytest.approx(4.121, abs=1e-3)


def test_the_taper_share_sets_the_power_of_a_full_battery(tmp_path):
    (session,) = imported(tmp_path, [MORNING], "--max-kw", "11", "--taper-share", "0.5")
    assert (session.max_kw, session.taper_kw) == (11.0, 5.5)


def test_a_session_draws_the_same_battery_in_any_company_and_order(tmp_path):
    both = {session.session_id: session for session in imported(tmp_path, [NEXT_DAY, MORNING])}
    (alone,) = imported(tmp_path, [MORNING])
    assert both["a 1"] == alone


def test_the_draw_is_pinned_so_that_published_results_can_be_repeated():
    battery = draw_battery("2_39_89_25_2019-07-14 15:13:12.265369", 8.0, seed=0)
    assert (battery.kwh, battery.soc_arrival, battery.soc_target) == (75.0, 0.856, 0.962667)


def test_another_seed_draws_other_batteries():
    draws = [[draw_battery(f"car {car}", 8.0, seed) for car in range(20)] for seed in (0, 1)]
    assert draws[0] != draws[1]


def test_every_listed_battery_that_fits_is_drawn_and_no_other():
    drawn = {draw_battery(f"car {car}", 30.0, seed=0).kwh for car in range(400)}
    assert drawn == {kwh for kwh in USUAL_BATTERIES_KWH if 0.8 * kwh >= 30.0}


def test_a_request_too_large_for_the_list_makes_a_larger_battery():
    battery = draw_battery("lorry", 215.32, seed=0)
    assert battery.kwh == pytest.approx(215.32 / 0.8)
    assert battery.soc_target <= 1


@pytest.mark.parametrize("name, sessions, cars", [("acn-caltech-2019-07-14.csv", 204, 31),
                                                  ("acn-jpl-2019-10-06.csv", 335, 52)])
def test_the_weeks_that_come_with_the_project_can_be_imported(tmp_path, name, sessions, cars):
    target = tmp_path / "sessions.csv"
    assert main([str(DATA / name), "--out", str(target)]) == 0
    week = read_sessions_csv(target)
    assert (len(week), peak_present(week)) == (sessions, cars)
    assert [session.arrival_s for session in week] == sorted(session.arrival_s for session in week)
    assert all(0.04 < session.soc_arrival < session.soc_target <= 1 for session in week)


def test_a_second_import_gives_the_same_bytes(tmp_path):
    targets = [tmp_path / "one.csv", tmp_path / "two.csv"]
    for target in targets:
        assert main([str(DATA / "acn-caltech-2019-07-14.csv"), "--out", str(target), "--seed", "7"]) == 0
    assert targets[0].read_bytes() == targets[1].read_bytes()


@pytest.mark.parametrize("old, new, place, reason", [
    ("8.0", "lots", "line 3, column requested_energy (kWh)", "'lots' is not a number"),
    ("8.0", "", "line 3, column requested_energy (kWh)", "is empty"),
    ("8.0", "nan", "line 3, column requested_energy (kWh)", "not a finite number"),
    ("8.0", "0", "line 3, column requested_energy (kWh)", "not greater than 0"),
    ("2019-07-14 08:13:12-07:00", "yesterday", "line 3, column arrival", "not an ISO 8601 time"),
    ("2019-07-14 08:13:12-07:00", "2019-07-14 08:13:12", "line 3, column arrival", "no offset from UTC"),
    ("2019-07-14 09:55:16-07:00", "2019-07-14 08:13:12-07:00", "line 3, column departure", "not after the arrival"),
    ("a 1", "b 2", "line 3, column session_id", "occurs twice"),
])
def test_an_error_names_file_line_column_and_reason(tmp_path, capsys, old, new, place, reason):
    message = error_of(tmp_path, capsys, [NEXT_DAY, MORNING.replace(old, new, 1)])
    assert f"acn.csv, {place}" in message
    assert reason in message


def test_a_header_that_lacks_a_column_is_refused(tmp_path, capsys):
    message = error_of(tmp_path, capsys, [MORNING], HEADER.replace("arrival,", "came,", 1))
    assert "line 1: the header lacks arrival" in message


def test_a_file_that_is_not_there_is_named(tmp_path, capsys):
    assert main([str(tmp_path / "none.csv"), "--out", str(tmp_path / "out.csv")]) == 1
    assert "none.csv: cannot be read" in capsys.readouterr().err
