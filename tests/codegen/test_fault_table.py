"""The table of faults in docs/protocol.md and the tests named test_row_N_... in tests/unit name each other."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
UNIT = ROOT / "tests" / "unit"
ON_VCAN = ROOT / "tests" / "vcan" / "test_fault_timing.py"
ROWS = range(1, 49)


def section(page):
    """The text of "Faults", up to the next section or the end."""
    return re.search(r"^## Faults\n(.*?)(?=^## |\Z)", page, re.DOTALL | re.MULTILINE).group(1)


def named_tests(page):
    """{(row, file, test)} of the table."""
    found = set()
    for line in section(page).splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 6 and cells[0].isdigit():
            for part in cells[5].split("<br>"):
                file, names = part.split(":")
                found |= {(int(cells[0]), file, name) for name in re.findall(r"`(\w+)`", names)}
    return found


def run_tests(folder):
    """{(row, file, test)} of the tests that run."""
    return {
        (int(row), path.name, test)
        for path in folder.glob("test_*.c")
        for test, row in re.findall(r"^ *RUN_TEST\((test_row_(\d+)_\w+)\);", path.read_text(), re.MULTILINE)
    }


def uncovered(page):
    """Rows of the table of what is not covered: two columns."""
    return [int(row) for row in re.findall(r"^\| (\d+) \| [^|]+ \|$", section(page), re.MULTILINE)]


@pytest.fixture(scope="module")
def page():
    return (ROOT / "docs" / "protocol.md").read_text()


def test_every_test_that_the_table_names_runs(page):
    assert named_tests(page) - run_tests(UNIT) == set()


def test_the_table_names_every_test_of_a_row(page):
    assert run_tests(UNIT) - named_tests(page) == set()


def test_the_table_of_the_virtual_bus_names_its_tests(page):
    named = re.findall(r"^\| [\d, ]+ \| [^|]+ \| `(test_row_\w+)` \|$", section(page), re.MULTILINE)
    assert sorted(named) == sorted(re.findall(r"^def (test_row_\w+)\(", ON_VCAN.read_text(), re.MULTILINE))


def test_every_row_has_a_test_or_is_said_to_have_none(page):
    covered = {row for row, _, _ in named_tests(page)}
    assert sorted([*covered, *uncovered(page)]) == list(ROWS)


def test_a_test_that_does_not_run_is_not_there(tmp_path):
    (tmp_path / "test_x.c").write_text("static void test_row_7_a(void) {}\n    // RUN_TEST(test_row_7_b);\n    RUN_TEST(test_row_7_c);\n")
    assert run_tests(tmp_path) == {(7, "test_x.c", "test_row_7_c")}
