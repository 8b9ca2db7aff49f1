"""What the core libraries may call: no heap, no stdio, nothing that is not prefixed."""

from __future__ import annotations

import os
import re
import subprocess
from functools import cache
from pathlib import Path

import pytest

LIBRARIES = [Path(name) for name in os.environ["TAPER_CORE_LIBRARIES"].split(",")]
FROM_OUTSIDE = re.compile(r"(mem(cpy|set|cmp|move)|sqrtf?|strcpy|strlen|stack_chk_fail|GLOBAL_OFFSET_TABLE_)$")
HEAP_OR_STDIO = {"malloc", "calloc", "realloc", "free", "printf", "fprintf", "snprintf", "puts"}


@cache
def symbols(library: Path) -> list[tuple[str, str]]:
    """(kind, name) of every symbol; kind as nm prints it, U for what the library wants from elsewhere."""
    lines = subprocess.run(["nm", str(library)], capture_output=True, text=True, check=True).stdout.splitlines()
    return [(parts[-2], parts[-1].lstrip("_")) for parts in map(str.split, lines) if len(parts) >= 2]


def wanted(library: Path) -> set[str]:
    return {name for kind, name in symbols(library) if kind == "U"}


def exported(library: Path) -> set[str]:
    return {name for kind, name in symbols(library) if kind in "TDBRC"}


def strangers(library: Path) -> list[str]:
    """What a library wants that is neither in the core nor allowed from outside."""
    core = set().union(*(exported(path) for path in LIBRARIES))
    return sorted(name for name in wanted(library) - core if not FROM_OUTSIDE.match(name))


@pytest.mark.parametrize("library", LIBRARIES, ids=lambda path: path.stem)
def test_a_core_library_wants_nothing_but_memory_copies_and_square_roots(library: Path) -> None:
    """So no heap and no stdio: malloc, free, printf and their like would be strangers."""
    assert strangers(library) == []


@pytest.mark.parametrize("library", LIBRARIES, ids=lambda path: path.stem)
def test_a_core_library_exports_prefixed_names_only(library: Path) -> None:
    """OSQP's and cantools' code too: a firmware may have its own of either."""
    assert exported(library)
    assert not [name for name in exported(library) if not name.startswith("taper_")]


def test_heap_and_stdio_would_be_found(tmp_path: Path) -> None:
    source = tmp_path / "bad.c"
    source.write_text("#include <stdio.h>\n#include <stdlib.h>\nvoid taper_bad(int n);\n"
                      "void taper_bad(int n) { void *p = malloc((size_t)n); printf(\"%p %d\", p, n); free(p); }\n")
    subprocess.run(["cc", "-O1", "-c", source, "-o", tmp_path / "bad.o"], check=True)
    assert {"malloc", "free", "printf"} <= set(strangers(tmp_path / "bad.o")) <= HEAP_OR_STDIO
