"""The library as a file and from Python, and the examples of host_sim/scheduler/README.md."""

import ctypes
import os
import re
import subprocess
import sys

import pytest
from conftest import LIBRARY, ROOT
from taperlib.files import InputError
from taperlib.scheduler import (
    Account,
    Connector,
    Group,
    Scheduler,
    SchedulerError,
    Vehicle,
    Why,
    _Current,
    _Options,
    _Point,
    _Vehicle,
    station_names,
)

HEADER = ROOT / "host_sim/scheduler/include/taper_scheduler.h"
README = ROOT / "host_sim/scheduler/README.md"
STRUCTURES = {"options": _Options, "connector": Connector, "group": Group, "vehicle": _Vehicle, "point": _Point,
              "current": _Current, "account": Account}
CAR = Vehicle(session=1, need_kwh=20.0, departs_s=7200.0, max_kw=22.0)


def lines(command, **options):
    return subprocess.run(command, capture_output=True, text=True, check=True, **options).stdout.splitlines()


def test_the_library_shows_its_interface_and_nothing_else():
    """A program may have an OSQP, and a Taper, of its own besides."""
    declared = set(re.findall(r"TAPER_SCHEDULER_API [^;(]*?\b(taper_scheduler_\w+)\(", HEADER.read_text()))
    shown = {line.split()[-1] for line in lines(["nm", "-D", "--defined-only", LIBRARY])}
    assert shown == declared
    assert len(shown) == 18


def test_the_library_needs_libc_and_libm_alone():
    needed = {re.search(r"\[(.*?)\.so", line)[1] for line in lines(["readelf", "-d", LIBRARY]) if "(NEEDED)" in line}
    assert needed <= {"libc", "libm"}


def test_its_code_can_be_shared():
    """Nothing of it has to be changed where it is loaded, so processes share its pages."""
    assert not [line for line in lines(["readelf", "-d", LIBRARY]) if "TEXTREL" in line]


@pytest.mark.parametrize("name", STRUCTURES)
def test_the_bindings_structures_are_those_of_the_header(name, tmp_path):
    fields = [field for field, _ in STRUCTURES[name]._fields_]
    source = tmp_path / "sizes.c"
    asked = ", ".join(f"(int)offsetof(taper_scheduler_{name}_t, {field})" for field in fields)
    source.write_text(f'#include <stddef.h>\n#include <stdio.h>\n#include "taper_scheduler.h"\nint main(void) {{\n'
                      f'    const int at[] = {{{asked}, (int)sizeof(taper_scheduler_{name}_t)}};\n'
                      '    for (unsigned k = 0; k < sizeof at / sizeof *at; k++) { printf("%d\\n", at[k]); }\n}\n')
    subprocess.run(["cc", f"-I{HEADER.parent}", source, "-o", tmp_path / "sizes"], check=True)
    here = [*(getattr(STRUCTURES[name], field).offset for field in fields), ctypes.sizeof(STRUCTURES[name])]
    assert [int(line) for line in lines([tmp_path / "sizes"])] == here
    declared = re.search(rf"typedef struct {{([^}}]*)}} taper_scheduler_{name}_t;", HEADER.read_text())[1]
    assert re.findall(r"^    \w+\s+(\w+);", declared, re.MULTILINE) == fields


def test_stations_are_listed():
    assert {"hub", "caltech"} <= set(station_names(LIBRARY))


def test_a_car_gets_its_current_and_a_reason(hub):
    hub.set_vehicle(2, CAR)
    currents = hub.plan(0.0)
    assert (currents[2].current_a, currents[2].why) == (31.9, Why.VEHICLE_LIMIT)
    assert currents[0].why == Why.NO_VEHICLE
    assert hub.account().planned == 1
    assert hub.holds([one.current_a for one in currents])
    hub.set_vehicle(2, None)
    assert hub.plan(300.0)[2].current_a == 0


def test_rates_groups_limits_and_courses_reach_the_library(hub):
    hub.set_rates(2, [0, 10, 20], continuous=False)
    assert (hub.connectors[2].min_A, hub.connectors[2].max_A) == (10, 20)
    hub.set_group(1, line_a=15)
    assert hub.groups[1].line_A == 15
    hub.set_vehicle(2, CAR)
    assert hub.plan(0.0)[2].current_a == 10
    hub.set_limit(5.0)
    assert hub.plan(300.0)[2].current_a == 0
    hub.set_limit(100.0)
    hub.set_course([(0.0, 100.0), (900.0, 0.0)])
    assert [hub.plan(time)[2].current_a for time in (600.0, 900.0)] == [10, 0]


@pytest.mark.parametrize(("refused", "words"), [
    (lambda hub: hub.set_vehicle(8, CAR), "connector 8"),
    (lambda hub: hub.set_vehicle(0, Vehicle(1, -1.0, 0.0)), "out of its range"),
    (lambda hub: hub.set_limit(float("nan")), "limit nan kW"),
    (lambda hub: hub.set_rates(0, [7, 6], continuous=False), "rates"),
    (lambda hub: hub.holds([0.0]), "1 currents for 8 connectors"),
    (lambda hub: hub.plan(-1.0), "time -1.0 s"),
    (lambda hub: Scheduler("hub", library=LIBRARY), "open already"),
    (lambda hub: Scheduler("hut", library=LIBRARY), "hut: there is no station"),
])
def test_what_the_library_refuses_is_told_in_words(hub, refused, words):
    with pytest.raises(SchedulerError, match=words):
        refused(hub)


def test_a_library_that_is_not_there_is_told(tmp_path):
    with pytest.raises(InputError, match="cannot be loaded"):
        Scheduler("hub", library=tmp_path / "libtaper_scheduler.so")


# ---- The examples of the README


def block_below(heading, number=0):
    """A block of code below a heading."""
    section = README.read_text().split(f"## {heading}\n")[1]
    blocks = re.findall(r"(?:^    .*\n)+", section, re.MULTILINE)
    return re.sub(r"^    ", "", blocks[number], flags=re.MULTILINE)


def run(command, **variables):
    environment = {**os.environ, "PATH": f"{os.path.dirname(sys.executable)}:{os.environ['PATH']}",
                   **{name: str(value) for name, value in variables.items()}}
    done = subprocess.run(["bash", "-euc", command], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """Where the library was installed by the README's command."""
    folder = tmp_path_factory.mktemp("scheduler")
    build = LIBRARY.parents[2]
    run(block_below("Install").replace("build/host-release", str(build)), PREFIX=folder)
    return folder


def test_installed_are_library_and_header_alone(prefix):
    files = {path.name for path in prefix.rglob("*") if path.is_file()}
    assert {name.split(".so")[0] for name in files} == {"libtaper_scheduler", "taper_scheduler.h"}


def test_both_examples_run_and_say_what_the_readme_says(prefix, tmp_path):
    in_c = run(block_below("In C"), PREFIX=prefix, BUILD=tmp_path)
    in_python = run(block_below("In Python").replace("build/venv/bin/python", sys.executable), PREFIX=prefix)
    assert in_c == in_python == block_below("In Python", 1)
