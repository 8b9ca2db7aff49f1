"""The Debian package of this build: what is in it, and that dpkg installs, upgrades and removes it."""

import os
import re
from pathlib import Path

import pytest
from package import ELF_MACHINES, Machine, Package, architecture, emulator, machine, run

PROGRAM = "/usr/bin/taper-station"
UNIT = "/usr/lib/systemd/system/taper-station.service"
SETTINGS = "/etc/taper/station.env"
DOCS = "/usr/share/doc/taper-station/"
VERSION = os.environ["TAPER_VERSION"]


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Package:
    folder = tmp_path_factory.mktemp("package")
    run(os.environ["TAPER_CPACK"], "--config", Path(os.environ["TAPER_BUILD"]) / "CPackConfig.cmake", "-B", folder)
    (path,) = folder.glob("*.deb")
    return Package(path)


@pytest.fixture
def host(tmp_path: Path) -> Machine:
    return Machine(tmp_path / "root")


def unit_line(host: Machine, key: str) -> str:
    (value,) = re.findall(rf"^{key}=(.*)$", host.at(UNIT).read_text(encoding="utf-8"), re.MULTILINE)
    return value


def test_the_package_says_what_it_is(package: Package) -> None:
    assert package.path.name == f"taper-station_{VERSION}_{architecture()}.deb"
    assert package.field("Package") == "taper-station"
    assert package.field("Version") == VERSION
    assert package.field("Architecture") == architecture()
    assert package.field("Maintainer") and package.field("Description")


def test_a_static_program_needs_no_library_and_another_the_ones_it_is_linked_with(package: Package) -> None:
    depends = package.field("Depends")
    if os.environ["TAPER_STATIC"] == "ON":
        assert depends == ""
    else:
        assert re.match(r"libc6(:\w+)? \(>= 2\.\d+\)", depends)


def test_it_holds_program_unit_settings_and_papers_and_nothing_else(package: Package) -> None:
    papers = ("copyright", "protocol.md", "station-daemon.md", "taper-station.env")
    assert package.files() == {PROGRAM, UNIT, SETTINGS, *(DOCS + paper for paper in papers)}


def test_all_belongs_to_root_who_alone_may_write(package: Package) -> None:
    for path, (mode, owner) in package.listing().items():
        assert owner == "root/root", path
        assert mode == ("drwxr-xr-x" if path.endswith("/") else "-rwxr-xr-x" if path == PROGRAM else "-rw-r--r--"), path


def test_the_settings_are_a_file_that_dpkg_asks_about(package: Package) -> None:
    assert package.control("conffiles").split() == [SETTINGS]


@pytest.mark.parametrize("script", ["postinst", "prerm", "postrm"])
def test_the_scripts_are_sound_shell(package: Package, tmp_path: Path, script: str) -> None:
    text = package.control(script)
    assert text.startswith("#!/bin/sh\n") and "\nset -e\n" in text
    (tmp_path / script).write_text(text, encoding="utf-8")
    run("sh", "-n", tmp_path / script)


def test_what_is_installed_runs_and_its_unit_names_it(package: Package, host: Machine) -> None:
    host.dpkg("--install", package.path)
    assert machine(host.at(PROGRAM)) == ELF_MACHINES[architecture()]
    assert run(*emulator(), host.at(PROGRAM), "--version").strip() == f"taper-station {VERSION}"
    assert unit_line(host, "ExecStart").split()[0] == PROGRAM
    assert host.at(unit_line(host, "EnvironmentFile")).is_file()
    assert host.at(unit_line(host, "Documentation").removeprefix("file:")).is_file()


def test_the_settings_have_every_variable_of_the_unit(package: Package, host: Machine) -> None:
    host.dpkg("--install", package.path)
    wanted = set(re.findall(r"\$\{?(TAPER_\w+)", unit_line(host, "ExecStart")))
    assert wanted and wanted == set(re.findall(r"^(TAPER_\w+)=", host.at(SETTINGS).read_text(encoding="utf-8"), re.MULTILINE))


def test_an_upgrade_keeps_the_settings_of_the_site(package: Package, host: Machine) -> None:
    host.dpkg("--install", package.path)
    host.at(SETTINGS).write_text("TAPER_CAN=--can can7\n", encoding="utf-8")
    host.dpkg("--install", package.path)
    assert host.at(SETTINGS).read_text(encoding="utf-8") == "TAPER_CAN=--can can7\n"


def test_removal_keeps_settings_and_store_and_purging_keeps_nothing(package: Package, host: Machine) -> None:
    host.dpkg("--install", package.path)
    store = host.at("/var/lib/private/taper/store")
    store.parent.mkdir(parents=True)
    store.touch()
    host.at("/var/lib/taper").symlink_to("private/taper")
    host.dpkg("--remove", "taper-station")
    assert not host.at(PROGRAM).exists() and host.at(SETTINGS).exists() and store.exists()
    host.dpkg("--purge", "taper-station")
    left = [path for path in host.root.rglob("*taper*") if "dpkg" not in path.parts]
    assert left == []
