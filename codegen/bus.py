#!/usr/bin/env python3
"""Writes, or checks, the committed files that are made from bus.toml: taper.dbc and the tables of docs/protocol.md."""

import argparse
import sys
from pathlib import Path

from bus_dbc import full_dbc
from bus_docs import with_tables
from bus_model import Bus, read_bus
from toml_table import TomlError

_HERE = Path(__file__).resolve().parent
_ROOT = _HERE.parent


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Check the files that are made from bus.toml, or write them.")
    parser.add_argument("--write", action="store_true", help="write them")
    options = parser.parse_args(arguments)
    try:
        files = committed_files(read_bus(_HERE / "bus.toml"))
    except TomlError as error:
        print(error, file=sys.stderr)
        return 1
    stale = [path for path, text in files.items() if not path.is_file() or path.read_text(encoding="utf-8") != text]
    for path in stale:
        if options.write:
            path.write_text(files[path], encoding="utf-8", newline="\n")
        print(f"{path.relative_to(_ROOT)}: {'written' if options.write else 'stale: python codegen/bus.py --write'}")
    return 1 if stale and not options.write else 0


def committed_files(bus: Bus) -> dict[Path, str]:
    """What the files have to hold, by path."""
    page = _ROOT / "docs" / "protocol.md"
    return {_HERE / "taper.dbc": full_dbc(bus), page: with_tables(bus, page.read_text(encoding="utf-8"), page.name)}


if __name__ == "__main__":
    sys.exit(main())
