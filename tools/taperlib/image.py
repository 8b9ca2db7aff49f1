"""What an image of a board is made of, from its ELF file and the linker's map beside it: sizes, symbols, libraries."""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

_TOOLS = "arm-none-eabi-"
_PIECE = re.compile(r"^ (\.\S+|COMMON)\s+0x(\w+)\s+0x(\w+)\s+(\S.*)$")
_OUTPUT = re.compile(r"^(\.\S+)\s+0x(\w+)\s+0x(\w+)")
_SYMBOL = re.compile(r"^(\w+) (?:(\w+) )?(\w) (\S+)$")

FLASH_SECTIONS = (".vectors", ".text", ".rodata", ".ARM.exidx")
RAM_SECTIONS = (".stack", ".data", ".bss", ".noinit")

# Not a line of a product needs these: heap, formatted output, and what the standard library does with files and streams.
HEAP_AND_STDIO = re.compile(
    r"_?(malloc|calloc|realloc|free|sbrk|v?(sn|s|f|d|as)?i?printf|v?f?i?scanf|f?puts|putchar|fwrite|exit)(_r)?$"
)
# Helpers for double precision, which a Cortex-M4F does in software (Run-time ABI for the Arm Architecture, 4.1).
DOUBLE_HELPERS = re.compile(
    r"__aeabi_(d\w+|cd\w+|[a-z]+2d)$|__(add|sub|mul|div|neg)df3$|__(eq|ne|lt|le|gt|ge|unord)df2$|__(fix|float)\w*df\w*$"
)


class BrokenImage(Exception):
    """An image or its build folder is not what this tool was written for."""


def run(tool: str, *arguments: str | Path) -> str:
    """Output of one of the cross toolchain's programs."""
    command = [f"{_TOOLS}{tool}", *map(str, arguments)]
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout
    except FileNotFoundError:
        raise BrokenImage(f"{command[0]} is not there; tools/dev setup installs it") from None
    except subprocess.CalledProcessError as failed:
        raise BrokenImage(f"{' '.join(command)}: {failed.stderr.strip()}") from None


@dataclass(frozen=True)
class Symbol:
    address: int
    size_B: int
    kind: str  # as nm prints it
    name: str


@dataclass(frozen=True)
class Piece:
    """An input section in the image."""

    output: str  # section that it is in
    name: str
    address: int
    size_B: int
    file: str  # as the map names it: path of an object, or archive(member)

    @property
    def library(self) -> str:
        """The layer of firmware/, the folder of a board, or the library of the toolchain."""
        archive = re.match(r"(.*/)?lib([^/]+)\.a\(", self.file)
        if archive:
            return archive[2].removeprefix("taper_")
        inside = re.match(r"firmware/([^/]+)/", self.file)
        return inside[1] if inside else "toolchain"

    @property
    def object(self) -> str:
        return re.sub(r"(\.c)?\.o(bj)?$", "", re.sub(r".*[/(]", "", self.file).rstrip(")"))

    @property
    def is_solver_workspace(self) -> bool:
        return self.library == "solvers" and self.object.endswith("_workspace")


def _joined(lines: Iterable[str]) -> Iterable[str]:
    """The map's lines; a long section name has its numbers on the next one."""
    held = ""
    for line in lines:
        if re.match(r"^ ?\.\S+$", line):
            held = line
        elif held:
            yield f"{held} {line.strip()}"
            held = ""
        else:
            yield line


def parse_map(text: str) -> list[Piece]:
    """All that is in the image, from the map's second half."""
    _, _, body = text.partition("Linker script and memory map")
    pieces, output = [], ""
    for line in _joined(body.splitlines()):
        if found := _OUTPUT.match(line):
            output = found[1]
        elif (found := _PIECE.match(line)) and int(found[3], 16) > 0:
            pieces.append(Piece(output, found[1], int(found[2], 16), int(found[3], 16), found[4]))
    return [piece for piece in pieces if piece.output in (*FLASH_SECTIONS, *RAM_SECTIONS)]


class Image:
    """An image, and the map that its linker wrote beside it."""

    def __init__(self, elf: Path) -> None:
        self.elf = elf
        if not elf.exists() or not elf.with_suffix(".map").exists():
            raise BrokenImage(f"{elf} and its .map are not there: build the image")

    @classmethod
    def of_build(cls, folder: Path) -> Image:
        """The one image in a build folder."""
        found = sorted(folder.glob("firmware/*/*.elf"))
        if len(found) != 1:
            raise BrokenImage(f"{folder} holds {len(found)} images instead of one")
        return cls(found[0])

    @property
    def build(self) -> Path:
        return self.elf.parents[2]

    @cached_property
    def pieces(self) -> list[Piece]:
        return parse_map(self.elf.with_suffix(".map").read_text())

    @cached_property
    def symbols(self) -> list[Symbol]:
        lines = run("nm", "-S", "--defined-only", self.elf).splitlines()
        found = [found for found in map(_SYMBOL.match, lines) if found]
        return [Symbol(int(match[1], 16), int(match[2] or "0", 16), match[3], match[4]) for match in found]

    @cached_property
    def sections(self) -> dict[str, int]:
        """Size of each section [B]."""
        lines = run("size", "-A", self.elf).splitlines()
        fields = [line.split() for line in lines]
        return {field[0]: int(field[1]) for field in fields if len(field) == 3 and field[1].isdigit()}

    def stack_sizes(self) -> tuple[int, int]:
        """Of the stack, and of the one for faults [B]."""
        at = {symbol.name: symbol.address for symbol in self.symbols}
        return at["mps2_stack_top"] - at["mps2_stack_limit"], at["mps2_fault_stack_top"] - at["mps2_stack_top"]

    def struct_size_B(self, typedef: str) -> int:
        """Size of a structure type, from the debugging information."""
        text = self._types
        named = re.search(rf"DW_AT_name\s*: (?:\([^)]*\): )?{typedef}\n(?:.*\n)*?.*DW_AT_type\s*: <0x(\w+)>", text)
        size = named and re.search(rf"<1><{named[1]}>.*\n(?:(?! <1>).*\n)*?.*DW_AT_byte_size\s*: (\w+)", text)
        if not size:
            raise BrokenImage(f"{self.elf}: no debugging information on {typedef}")
        return int(size[1], 0)

    @cached_property
    def _types(self) -> str:
        return run("readelf", "--debug-dump=info", "--dwarf-depth=2", self.elf)

    def memory(self) -> dict[str, int]:
        """The figures of flash and RAM [B]."""
        flash_B = sum(self.sections.get(name, 0) for name in FLASH_SECTIONS)
        tables_B = self._workspace_B(".rodata")
        ram = {name: self.sections.get(name, 0) for name in RAM_SECTIONS}
        solver_B = self._workspace_B(".data") + self._workspace_B(".bss")
        station_B, queues_B = self.struct_size_B("taper_station_t"), self.struct_size_B("taper_slcan_t")
        known_B = solver_B + station_B + queues_B + ram[".stack"]
        return {
            "flash_code_B": flash_B - tables_B,
            "flash_solver_tables_B": tables_B,
            "flash_start_values_B": ram[".data"],
            "ram_B": sum(ram.values()),
            "ram_solver_B": solver_B,
            "ram_station_B": station_B,
            "ram_queues_B": queues_B,
            "ram_stack_B": ram[".stack"],
            "ram_rest_B": sum(ram.values()) - known_B,
        }

    def _workspace_B(self, output: str) -> int:
        return sum(piece.size_B for piece in self.pieces if piece.output == output and piece.is_solver_workspace)

    def forbidden(self, has_doubles: bool) -> list[str]:
        """Names of functions that no image may hold; helpers for doubles only where the core has no unit for them."""
        names = {symbol.name for symbol in self.symbols}
        bad = {name for name in names if HEAP_AND_STDIO.match(name)}
        if not has_doubles:
            bad |= {name for name in names if DOUBLE_HELPERS.match(name)}
        return sorted(bad)

    def map_summary(self) -> str:
        """What takes the space: by library, by object, and the largest symbols."""
        return "\n\n".join([
            _table("library", self.pieces, lambda piece: piece.library),
            _table("object", self.pieces, lambda piece: f"{piece.library}/{piece.object}", 25),
            self._largest(25),
        ])

    def _largest(self, count: int) -> str:
        largest = sorted(self.symbols, key=lambda symbol: -symbol.size_B)[:count]
        head = f"{'symbol':<44}{'where':<8}{'bytes':>9}"
        where = {"t": "code", "r": "flash", "d": "data", "b": "bss"}
        return "\n".join(
            [head, *(f"{s.name[:43]:<44}{where.get(s.kind.lower(), s.kind):<8}{s.size_B:>9,}" for s in largest)]
        )


_AREAS = {".text": "code", ".vectors": "code", ".rodata": "constants", ".ARM.exidx": "constants", ".data": "data"}


def _table(title: str, pieces: list[Piece], key, count: int | None = None) -> str:
    """Bytes by `key` and area, largest first; `data` is in RAM, and once more in flash."""
    areas = ("code", "constants", "data", "zeros")
    sums: Counter[tuple[str, str]] = Counter()
    totals: Counter[str] = Counter()
    for piece in pieces:
        sums[key(piece), _AREAS.get(piece.output, "zeros")] += piece.size_B
        totals[key(piece)] += piece.size_B
    lines = [f"{title:<34}" + "".join(f"{area:>11}" for area in areas)]
    for name, _ in totals.most_common(count):
        lines.append(f"{name[:33]:<34}" + "".join(f"{sums[name, area]:>11,}" for area in areas))
    return "\n".join(lines)
