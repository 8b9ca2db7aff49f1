"""The deepest stack of an image, from its code and from what GCC says of every function.

Who calls whom is read in the disassembly, where nothing is left to guess: inlining, clones and the compiler's own helpers
are as they are. How much a function puts on the stack GCC says (-fcallgraph-info=su, the .ci file beside each object); where it
does not, as for the toolchain's library, the disassembly does. Calls through pointers are what a list says that they may be
(tools/indirect_calls.toml); a call that is not on it is an error, and so is a function whose address is taken and that no
entry of the list leads to.
"""

from __future__ import annotations

import re
import tomllib
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from taperlib.image import Image, run

ROOT = Path(__file__).resolve().parents[2]
CALLS = ROOT / "tools/indirect_calls.toml"

_NODE = re.compile(r'^node: \{ title: "([^"]+)" label: "[^"]*\\n(\d+) bytes \(([^)]*)\)')
_EDGE = re.compile(r'^edge: \{ sourcename: "([^"]+)" targetname: "__indirect_call" label: "([^"]+)"')
_FUNCTION = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")
_INSTRUCTION = re.compile(r"^\s*([0-9a-f]+):\t(\S+)(?:\t(.*))?$")
_BRANCH = re.compile(r"^(bl?|b(?:eq|ne|cs|cc|mi|pl|vs|vc|hi|ls|ge|lt|gt|le))(?:\.[nw])?$|^cbn?z$")
_ADDRESS = re.compile(r"([0-9a-f]+) <")
_POINTER = re.compile(r"^[0-9a-f]+\s+\w+\s+(R_ARM_ABS32|R_ARM_MOVW_ABS_NC|R_ARM_THM_MOVW_ABS_NC)\s+\w+\s+(\S+)")
# Words that the core stacks at an exception with its floating-point state, with one to align (ARMv7-M, B1.5.7).
EXCEPTION_B = 4 * 27


class StackUnknown(Exception):
    """The depth of the stack cannot be told; says why, and what to do."""


@dataclass
class Function:
    """A function of the image."""

    address: int
    name: str
    file: str  # source, below the root or the build folder; of a library: its archive
    frame_B: int = 0
    calls: set[int] = field(default_factory=set)
    jumps: set[int] = field(default_factory=set)  # at its end, with its own frame gone
    through_pointers: int = 0  # places
    sites: set[str] = field(default_factory=set)  # of calls through pointers: "file: expression"

    @property
    def title(self) -> str:
        return f"{self.name} ({self.file})"


@dataclass(frozen=True)
class Interrupt:
    """A handler that is not a fault: `priority` as in the NVIC, the smaller one interrupts the greater."""

    handler: str
    priority: int


@dataclass(frozen=True)
class CallList:
    """What calls through pointers may lead to, and what else is known of a board."""

    callees: dict[str, tuple[str, ...]]  # by site
    interrupts: tuple[Interrupt, ...]
    fault_handler: str  # has a stack of its own, whose size a symbol tells
    never_called: tuple[str, ...]  # their addresses are in tables of OSQP, which nothing here calls

    @classmethod
    def read(cls, path: Path = CALLS) -> CallList:
        text = tomllib.loads(path.read_text())
        callees: dict[str, tuple[str, ...]] = {}
        for entry in text.get("call", ()):
            for site in entry["at"]:
                callees[site] = tuple(entry["to"])
        interrupts = tuple(Interrupt(**entry) for entry in text["interrupt"])
        return cls(callees, interrupts, text["fault_handler"], tuple(text["never_called"]))


@dataclass(frozen=True)
class Chain:
    """Functions from a root to the deepest point, with their frames."""

    links: tuple[tuple[str, int], ...]

    @property
    def size_B(self) -> int:
        return sum(frame_B for _, frame_B in self.links)

    def __str__(self) -> str:
        return " > ".join(f"{name} {frame_B}" for name, frame_B in self.links)


class CallGraph:
    """All functions of an image, by address."""

    def __init__(self, image: Image, known: CallList, root: Path = ROOT) -> None:
        self.image, self.known = image, known
        self.folders = (image.build.resolve(), root)
        self.functions: dict[int, Function] = {}
        self._disassembled_frames: dict[int, int] = {}
        self._place_functions()
        self._read_code()
        self._read_compiler()
        self._resolve()

    # ---- Reading

    def _place_functions(self) -> None:
        pieces = sorted((piece for piece in self.image.pieces if piece.output == ".text"), key=lambda piece: piece.address)
        for symbol in self.image.symbols:
            if symbol.kind in "tT":
                address = symbol.address & ~1
                holder = next((p for p in reversed(pieces) if p.address <= address < p.address + p.size_B), None)
                self.functions.setdefault(address, Function(address, symbol.name, holder.file if holder else "?"))

    def _read_code(self) -> None:
        """Frames, calls and jumps of every function."""
        at: Function | None = None
        for line in run("objdump", "-d", "--no-show-raw-insn", self.image.elf).splitlines():
            if head := _FUNCTION.match(line):
                address = int(head[1], 16)
                at = self.functions.get(address) or self.functions.setdefault(address, Function(address, head[2], "?"))
            elif at and (found := _INSTRUCTION.match(line)):
                self._read_instruction(at, found[2], found[3] or "")
        starts = set(self.functions)
        for function in self.functions.values():
            function.calls &= starts
            function.jumps = (function.jumps & starts) - {function.address}

    def _read_instruction(self, at: Function, name: str, operands: str) -> None:
        self._disassembled_frames[at.address] = self._disassembled_frames.get(at.address, 0) + pushed_B(name, operands)
        if _BRANCH.match(name) and (target := _ADDRESS.search(operands)):
            (at.calls if name.startswith("bl") and name[2:3] in ("", ".") else at.jumps).add(int(target[1], 16))
        elif name == "blx" or (name == "bx" and operands.strip() != "lr"):
            at.through_pointers += 1

    def _read_compiler(self) -> None:
        by_object: dict[str, list[Function]] = defaultdict(list)
        for function in self.functions.values():
            by_object[function.file].append(function)
        for file, functions in by_object.items():
            told = self._info_of(file)
            for function in functions:
                frame_B = self._disassembled_frames.get(function.address, 0)
                told_B = told.frames.get(function.name, 0) if told else 0
                function.frame_B = told_B or frame_B
                if told_B == 0 and frame_B > 0:  # naked, or of a library: it may jump with its frame in place
                    function.calls |= function.jumps
                if told:
                    function.sites = told.sites.get(function.name, set())
                function.file = told.source if told else re.sub(r".*/", "", file)

    def _info_of(self, file: str) -> CompilerInfo | None:
        """What GCC wrote beside an object, which is in an archive or not; None: an object of the toolchain."""
        if file.startswith("/") or file == "?":
            return None
        archive = re.match(r"(.*/)lib([^/]+)\.a\((.+)\)$", file)
        if archive:
            folder = self.image.build / archive[1] / "CMakeFiles" / f"{archive[2]}.dir"
            found = sorted(folder.rglob(re.sub(r"\.o(bj)?$", ".ci", archive[3])))
        else:
            found = [self.image.build / re.sub(r"\.o(bj)?$", ".ci", file)]
        if len(found) != 1 or not found[0].exists():
            raise StackUnknown(f"{file}: no .ci file beside it; compile with -fcallgraph-info=su and build anew")
        return CompilerInfo(found[0], self.folders)

    # ---- Calls through pointers

    def _resolve(self) -> None:
        by_name: dict[str, list[Function]] = defaultdict(list)
        for function in self.functions.values():
            by_name[function.name].append(function)
            by_name[f"{function.file}:{function.name}"].append(function)
        for function in self.functions.values():
            self._demand_list(function)
            for site in function.sites:
                for name in self.known.callees.get(site, ()):
                    function.calls |= {callee.address for callee in by_name.get(name, ())}

    def _demand_list(self, function: Function) -> None:
        unknown = sorted(function.sites - set(self.known.callees))
        if unknown:
            raise StackUnknown(
                f"{function.title} calls through a pointer that no entry of tools/indirect_calls.toml has:\n"
                + "".join(f'  at = ["{site}"]\n' for site in unknown)
                + "  Add the entry, with all functions that it may lead to."
            )
        if function.through_pointers and not function.sites:
            raise StackUnknown(f"{function.title} calls through a pointer, and GCC's .ci file does not know of it")

    def address_taken(self) -> set[str]:
        """Names of functions whose address something in the image holds."""
        names = {function.name for function in self.functions.values()}
        return {name for name in self._pointers if name in names}

    @cached_property
    def _pointers(self) -> set[str]:
        files = {self.image.build / re.sub(r"\(.*", "", p.file) for p in self.image.pieces if not p.file.startswith("/")}
        found = set()
        for file in sorted(files):
            found |= pointers_in(run("readelf", "-rW", file))
        return found

    def check_list(self) -> None:
        """Every function that a pointer may hold is on the list; else an entry is not complete."""
        listed = {name.rpartition(":")[2] for names in self.known.callees.values() for name in names}
        listed |= {interrupt.handler for interrupt in self.known.interrupts}
        listed |= {self.known.fault_handler, *self.known.never_called, "mps2_reset_entry"}
        forgotten = sorted(self.address_taken() - listed)
        if forgotten:
            raise StackUnknown(
                f"{', '.join(forgotten)}: something holds the address, and no entry of tools/indirect_calls.toml "
                "leads there. Add it to the calls that may reach it."
            )

    # ---- The stack

    def named(self, name: str) -> Function:
        found = [function for function in self.functions.values() if function.name == name]
        if len(found) != 1:
            raise StackUnknown(f"the image has {len(found)} functions {name} instead of one")
        return found[0]

    def deepest_from(self, name: str) -> Chain:
        """The deepest chain of calls that begins with a function; raises StackUnknown at a recursion."""
        deepest: dict[int, Chain] = {}
        self._walk(self.named(name).address, (), deepest)
        return deepest[self.named(name).address]

    def _walk(self, address: int, path: tuple[int, ...], deepest: dict[int, Chain]) -> None:
        if address in path:
            circle = [self.functions[at].name for at in (*path[path.index(address):], address)]
            raise StackUnknown(f"recursion: {' > '.join(circle)}. A stack of known depth has none.")
        if address in deepest:
            return
        function = self.functions[address]
        for callee in sorted(function.calls | function.jumps):
            self._walk(callee, (*path, address), deepest)
        own = (function.name, function.frame_B)
        chains = [Chain((own, *deepest[callee].links)) for callee in function.calls]
        chains += [Chain(((function.name, 0), *deepest[callee].links)) for callee in function.jumps]
        deepest[address] = max([Chain((own,)), *chains], key=lambda chain: (chain.size_B, str(chain)))

    def worst(self) -> Chain:
        """The main chain, interrupted at its deepest once by each priority, and then by a fault."""
        chain = self.deepest_from("mps2_reset_entry")
        links = chain.links
        by_priority: dict[int, list[Chain]] = defaultdict(list)
        for interrupt in self.known.interrupts:
            by_priority[interrupt.priority].append(self.deepest_from(interrupt.handler))
        for priority in sorted(by_priority, reverse=True):
            handler = max(by_priority[priority], key=lambda chain: chain.size_B)
            links = (*links, ("exception", EXCEPTION_B), *handler.links)
        return Chain((*links, ("exception", EXCEPTION_B)))  # a fault, which goes on with a stack of its own

    def worst_of_fault(self) -> Chain:
        return self.deepest_from(self.known.fault_handler)


class CompilerInfo:
    """What GCC says of one source file, in its .ci file."""

    def __init__(self, path: Path, folders: Iterable[Path]) -> None:
        self.frames: dict[str, int] = {}
        self.sites: dict[str, set[str]] = defaultdict(set)
        self.folders = tuple(folders)
        self.source = "?"
        for line in path.read_text().splitlines():
            self._read(line)

    def _read(self, line: str) -> None:
        if found := re.match(r'graph: \{ title: "([^"]+)"', line):
            self.source = self._short(found[1])
        elif found := _NODE.match(line):
            name = found[1].rpartition(":")[2]
            if "dynamic" in found[3] and "bounded" not in found[3]:
                raise StackUnknown(f"{name} ({self.source}) takes stack in a size that is not known when it is compiled")
            self.frames[name] = int(found[2])
        elif found := _EDGE.match(line):
            self.sites[found[1].rpartition(":")[2]].add(self._site(found[2]))

    def _short(self, file: str) -> str:
        for folder in self.folders:
            if Path(file).is_relative_to(folder):
                return str(Path(file).relative_to(folder))
        return file

    def _site(self, place: str) -> str:
        """"file: expression", which outlives changes around it."""
        file, line, column = place.rsplit(":", 2)
        text = Path(file).read_text().splitlines()[int(line) - 1][int(column) - 1:]
        expression = re.match(r"[\w.>\-\[\]]+", text)
        if not expression:
            raise StackUnknown(f"{place}: no call stands there: the source is newer than the image; build it")
        return f"{self._short(file)}: {expression[0]}"


def pushed_B(name: str, operands: str) -> int:
    """What an instruction puts on the stack [B]; of all of them together, no more is there at a time."""
    name = name.split(".")[0]
    if name in ("push", "vpush") or (name in ("stmdb", "vstmdb") and operands.startswith("sp!")):
        return sum(_registers_B(part) for part in operands[operands.index("{") + 1:operands.index("}")].split(","))
    if name in ("sub", "subw") and (found := re.match(r"sp, (?:sp, )?#(\d+)", operands)):
        return int(found[1])
    if name in ("str", "strd") and (found := re.search(r"\[sp, #-(\d+)\]!", operands)):
        return int(found[1])
    return 0


def _registers_B(part: str) -> int:
    first, _, last = part.strip().partition("-")
    width = 8 if first.startswith("d") else 4
    return width * (int(last[1:]) - int(first[1:]) + 1) if last else width


def pointers_in(relocations: str) -> set[str]:
    """Functions that data or code refers to as a value, from `readelf -r`; what only describes code does not count."""
    found, place = set(), ""
    for line in relocations.splitlines():
        if head := re.match(r"Relocation section '\.rel(\.[^']+)'", line):
            place = head[1]
        elif not place.startswith((".debug", ".ARM")) and (pointer := _POINTER.match(line)):
            if pointer[2] != place:  # a switch jumps within its own function
                found.add(pointer[2].removeprefix(".text."))
    return found
