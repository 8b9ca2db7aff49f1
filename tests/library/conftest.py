"""The library as others get it: installed from this build and moved, and the commands of examples/README.md."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples/minimal"
README = ROOT / "examples/README.md"
BUILD = Path(os.environ["TAPER_BUILD"])
NEEDED = {
    "pkg-config": "pkg-config",
    "ninja": "ninja-build",
    "arm-none-eabi-gcc": "gcc-arm-none-eabi libnewlib-arm-none-eabi",
}


def code_below(heading: str) -> str:
    """The first block of code below a heading of examples/README.md."""
    section = README.read_text().split(f"## {heading}\n")[1]
    found = re.search(r"(?:^    .*\n)+", section, re.MULTILINE)
    assert found, heading
    return re.sub(r"^    ", "", found[0], flags=re.MULTILINE)


def run(command: str, **variables: object) -> str:
    """Runs it in a shell, in the root of the sources; shows all that it said if it fails."""
    environment = {
        **os.environ,
        "CMAKE_GENERATOR": "Ninja",
        "CMAKE_EXPORT_COMPILE_COMMANDS": "ON",
        "PATH": f"{Path(os.environ['TAPER_CMAKE']).parent}:{os.environ['PATH']}",
        **{name: str(value) for name, value in variables.items()},
    }
    done = subprocess.run(["bash", "-euc", command], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="session", autouse=True)
def tools() -> None:
    missing = [package for tool, package in NEEDED.items() if shutil.which(tool) is None]
    if missing:
        pytest.exit(f"missing: sudo apt-get install {' '.join(missing)}", returncode=1)


@pytest.fixture(scope="session")
def prefix(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the library was moved to after its installation."""
    folder = tmp_path_factory.mktemp("library")
    command = code_below("Install the library").replace("build/host-release", '"$TAPER_BUILD"')
    run(command, PREFIX=folder / "first")
    (folder / "first").rename(folder / "moved")
    return folder / "moved"
