"""The sessions file: what is accepted, and how everything else is refused with file, line, column and reason."""

import pytest
from conftest import REQUIRED, TOLD, csv_text, session

HEADER = ",".join(REQUIRED) + "\n"
GOOD = "a,1,0,14400,40,0.5,0.7,7,4\n"


def with_value(column, value):
    """A file whose third line holds `value`."""
    return csv_text([session("first"), session("second") | {column: value}],
                    REQUIRED + ((TOLD,) if column == TOLD else ()))


@pytest.mark.parametrize(
    ("column", "value", "reason"),
    [
        ("session_id", "", "empty"),
        ("session_id", "first", "'first' was given before"),
        ("connector", "9", "unknown connector 9, the station has 1..8"),
        ("connector", "0", "unknown connector 0"),
        ("connector", "-1", "unknown connector '-1'"),
        ("connector", "A1", "unknown connector 'A1'"),
        ("connector", "1.5", "unknown connector '1.5'"),
        ("connector", "1.", "unknown connector '1.'"),
        ("connector", "1.0x", "unknown connector '1.0x'"),
        ("connector", ".0", "unknown connector '.0'"),
        ("connector", "0.0", "unknown connector 0.0"),
        ("connector", "9.0", "unknown connector 9.0, the station has 1..8"),
        ("connector", "99999999999999999999", "unknown connector"),
        ("arrival_s", "noon", "not a number: 'noon'"),
        ("arrival_s", "", "empty, a number is needed"),
        ("arrival_s", "-1", "-1 is outside 0..4294967295"),
        ("arrival_s", "14400", None),
        ("departure_s", "0", "not after arrival_s"),
        ("departure_s", "1e12", "outside"),
        ("departure_s", "12:00", "not a number"),
        ("battery_kwh", "0", "must be above 0"),
        ("battery_kwh", "-5", "must be above 0"),
        ("battery_kwh", "nan", "not a number: 'nan'"),
        ("battery_kwh", "inf", "not a number: 'inf'"),
        ("battery_kwh", "1e999", "not a number: '1e999'"),
        ("battery_kwh", "0x20", "not a number: '0x20'"),
        ("battery_kwh", "40 kWh", "not a number: '40 kWh'"),
        ("battery_kwh", "1,5", "not a number: '1,5'"),
        ("battery_kwh", "1000", "must not be above 655.34"),
        ("soc_arrival", "-0.1", "-0.1 is outside 0..1"),
        ("soc_arrival", "50", "50 is outside 0..1"),
        ("soc_target", "1.01", "1.01 is outside 0..1"),
        ("soc_target", "0.4", "below soc_arrival"),
        ("max_kw", "0", "must be above 0"),
        ("max_kw", "1000", "must not be above 655.34"),
        ("taper_kw", "-1", "below 0"),
        ("taper_kw", "7.1", "above max_kw"),
        ("taper_kw", "--4", "not a number"),
        (TOLD, "x", "not a number: 'x'"),
        (TOLD, "-5", "outside"),
    ],
)
def test_a_bad_value_is_refused_where_it_stands(sim, column, value, reason):
    run = sim.run(with_value(column, value))
    assert run.code == 1
    if reason is None:  # the fault shows in another column
        column, reason = "departure_s", "not after arrival_s"
    assert run.stderr.startswith(f"sessions.csv:3: {column}: ")
    assert reason in run.stderr
    assert run.stderr.count("\n") == 1
    assert run.stdout == ""
    assert sim.files() == ["sessions.csv"]


def test_a_told_departure_before_the_arrival_is_refused(sim):
    run = sim.run([session("a", arrival_s=100, **{TOLD: 50})])
    assert run.code == 1
    assert run.stderr == f"sessions.csv:2: {TOLD}: before arrival_s\n"


@pytest.mark.parametrize("missing", REQUIRED)
def test_a_missing_column_is_named(sim, missing):
    run = sim.run(csv_text([], [name for name in REQUIRED if name != missing]))
    assert run.code == 1
    assert run.stderr == f"sessions.csv:1: {missing}: column missing\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "sessions.csv:1: header: missing: the file is empty"),
        ("\n\n", "sessions.csv:1: header: missing: the file is empty"),
        (HEADER.replace("connector", "max_kw"), "sessions.csv:1: connector: column missing"),
        (HEADER.replace("max_kw", "max_kw,max_kw"), "sessions.csv:1: max_kw: column given twice"),
        (HEADER + GOOD + "b,1,0,3600\n", "sessions.csv:3: row: 4 fields, but the header has 9"),
        (HEADER + "\n" + GOOD.replace("\n", ",5\n"), "sessions.csv:3: row: 10 fields, but the header has 9"),
        (HEADER + GOOD.replace("a,", '"a,'), "sessions.csv:2: row: a double quote"),
        (HEADER + GOOD.replace("a,", 'a"b"c,'), "sessions.csv:2: row: a double quote"),
        (HEADER + GOOD.replace("a,", "a\0,"), "sessions.csv:2: row: a zero byte"),
    ],
)
def test_a_file_that_is_no_such_table_is_refused(sim, text, message):
    run = sim.run(text)
    assert run.code == 1
    assert run.stderr.startswith(message)
    assert run.stderr.count("\n") == 1
    assert sim.files() == ["sessions.csv"]


@pytest.mark.parametrize("name", ["no-such-file.csv", "."])
def test_a_file_that_cannot_be_read_is_named(sim, name):
    run = sim.call("--sessions", name, "--policy", "edf")
    assert run.code == 1
    assert run.stderr.startswith(f"{name}: cannot be read: ")


def test_a_header_without_rows_runs_and_reports_zeros(sim):
    run = sim.run(HEADER)
    assert run.code == 0
    assert run.summary["sessions"] == 0
    assert run.summary["delivered_kwh"] == 0
    assert run.steps == []


def test_columns_may_stand_in_any_order(sim):
    rows = [session("a"), session("b", connector=3, max_kw=11)]
    straight = sim.run(rows, out="straight")
    turned = sim.run(csv_text(rows, REQUIRED[::-1]), out="turned")
    assert turned.code == 0
    assert turned.sessions == straight.sessions
    assert turned.connectors == straight.connectors


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + HEADER + GOOD,
        (HEADER + GOOD).replace("\n", "\r\n"),
        (HEADER + GOOD).replace("\n", "\r"),
        (HEADER + GOOD).rstrip("\n"),
        HEADER + "\n\n" + GOOD + "\n",
        HEADER + GOOD.replace(",", " , "),
        HEADER + '"a","1","0","14400","40","0.5","0.7","7","4"\n',
    ],
)
def test_every_usual_form_of_csv_is_read(sim, text):
    run = sim.run(text)
    assert run.code == 0, run.stderr
    assert run.stderr == ""
    assert run.sessions["a"]["satisfied"] == "1"


def test_a_connector_may_be_written_as_pandas_does_beside_empty_fields(sim):
    run = sim.run([session("a", connector="3.0"), session("b", connector="2.000"), session("c")])
    assert run.code == 0, run.stderr
    assert [row["connector"] for row in run.sessions.values()] == ["3", "2", "1"]


def test_the_line_is_right_with_crlf(sim):
    run = sim.run((HEADER + GOOD + GOOD.replace("a,1", "b,77")).replace("\n", "\r\n"))
    assert run.stderr.startswith("sessions.csv:3: connector: ")


def test_an_unknown_column_is_ignored_with_a_warning(sim):
    run = sim.run(csv_text([session("a") | {"note": "blue"}], (*REQUIRED, "note")))
    assert run.code == 0
    assert run.stderr == "sessions.csv:1: note: warning: unknown column, ignored\n"
    assert run.sessions["a"]["satisfied"] == "1"


def test_an_odd_name_comes_back_as_it_was(sim):
    name = 'Åsa, "the 2nd"'
    run = sim.run([session(name)])
    assert list(run.sessions) == [name]
    assert run.of_session(name)


def test_bad_input_leaves_an_existing_folder_alone(sim):
    assert sim.run([session("a")]).code == 0
    before = {name: (sim.folder / name).read_bytes() for name in sim.files() if name.startswith("out/")}
    assert sim.run(with_value("max_kw", "fast")).code == 1
    after = {name: (sim.folder / name).read_bytes() for name in sim.files() if name.startswith("out/")}
    assert after == before
