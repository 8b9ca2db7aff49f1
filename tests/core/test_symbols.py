"""What the core libraries may call: no heap, no stdio, nothing that is not prefixed."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

LIBRARIES = [Path(name) for name in os.environ["TAPER_CORE_LIBRARIES"].split(",")]
FORBIDDEN = re.compile(r"(malloc|calloc|realloc|free|[a-z]*printf|puts|putchar|fputs|fwrite|abort|exit)(_chk)?$")


def symbols(library: Path) -> list[tuple[str, str]]:
    """(kind, name) of every symbol; kind as nm prints it, U for what the library wants from elsewhere."""
    lines = subprocess.run(["nm", str(library)], capture_output=True, text=True, check=True).stdout.splitlines()
    return [(parts[-2], parts[-1].lstrip("_")) for parts in map(str.split, lines) if len(parts) >= 2]


def wanted(library: Path) -> set[str]:
    return {name for kind, name in symbols(library) if kind == "U"}


def exported(library: Path) -> set[str]:
    return {name for kind, name in symbols(library) if kind in "TDBRC"}


@pytest.mark.parametrize("library", LIBRARIES, ids=lambda path: path.stem)
def test_a_core_library_uses_no_heap_and_no_stdio(library: Path) -> None:
    assert not [name for name in wanted(library) if FORBIDDEN.match(name)]


@pytest.mark.parametrize("library", [path for path in LIBRARIES if "osqp" not in path.stem], ids=lambda path: path.stem)
def test_a_core_library_exports_prefixed_names_only(library: Path) -> None:
    assert exported(library)
    assert not [name for name in exported(library) if not name.startswith("taper_")]


def test_the_search_for_forbidden_names_finds_them() -> None:
    names = ["malloc", "free", "printf", "snprintf", "vfprintf_chk", "puts", "exit"]
    assert [name for name in names if FORBIDDEN.match(name)] == names
    assert not FORBIDDEN.match("taper_free_slots")
