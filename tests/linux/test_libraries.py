"""A controller with the distribution's libraries: the program is linked with them, and its package asks for them."""

import os
from pathlib import Path

import pytest
from package import ELF_MACHINES, ROOT, Package, architecture, emulator, machine, run


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of a small station: what matters is how it is linked."""
    folder = tmp_path_factory.mktemp("build")
    cmake = os.environ["TAPER_CMAKE"]
    run(cmake, "-G", "Ninja", "-S", ROOT, "-B", folder, "-DCMAKE_TOOLCHAIN_FILE=" + os.environ["TAPER_TOOLCHAIN"],
        "-DTAPER_STATIC=OFF", "-DTAPER_STATIONS=hub", "-DTAPER_WITH_PLANNER=OFF", "-DTAPER_BUILD_SIM=OFF",
        "-DTAPER_REAL=float")
    run(cmake, "--build", folder, "--target", "deb", "-j", "2")
    return folder


def test_the_program_runs_with_the_libraries_of_its_architecture(build: Path) -> None:
    program = build / "firmware/linux/taper-station"
    assert machine(program) == ELF_MACHINES[architecture()]
    assert b"/ld-linux" in program.read_bytes()[:4096]  # the loader that it asks for
    assert run(*emulator(), program, "--version").startswith("taper-station ")


def test_the_package_is_of_that_architecture_and_asks_for_its_libraries(build: Path) -> None:
    (path,) = build.glob("*.deb")
    package = Package(path)
    assert package.field("Architecture") == architecture()
    assert package.field("Depends").startswith(f"libc6:{architecture()} (>= 2.")
