#!/usr/bin/env python3
"""Memory of every station: its solver and taper_station_t, when the image is built for this station alone.

The solver's figures are codegen's account. taper_station_t is compiled and asked for its size, with this machine's
compiler: pointers have 8 bytes here, 4 on a microcontroller.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PROBE = '#include "taper/station.h"\nchar station_size[sizeof(taper_station_t)];\n'


def generate(station: str, real: str, out: Path) -> None:
    command = [sys.executable, str(ROOT / "codegen/generate.py"), "--stations", station, "--real", real, "--out", str(out)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def solver_bytes(generated: Path, station: str) -> tuple[int, int, int]:
    """Constant arrays in flash, start values in flash, and RAM, from codegen's account."""
    line = next(line for line in (generated / "memory.txt").read_text().splitlines() if line.split()[:1] == [station])
    const, start, ram = (int(number.replace(",", "")) for number in line.split()[-3:])
    return const, start, ram


def station_bytes(generated: Path) -> int:
    layers = sorted((ROOT / "firmware").glob("*/include"))
    includes = [f"-I{folder}" for folder in [generated / "include", *layers]]
    probe, target = generated / "probe.c", generated / "probe.o"
    probe.write_text(PROBE)
    subprocess.run(["cc", "-std=c11", "-fno-common", *includes, "-c", str(probe), "-o", str(target)], check=True)
    symbols = subprocess.run(["nm", "-S", str(target)], check=True, capture_output=True, text=True).stdout
    found = re.search(r"^\w+ (\w+) B station_size$", symbols, re.MULTILINE)
    assert found, symbols
    return int(found.group(1), 16)


def main() -> int:
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    print("| station | real | solver flash, constant | solver flash, start values | solver RAM | taper_station_t |")
    print("|---|---|---|---|---|---|")
    for path in sorted((ROOT / "codegen/stations").glob("*.toml")):
        for real in ("double", "float"):
            with tempfile.TemporaryDirectory() as folder:
                generated = Path(folder) / "generated"
                generate(path.stem, real, generated)
                const, start, ram = solver_bytes(generated, path.stem)
                print(f"| {path.stem} | {real} | {const:,} | {start:,} | {ram:,} | {station_bytes(generated):,} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
