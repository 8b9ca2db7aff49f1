"""tools/budgets: flash, RAM, stack and instructions of the boards' images, against a committed table of limits."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from taperlib import board_run
from taperlib.budgets import DOCS, TABLE, BadTable, Table, page
from taperlib.callgraph import CallGraph, CallList, Chain, StackUnknown
from taperlib.emulator import EmulatorError
from taperlib.image import BrokenImage, Image

ROOT = Path(__file__).resolve().parents[2]
PRESETS = ("cm7-hub", "cm7-garage", "cm4-hub")
HAVE_DOUBLES = ("cm7-hub", "cm7-garage")
HOST_BUILD = ROOT / "build/budgets-host"
# The stack that the emulator saw in use is below what the analysis says, and not by more than this.
STACK_SLACK = 0.30

EPILOG = """\
Limits and their reasons are in tools/budgets.toml, what pointers to functions may lead to in tools/indirect_calls.toml, and
the result as a page in docs/budgets.md. Exit code: 0 all within limits, 1 not.
"""


def build(preset: str) -> None:
    _quietly(["cmake", "--preset", preset])
    _quietly(["cmake", "--build", "--preset", preset])


def _quietly(command: list[str]) -> None:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        raise BrokenImage(f"{' '.join(command)} failed:\n{done.stdout[-3000:]}{done.stderr[-1000:]}")


class Measured:
    """An image's figures, the notes that belong to them, and what no limit could allow."""

    def __init__(self, preset: str, image: Image, known: CallList) -> None:
        self.preset, self.image = preset, image
        self.figures: dict[str, int] = dict(image.memory())
        self.notes: dict[str, str] = {}
        self.complaints: list[str] = []
        graph = CallGraph(image, known)
        graph.check_list()
        self._add_stack("stack_B", graph.worst(), image.stack_sizes()[0])
        self._add_stack("stack_fault_B", graph.worst_of_fault(), image.stack_sizes()[1])
        for name in image.forbidden(preset in HAVE_DOUBLES):
            self.complaints.append(f"{preset}: the image holds {name}: no heap, no formatted output, and where the core "
                                   "has no unit for it no double precision. The linker's map says who wants it.")

    def _add_stack(self, figure: str, chain: Chain, room_B: int) -> None:
        self.figures[figure] = chain.size_B
        self.notes[figure] = str(chain)
        if chain.size_B > room_B:
            self.complaints.append(f"{self.preset}: {figure} is {chain.size_B:,}, and the stack has {room_B:,}: {chain}. "
                                   "Make the largest frames smaller, or the stack larger.")

    def add_run(self, figures: dict[str, int]) -> None:
        """What the emulator counted; its stack must agree with the analysis."""
        self.figures |= figures
        told, seen = self.figures["stack_B"], figures["stack_used_B"]
        if not (1 - STACK_SLACK) * told <= seen <= told:
            self.complaints.append(
                f"{self.preset}: the emulator saw {seen:,} B of stack in use, the analysis says {told:,}. It must be above, "
                f"and by no more than {STACK_SLACK:.0%}: is tools/indirect_calls.toml right, or was the run too tame?")


def run_program() -> Path:
    """taper-sim, of whatever build there is: on a board it only drives."""
    found = [ROOT / f"build/{preset}/host_sim/taper-sim" for preset in ("host-release", "host-debug")]
    program = next((path for path in found if path.exists()), None)
    if program is None:
        raise BrokenImage("there is no taper-sim; build one: tools/dev build host-release")
    return program


def measure_host(station: str, iterations: int) -> dict[str, int]:
    """Under valgrind, in a build of its own: float, and without sanitizers."""
    _quietly(["cmake", "-S", str(ROOT), "-B", str(HOST_BUILD), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
              "-DCMAKE_C_FLAGS_RELEASE=-O2 -g", "-DTAPER_REAL=float", f"-DTAPER_STATIONS={station}", "-DBUILD_TESTING=OFF"])
    _quietly(["cmake", "--build", str(HOST_BUILD), "-t", "taper-sim"])
    with tempfile.TemporaryDirectory() as folder:
        program = HOST_BUILD / "host_sim/taper-sim"
        return board_run.host_figures(program, board_run.SCENES[station], iterations, Path(folder))


def show(measured: Measured, table: Table) -> None:
    print(measured.preset)
    budgets = table.budgets.get(measured.preset, {})
    for figure, value in measured.figures.items():
        budget = budgets.get(figure)
        limit = f"limit {budget.limit:>11,}" if budget else "no limit"
        print(f"  {figure:<26}{value:>13,}   {limit}   {table.figures.get(figure, '')}")
    for figure, note in measured.notes.items():
        print(f"  {figure}: {note}")


def write(table: Table, results: list[Measured]) -> None:
    for measured in results:
        table = table.with_measured(measured.preset, measured.figures, measured.notes)
    TABLE.write_text(table.text)
    DOCS.write_text(page(DOCS.read_text(), table))


def measure(preset: str, arguments: argparse.Namespace) -> Measured:
    if not arguments.built:
        build(preset)
    measured = Measured(preset, Image.of_build(ROOT / "build" / preset), CallList.read())
    station = preset.partition("-")[2]
    iterations = board_iterations(ROOT / "build" / preset)
    if arguments.run:
        with tempfile.TemporaryDirectory() as folder:
            scene = board_run.SCENES[station]
            measured.add_run(board_run.figures(run_program(), measured.image.elf, scene, iterations, Path(folder)))
    if arguments.host and preset == "cm7-hub":
        measured.figures |= measure_host(station, iterations)
    return measured


def board_iterations(build_folder: Path) -> int:
    """Of the solver in a tick, as the image was built."""
    lines = (build_folder / "CMakeCache.txt").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("TAPER_ITERATIONS:")).partition("=")[2])


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="tools/budgets", description=__doc__, epilog=EPILOG,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("preset", nargs="*", help=f"images to look at (default: {', '.join(PRESETS)})")
    parser.add_argument("--built", action="store_true", help="take the images as they are, instead of building them")
    parser.add_argument("--run", action="store_true", help="also run them in the emulator: instructions, stack used")
    parser.add_argument("--host", action="store_true", help="also run hub under valgrind on this machine")
    parser.add_argument("--write", action="store_true", help="renew the measured values in the table; never a limit")
    parser.add_argument("--map", metavar="PRESET", help="only tell what takes the space in this image")
    options = parser.parse_args(arguments)
    for preset in [*options.preset, *([options.map] if options.map else [])]:
        if preset not in PRESETS:
            parser.error(f"{preset}: no preset of a board; there are {', '.join(PRESETS)}")
    return options


def show_map(preset: str, built: bool) -> None:
    if not built:
        build(preset)
    print(Image.of_build(ROOT / "build" / preset).map_summary())


def check(options: argparse.Namespace) -> list[str]:
    """Measure, show, write if wanted. @return complaints."""
    table = Table.read()
    results = [measure(preset, options) for preset in options.preset or PRESETS]
    for measured in results:
        show(measured, table)
    complaints = [complaint for measured in results for complaint in measured.complaints]
    complaints += [c for measured in results for c in table.check(measured.preset, measured.figures)]
    if options.write:
        write(table, results)
    elif DOCS.read_text() != page(DOCS.read_text(), table):
        complaints.append("docs/budgets.md is not what tools/budgets.toml says; renew it: tools/budgets --write")
    return complaints


def main(arguments: list[str] | None = None) -> int:
    options = parse(arguments)
    try:
        if options.map:
            show_map(options.map, options.built)
            return 0
        complaints = check(options)
    except (BadTable, BrokenImage, EmulatorError, StackUnknown, board_run.RunFailed) as error:
        complaints = [str(error)]
    for complaint in complaints:
        print(f"tools/budgets: {complaint}", file=sys.stderr)
    return 1 if complaints else 0
