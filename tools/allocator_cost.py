#!/usr/bin/env python3
"""What a tick of the allocator costs, in instructions: one allocation, one grant and both guards, by connectors and depth.

Counted by valgrind's callgrind on tests/deep/bench_allocator, as the difference of two runs, so that the start does not
count. The numbers do not depend on what else the machine does. For a microcontroller they are an order of magnitude.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BENCH = ROOT / "build/host-release/tests/deep/bench_allocator"
CONNECTORS = (9, 18, 27, 54)
DEPTHS = (1, 2, 3, 4)
FEW, MANY = 5, 55  # rounds


def counted(bench: Path, connectors: int, depth: int, rounds: int) -> int:
    """Instructions of a whole run."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", str(bench), str(connectors), str(depth),
               str(rounds)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300)
    found = re.search(r"Collected : (\d+)", run.stderr)
    if run.returncode != 0 or found is None:
        sys.exit(f"allocator_cost: {' '.join(command)} failed:\n{run.stderr}")
    return int(found.group(1))


def per_round(bench: Path, connectors: int, depth: int) -> float:
    more = counted(bench, connectors, depth, MANY) - counted(bench, connectors, depth, FEW)
    return more / (MANY - FEW)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bench", type=Path, default=BENCH, help="default: that of host-release")
    bench = parser.parse_args().bench
    if shutil.which("valgrind") is None:
        sys.exit("allocator_cost: needs valgrind: sudo apt-get install valgrind")
    if not bench.is_file():
        sys.exit(f"allocator_cost: no {bench}; run: tools/dev build")
    print("instructions per allocation, grant and guards")
    print("connectors" + "".join(f"  depth {depth:<3}" for depth in DEPTHS))
    for connectors in CONNECTORS:
        print(f"{connectors:10}" + "".join(f"{per_round(bench, connectors, depth):11.0f}" for depth in DEPTHS), flush=True)


if __name__ == "__main__":
    main()
