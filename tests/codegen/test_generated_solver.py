"""The generated solvers: what is constant, that this is true, and that they solve as OSQP itself does."""

import re
import signal
import subprocess
from importlib import resources
from pathlib import Path

import numpy as np
import osqp
import pytest
import qp
import workspace
from conftest import CODEGEN, ROOT, STATIONS, compile_c
from solver import SETTINGS, generate_solver
from station import read_station

PROGRAM = Path(__file__).with_name("solve_two.c")


def includes(tree: Path) -> list[Path]:
    return [tree / "osqp/inc/public", tree / "osqp/inc/private", tree / "solver"]


@pytest.fixture(scope="module")
def osqp_objects(tree: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """OSQP's own sources, compiled once. They are foreign code: their warnings are not ours."""
    folder = tmp_path_factory.mktemp("objects")
    flags = [f"-I{path}" for path in includes(tree)]
    subprocess.run(["gcc", "-std=c11", "-O1", "-w", "-c", *flags, *(tree / "osqp/src").glob("*.c")], cwd=folder, check=True)
    return sorted(folder.glob("*.o"))


def numbers_of(text: str, array: str) -> list[float]:
    found = re.search(rf"\b{array}\[(\d+)\] = \{{(.*?)\}};", text, re.DOTALL)
    assert found, array
    values = [float(value.strip().removesuffix("F")) for value in found[2].split(",") if value.strip()]
    assert len(values) == int(found[1])
    return values


@pytest.mark.parametrize("name", STATIONS)
def test_index_arrays_are_constant_and_all_else_is_not(tree: Path, name: str) -> None:
    text = (tree / f"solver/{name}_workspace.c").read_text()
    constant = set(re.findall(rf"^static const OSQPInt taper_workspace_{name}_(\w+)\[", text, re.MULTILINE))
    assert constant == set(workspace.CONSTANT)
    written = re.findall(rf"^(?:static )?OSQPInt taper_workspace_{name}_(\w+)\[", text, re.MULTILINE)
    assert written == ["linsys_iwork", "linsys_bwork", "work_constr_type_val"]
    assert "const OSQPFloat" not in text


@pytest.mark.parametrize("name", STATIONS)
def test_values_are_exact(tree: Path, real: str, name: str) -> None:
    text = (tree / f"solver/{name}_workspace.c").read_text()
    station = read_station(CODEGEN / f"stations/{name}.toml")
    kind = np.float64 if real == "double" else np.float32
    for array, matrix in (("A", qp.constraint_matrix(station)), ("P", qp.cost_matrix(station))):
        written = np.array(numbers_of(text, f"taper_workspace_{name}_data_{array}_csc_x")).astype(kind)
        assert (written == matrix.data.astype(kind)).all()
        assert numbers_of(text, f"taper_workspace_{name}_data_{array}_csc_i") == matrix.indices.tolist()
        assert numbers_of(text, f"taper_workspace_{name}_data_{array}_csc_p") == matrix.indptr.tolist()
    assert "1e-06" in text  # sigma, which OSQP prints with 20 decimals


@pytest.mark.parametrize("value", [0.1, 1e-6, 1e-30, 1 / 3, 2.0**-40, 1e30, 3.0, -0.0])
def test_a_number_reads_back_as_itself(value: float) -> None:
    assert float(workspace.number(value, "double")) == value
    single = workspace.number(value, "float")
    assert single.endswith("F")
    assert np.float32(single.removesuffix("F")) == np.float32(value)
    assert re.search(r"[.e]", single)  # 3F is no number in C


@pytest.mark.parametrize("name", STATIONS)
def test_it_compiles_without_warnings_and_every_symbol_is_prefixed_and_has_the_station_s_name(
    tree: Path, tmp_path: Path, name: str
) -> None:
    compiled = tmp_path / "workspace.o"
    compile_c([tree / f"solver/{name}_workspace.c"], includes(tree), compiled, "-c")
    symbols = subprocess.run(["nm", "-g", "--defined-only", compiled], capture_output=True, text=True, check=True)
    names = {line.split()[2] for line in symbols.stdout.splitlines()}
    assert names == {f"taper_workspace_{name}_{part}" for part in ("solver", "data_A_csc_x", "data_P_csc_x")}


def test_the_descriptions_of_the_solvers_compile_with_the_planner_s_headers(tree: Path, tmp_path: Path) -> None:
    folders = [*includes(tree), tree / "include", ROOT / "firmware/planner/src"]
    folders += [ROOT / f"firmware/{layer}/include" for layer in ("planner", "horizon", "battery", "types")]
    for source in [*(f"{name}_solver.c" for name in STATIONS), "solvers.c"]:
        compile_c([tree / "solver" / source], folders, tmp_path / "o", "-c", "-Wpedantic", "-Wconversion")


def test_two_solvers_in_one_image_solve_as_osqp_does(
    tree: Path, real: str, osqp_objects: list[Path], tmp_path: Path
) -> None:
    """OSQP in Python has neither the constant arrays nor the changed factorisation: it is the oracle for both."""
    workspaces = [tree / f"solver/{name}_workspace.c" for name in ("hub", "garage")]
    program = tmp_path / "solve_two"
    compile_c([PROGRAM, *workspaces, *osqp_objects], includes(tree), program)
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"exit code {done.returncode} (-11: a constant array is written): {done.stderr}"
    lines = [float(line) for line in done.stdout.splitlines()]
    for name in ("hub", "garage"):
        iterations, x = solution(name)
        assert lines[1 : 1 + len(x)] == pytest.approx(x, abs=1e-9 if real == "double" else 2e-4)
        assert real == "float" or lines[0] == iterations
        lines = lines[1 + len(x) :]
    assert lines == []


def test_the_changed_factorisation_gives_the_same_bits_and_is_needed(
    tree: Path, osqp_objects: list[Path], tmp_path: Path
) -> None:
    """OSQP's own factorisation stores the pattern of L: with a writable one equal output, with ours a fault."""
    original = Path(str(resources.files("osqp.codegen"))) / "codegen_src/src/qdldl.c"
    others = [path for path in osqp_objects if path.name != "qdldl.o"]
    constant = [tree / f"solver/{name}_workspace.c" for name in ("hub", "garage")]
    writable = [tmp_path / path.name for path in constant]
    for old, new in zip(constant, writable, strict=True):
        new.write_text(re.sub(r"static const (OSQPInt \w+_linsys_L_[pi]\[)", r"static \1", old.read_text()))
    foreign = ("-Wno-unused-parameter", "-Wno-unknown-pragmas")
    compile_c([PROGRAM, *constant, *osqp_objects], includes(tree), tmp_path / "changed")
    compile_c([PROGRAM, *writable, *others, original], includes(tree), tmp_path / "original", *foreign)
    compile_c([PROGRAM, *constant, *others, original], includes(tree), tmp_path / "faulty", *foreign)
    runs = {
        name: subprocess.run([tmp_path / name], capture_output=True, check=False)
        for name in ("changed", "original", "faulty")
    }
    assert runs["changed"].returncode == runs["original"].returncode == 0
    assert runs["changed"].stdout == runs["original"].stdout
    assert runs["faulty"].returncode == -signal.SIGSEGV


def solution(name: str) -> tuple[int, list[float]]:
    """The second problem of solve_two.c, by OSQP in Python."""
    station = read_station(CODEGEN / f"stations/{name}.toml")
    a = qp.constraint_matrix(station)
    rows, variables = a.shape
    low, high = np.full(rows, -1e30), np.full(rows, 0.5)
    low[:variables] = 0.0
    problem = osqp.OSQP()
    problem.setup(qp.cost_matrix(station), np.full(variables, -0.05), a, low, high, **SETTINGS)
    result = problem.solve(raise_error=True)
    return result.info.iter, result.x.tolist()


def test_the_account_of_memory_is_what_the_compiler_lays_out(tree: Path, real: str, tmp_path: Path) -> None:
    account = (tree / "memory.txt").read_text()
    assert f"real type {real}" in account
    for name in STATIONS:
        compiled = tmp_path / f"{name}.o"
        compile_c([tree / f"solver/{name}_workspace.c"], includes(tree), compiled, "-c")
        sizes = subprocess.run(["size", compiled], capture_output=True, text=True, check=True).stdout.splitlines()[1]
        text_B, data_B, bss_B = (int(field) for field in sizes.split()[:3])
        row = next(line for line in account.splitlines() if line.split()[:1] == [name])
        const_B, init_B, ram_B = (int(field.replace(",", "")) for field in row.split()[-3:])
        assert const_B == pytest.approx(text_B, abs=2048)
        assert init_B == pytest.approx(data_B, abs=2560)  # the structures are not counted
        assert ram_B == pytest.approx(data_B + bss_B, abs=2560)


def test_output_of_another_osqp_is_refused() -> None:
    with pytest.raises(workspace.OsqpChanged, match="unknown text"):
        workspace.parse("union OSQPSurprise x;")
    with pytest.raises(workspace.OsqpChanged, match="has 1 values instead of 2"):
        workspace.parse(f"OSQPInt {workspace.PREFIX}a[2] = {{\n  1,\n}};")


def test_a_setting_that_was_lost_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SETTINGS, "eps_abs", 1.23456789e-8)  # 20 decimals are 13 digits of it
    generate_solver(read_station(CODEGEN / "stations/hub.toml"), "double")
    monkeypatch.setitem(SETTINGS, "eps_abs", 1.23456789012345678e-8)
    with pytest.raises(workspace.OsqpChanged, match="the setting eps_abs is"):
        generate_solver(read_station(CODEGEN / "stations/hub.toml"), "double")
