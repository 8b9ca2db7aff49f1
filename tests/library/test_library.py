"""Taper in other people's firmware: every way of building examples/minimal, and what comes with it."""

import json
import os
import subprocess
from pathlib import Path

import pytest
from conftest import BUILD, EXAMPLE, ROOT, code_below, run

VERSION, REAL = os.environ["TAPER_VERSION"], os.environ["TAPER_REAL"]
DEADLINE_s = 60


def pkg_config(prefix: Path, what: str) -> str:
    return run(f"pkg-config {what} taper", PKG_CONFIG_PATH=prefix / "lib/pkgconfig").strip()


def runs_a_station(program: Path) -> None:
    """It sends its status and a setpoint to each of the eight connectors, and ends when nobody is there any more."""
    wanted = {b"t240", *(b"t0C%d" % node for node in range(1, 9))}
    with subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as station:
        assert station.stdin is not None
        assert station.stdout is not None
        station.stdin.write(b"S6\rO\r")
        station.stdin.flush()
        heard = b""
        while wanted - {line[:4] for line in heard.split(b"\r")}:
            more = os.read(station.stdout.fileno(), 4096)
            assert more, heard
            heard += more
        station.communicate(timeout=DEADLINE_s)
        assert station.returncode == 0


def parent(folder: Path, text: str) -> str:
    """Configures a project of somebody else's; what it says to its user."""
    (folder / "CMakeLists.txt").write_text(f"cmake_minimum_required(VERSION 3.25)\nproject(other C)\n{text}")
    return run('cmake -S "$FOLDER" -B "$FOLDER/build" 2>&1', FOLDER=folder)


# ---- Installed


def test_the_library_alone_is_installed(prefix: Path) -> None:
    files = {path.relative_to(prefix).as_posix() for path in prefix.rglob("*") if path.is_file()}
    headers = {name for name in files if name.startswith("include/taper/")}
    package = {f"lib/cmake/taper/taper-{part}.cmake" for part in ("config", "config-version", "targets", "targets-release")}
    template = {f"share/taper/template/port_template.{kind}" for kind in "ch"}
    assert files - headers == {"lib/libtaper.a", "lib/pkgconfig/taper.pc", "share/taper/LICENSE", *package, *template}
    ours = [*(ROOT / "firmware").rglob("taper/*.h"), *(BUILD / "generated/include/taper").glob("*.h")]
    assert headers == {f"include/taper/{path.name}" for path in [*ours, Path("version.h")]}


def test_no_installed_file_names_the_place_where_it_was_made(prefix: Path) -> None:
    texts = [path for path in prefix.rglob("*") if path.is_file() and path.suffix != ".a"]
    places = (str(ROOT), str(BUILD), str(prefix.with_name("first")))
    assert not [path for path in texts for place in places if place in path.read_text()]


def test_every_installed_header_compiles_alone_and_without_warnings(prefix: Path) -> None:
    flags = "-std=c11 -fsyntax-only -Wall -Wextra -Werror"
    run(f'cc {flags} {pkg_config(prefix, "--cflags")} "$PREFIX"/include/taper/*.h', PREFIX=prefix)


def test_all_that_the_archive_exports_is_prefixed(prefix: Path) -> None:
    symbols = run('nm -g --defined-only "$PREFIX/lib/libtaper.a"', PREFIX=prefix).splitlines()
    names = [line.split()[2] for line in symbols if len(line.split()) == 3]
    assert {"taper_station_step", "taper_osqp_solve", "taper_QDLDL_factor", "taper_version"} <= set(names)
    assert not [name for name in names if not name.startswith("taper_")]


def test_find_package_builds_a_firmware_that_runs(prefix: Path, tmp_path: Path) -> None:
    run(code_below("With find_package"), PREFIX=prefix, BUILD=tmp_path)
    runs_a_station(tmp_path / "found/minimal")


def test_pkg_config_builds_a_firmware_that_runs(prefix: Path, tmp_path: Path) -> None:
    run(code_below("With pkg-config"), PREFIX=prefix, BUILD=tmp_path)
    runs_a_station(tmp_path / "minimal")
    said = run(code_below("Look at it run").replace("sleep 3", "sleep 1"), BUILD=tmp_path)
    assert "t240" in said


def test_the_package_says_how_the_library_was_built(prefix: Path, tmp_path: Path) -> None:
    said = parent(
        tmp_path,
        f"find_package(taper 0.1 REQUIRED COMPONENTS hub planner {REAL} PATHS {prefix})\n"
        'message("${taper_VERSION} ${taper_REAL} ${taper_WITH_PLANNER} ${taper_STATIONS}")\n',
    )
    assert f"{VERSION} {REAL} ON" in said
    assert pkg_config(prefix, "--modversion") == VERSION
    assert pkg_config(prefix, "--variable=real") == REAL
    assert pkg_config(prefix, "--variable=planner") == "ON"
    assert pkg_config(prefix, "--variable=stations") in said


@pytest.mark.parametrize(
    ("wanted", "reason"),
    [
        ("0.1 COMPONENTS kiosk", "kiosk is not in this library. It was built with"),
        ("0.2", 'is compatible with requested version "0.2"'),
        ("1.0", 'is compatible with requested version "1.0"'),
    ],
)
def test_a_library_that_is_not_what_is_wanted_is_refused(prefix: Path, tmp_path: Path, wanted: str, reason: str) -> None:
    said = parent(tmp_path, f"find_package(taper {wanted} PATHS {prefix})\nmessage(found-${{taper_FOUND}})\n")
    assert "found-0" in said or "found-FALSE" in said
    assert " ".join(reason.split()) in " ".join(said.split())


def test_a_firmware_with_its_own_osqp_links_with_all_of_taper(prefix: Path, tmp_path: Path) -> None:
    """The whole archive: a name that both have would be defined twice."""
    (tmp_path / "own.c").write_text("int osqp_solve(void);\nint osqp_solve(void) { return 1; }\n"
                                    "int QDLDL_factor(void);\nint QDLDL_factor(void) { return 2; }\n")
    sources = f"{EXAMPLE}/main.c {EXAMPLE}/board_posix.c {tmp_path}/own.c"
    archive = f"-Wl,--whole-archive {prefix}/lib/libtaper.a -Wl,--no-whole-archive -lm"
    run(f"cc -std=c11 {pkg_config(prefix, '--cflags')} {sources} {archive} -o {tmp_path}/minimal")
    runs_a_station(tmp_path / "minimal")


# ---- As a part of another project


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("part")
    run(code_below("With add_subdirectory"), BUILD=folder)
    return folder / "part"


def test_add_subdirectory_builds_a_firmware_that_runs(part: Path) -> None:
    runs_a_station(part / "minimal")


def test_rounding_is_the_same_everywhere_in_taper_and_left_alone_outside(part: Path) -> None:
    commands = {Path(one["file"]): one["command"] for one in json.loads((part / "compile_commands.json").read_text())}
    inside = {path for path in commands if not path.is_relative_to(EXAMPLE)}
    assert {"osqp_api.c", "hub_workspace.c", "planner.c", "taper_dbc.c"} <= {path.name for path in inside}
    assert {path for path, command in commands.items() if "-ffp-contract=off" in command.split()} == inside


SETTINGS = """
set(names CMAKE_C_FLAGS CMAKE_C_STANDARD CMAKE_C_EXTENSIONS CMAKE_C_STANDARD_REQUIRED CMAKE_EXPORT_COMPILE_COMMANDS
    CMAKE_MODULE_PATH BUILD_TESTING)
function(say when)
    foreach(name IN LISTS names)
        message("${when} ${name}=${${name}}")
    endforeach()
    foreach(name IN ITEMS COMPILE_OPTIONS COMPILE_DEFINITIONS LINK_OPTIONS INCLUDE_DIRECTORIES)
        get_directory_property(value ${name})
        message("${when} ${name}=${value}")
    endforeach()
    get_cmake_property(cached CACHE_VARIABLES)
    foreach(name IN LISTS cached)
        message("${when} cached ${name}")
    endforeach()
endfunction()
function(say_targets folder)
    get_directory_property(targets DIRECTORY ${folder} BUILDSYSTEM_TARGETS)
    foreach(target IN LISTS targets)
        message("target ${target}")
    endforeach()
    get_directory_property(folders DIRECTORY ${folder} SUBDIRECTORIES)
    foreach(below IN LISTS folders)
        say_targets(${below})
    endforeach()
endfunction()
"""


def test_another_project_keeps_its_settings_and_gets_prefixed_names_only(tmp_path: Path) -> None:
    """Its own station, too, whose description lies in a folder of its own."""
    hub = (ROOT / "codegen/stations/hub.toml").read_text()
    (tmp_path / "kiosk.toml").write_text(hub.replace('name = "hub"', 'name = "kiosk"'))
    said = parent(
        tmp_path,
        f"{SETTINGS}\nset(CMAKE_C_STANDARD 99)\nset(TAPER_STATIONS kiosk)\nset(TAPER_STATION_DIR {tmp_path})\n"
        f"set(TAPER_WITH_PLANNER OFF)\nsay(before)\nadd_subdirectory({ROOT} taper)\nsay(after)\nsay_targets({ROOT})\n",
    ).splitlines()
    before, after = ([line.removeprefix(when) for line in said if line.startswith(when)] for when in ("before ", "after "))
    new = set(after) - set(before)
    cmake_s_own = "cached CMAKE_PROJECT_VERSION"  # of project()
    assert [name for name in new if not name.lower().startswith("cached taper") and cmake_s_own not in name] == []
    assert set(before) <= set(after)
    targets = [line.removeprefix("target ") for line in said if line.startswith("target ")]
    assert "taper" in targets
    assert [name for name in targets if not name.startswith("taper")] == []
    assert [name for name in targets if "sim" in name or "linux" in name] == []
    assert "taper_station_kiosk" in (tmp_path / "build/taper/generated/include/taper/stations.h").read_text()


# ---- On a microcontroller


@pytest.fixture(scope="module")
def microcontroller(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("microcontroller")
    command = code_below("For a microcontroller").replace("-DTAPER_FROM", "-DTAPER_INSTALL=ON -DTAPER_FROM")
    run(command, BUILD=folder)
    return folder


def is_a_firmware_for_arm(program: Path) -> bool:
    symbols = run(f"arm-none-eabi-nm {program}").split()
    return {"main", "taper_station_step", "taper_osqp_update_data_mat"} <= set(symbols)


def test_add_subdirectory_links_a_firmware_for_a_microcontroller(microcontroller: Path) -> None:
    assert is_a_firmware_for_arm(microcontroller / "m7/minimal")


def test_find_package_links_a_firmware_for_a_microcontroller(microcontroller: Path) -> None:
    installed = microcontroller / "installed"
    run('cmake --install "$BUILD/m7" --component library --prefix "$PREFIX"', BUILD=microcontroller, PREFIX=installed)
    toolchain = ROOT / "tools/cmake/cortex-m7.cmake"
    run(
        'cmake -S examples/minimal -B "$BUILD/found" -DCMAKE_PREFIX_PATH="$PREFIX" -DCMAKE_TOOLCHAIN_FILE="$FILE"\n'
        'cmake --build "$BUILD/found"',
        BUILD=microcontroller,
        PREFIX=installed,
        FILE=toolchain,
    )
    assert is_a_firmware_for_arm(microcontroller / "found/minimal")
