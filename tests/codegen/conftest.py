"""Fixtures of the code generator's tests: it is run as a user runs it, and what it wrote is read or compiled."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cantools
import pytest
from cantools.database.can import Database

ROOT = Path(__file__).resolve().parents[2]
CODEGEN = ROOT / "codegen"
STATIONS = ("hub", "garage", "paper", "depot", "caltech")
sys.path.insert(0, str(CODEGEN))

from bus_dbc import compact_dbc  # noqa: E402  (found by the path above)
from bus_model import Bus, read_bus  # noqa: E402

Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def generate() -> Run:
    """Calls generate.py with the given arguments, in the folder `cwd`; the caller looks at its exit code."""

    def run(*arguments: object, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, str(CODEGEN / "generate.py"), *map(str, arguments)]
        return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)

    return run


@pytest.fixture(scope="session", params=["double", "float"])
def real(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="session")
def tree(generate: Run, real: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Everything generated for all stations, once for each real type."""
    out = tmp_path_factory.mktemp("generated") / real
    done = generate("--stations", ",".join(STATIONS), "--real", real, "--out", out)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="session")
def bus() -> Bus:
    return read_bus(CODEGEN / "bus.toml")


@pytest.fixture(scope="session")
def full() -> Database:
    """The committed database of all connectors, as a CAN tool reads it; loaded once, it is large."""
    loaded = cantools.database.load_file(CODEGEN / "taper.dbc", strict=True)
    assert isinstance(loaded, Database)
    return loaded


@pytest.fixture(scope="session")
def compact(bus: Bus) -> Database:
    """The database that the codec is made from."""
    loaded = cantools.database.load_string(compact_dbc(bus), "dbc", strict=True)
    assert isinstance(loaded, Database)
    return loaded


def content(folder: Path) -> dict[str, bytes]:
    """All files below `folder`."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def compile_c(sources: list[Path], includes: list[Path], output: Path, *options: str) -> None:
    """Compiles and links; every warning is an error. Shows the compiler's messages if it fails."""
    folders = [f"-I{folder}" for folder in includes]
    command = ["gcc", "-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", *options, *folders]
    done = subprocess.run(
        [*command, *map(str, sources), "-o", str(output), "-lm"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
