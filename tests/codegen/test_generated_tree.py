"""The output folder as a whole: same input, same bytes; replaced as one, or not at all."""

import re
from pathlib import Path

import pytest
from conftest import ROOT, STATIONS, Run, content

COMMON = {"include/taper/bus.h", "include/taper/sizes.h", "include/taper/stations.h", "stations.c", "memory.txt"}
CODEC = {"dbc/taper_dbc.c", "dbc/taper_dbc.h", "dbc/taper_fields.h"}


def test_the_same_input_gives_the_same_bytes(generate: Run, tree: Path, real: str, tmp_path: Path) -> None:
    done = generate("--stations", ",".join(STATIONS), "--real", real, "--out", "again", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert content(tmp_path / "again") == content(tree)
    assert done.stdout == (tree / "memory.txt").read_text()


def test_all_promised_files_are_there_and_no_others(tree: Path) -> None:
    files = set(content(tree))
    solver = {f"solver/{name}_{part}" for name in STATIONS for part in ("workspace.c", "workspace.h", "solver.c")}
    rest = {name for name in files - COMMON - CODEC - solver if not name.startswith("osqp/")}
    assert rest == {"include/taper/solvers.h", "solver/solvers.c"}
    assert COMMON | CODEC | solver < files
    osqp = {name for name in files if name.startswith("osqp/")}
    assert {"osqp/inc/public/osqp.h", "osqp/inc/public/osqp_configure.h", "osqp/src/osqp_api.c"} < osqp
    assert all(re.fullmatch(r"osqp/(src/\w+\.c|inc/(public|private)/\w+\.h)", name) for name in osqp)


def test_no_file_tells_when_or_where_it_was_made(tree: Path) -> None:
    for name, data in content(tree).items():
        text = data.decode()
        assert not re.search(r"\b(Mon|Tue|Wed|Thu|Fri|Sat|Sun) [A-Z][a-z]{2} +\d+ \d\d:\d\d", text), name
        assert str(ROOT) not in text, name
        assert "/tmp/" not in text, name


def test_without_the_planner_there_is_no_osqp(generate: Run, tmp_path: Path) -> None:
    done = generate("--stations", "hub", "--real", "float", "--out", tmp_path / "out", "--no-planner")
    assert done.returncode == 0, done.stderr
    assert set(content(tmp_path / "out")) == COMMON | CODEC


def test_a_folder_of_others_is_not_replaced(generate: Run, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    done = generate("--stations", "hub", "--real", "float", "--out", tmp_path, "--no-planner")
    assert done.returncode == 1
    assert done.stderr == f"{tmp_path}: is not empty, and not made by this program\n"
    assert set(content(tmp_path)) == {"thesis.tex"}


def test_what_stays_the_same_keeps_its_time_and_what_is_gone_goes(generate: Run, tmp_path: Path) -> None:
    arguments = ("--real", "float", "--out", tmp_path / "out", "--no-planner")
    assert generate("--stations", "hub", *arguments).returncode == 0
    (tmp_path / "out" / "stale.c").write_text("")
    codec, table = tmp_path / "out/dbc/taper_dbc.c", tmp_path / "out/stations.c"
    before = codec.stat().st_mtime_ns, table.stat().st_mtime_ns
    assert generate("--stations", "hub,paper", *arguments).returncode == 0
    assert codec.stat().st_mtime_ns == before[0]
    assert table.stat().st_mtime_ns > before[1]
    assert set(content(tmp_path)) == {f"out/{name}" for name in COMMON | CODEC}


@pytest.mark.parametrize("names", ["", "hub,", "hub,hub"])
def test_a_bad_list_of_stations_is_refused(generate: Run, tmp_path: Path, names: str) -> None:
    done = generate("--stations", names, "--real", "float", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert not (tmp_path / "out").exists()
