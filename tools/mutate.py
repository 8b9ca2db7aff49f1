#!/usr/bin/env python3
"""Tests of the tests: makes small mistakes in the safety code, one at a time, and looks whether a unit test notices.

Each mutant of a file is compiled like the file, linked into the unit tests of that part, and these are run until one fails.
A mutant that no test notices survives. Survivors that cannot be noticed, because they do the same, are explained in
tests/mutation/survivors.toml; the others are printed. Exit code 1 if less than --least of a part is killed, if there is a
survivor without an explanation, or an explanation without a survivor.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import os
import random
import shlex
import subprocess
import sys
import tempfile
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path

from taperlib.mutants import Mutant, mutants

ROOT = Path(__file__).resolve().parents[1]
PLAN = ROOT / "tests/mutation/parts.toml"
SURVIVORS = ROOT / "tests/mutation/survivors.toml"


@dataclass(frozen=True)
class Part:
    """Files that are mutated, and the tests that should notice."""

    name: str
    files: tuple[Path, ...]
    tests: tuple[str, ...]


@dataclass(frozen=True)
class Result:
    part: str
    file: str
    mutant: Mutant
    line_text: str
    verdict: str  # killed, survived, invalid

    @property
    def key(self) -> tuple[str, str, str]:
        return (self.file, self.line_text, self.mutant.change)


class Build:
    """How a build folder compiles a file and links a test, by what ninja would run."""

    def __init__(self, folder: Path, parts: list[Part]) -> None:
        self.folder = folder
        targets = {test for part in parts for test in part.tests}
        subprocess.run(["cmake", "--build", folder, "-t", *sorted(targets)], check=True, stdout=subprocess.DEVNULL)
        self.commands = {part.name: self.commands_for(part) for part in parts}

    def commands_for(self, part: Part) -> list[str]:
        """For its tests alone: another part's may have the same source compiled for other sizes (tests/deep)."""
        return subprocess.run(["ninja", "-C", self.folder, "-t", "commands", *part.tests],
                              check=True, capture_output=True, text=True).stdout.splitlines()

    def compile(self, part: Part, source: Path, mutated: Path, output: Path) -> bool:
        line = next(line for line in self.commands[part.name] if line.endswith(f"-c {source}"))
        words = [word for word in shlex.split(line) if word != "-Werror"]
        for flag in ("-MF", "-MT", "-o"):
            at = words.index(flag)
            del words[at : at + 2]
        words = [word for word in words if word not in ("-MD", "-c", str(source))]
        words += [f"-I{source.parent}", "-w", "-c", str(mutated), "-o", str(output)]
        return subprocess.run(words, cwd=self.folder, capture_output=True).returncode == 0

    def link(self, part: Part, test: str, mutant: Path, output: Path) -> bool:
        """The mutant's object stands before the libraries, so that theirs is not taken."""
        line = next(line for line in self.commands[part.name] if f" -o tests/unit/{test} " in line)
        command = line.replace(f" -o tests/unit/{test} ", f" {mutant} -o {output} ")
        return subprocess.run(command, shell=True, cwd=self.folder, capture_output=True).returncode == 0


def passes(program: Path, timeout_s: float) -> bool:
    try:
        return subprocess.run([program], capture_output=True, timeout=timeout_s).returncode == 0
    except subprocess.TimeoutExpired:
        return False


def judge(build: Build, part: Part, source: Path, text: str, mutant: Mutant, timeout_s: float) -> str:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        mutated, made = folder / source.name, folder / "mutant.o"
        mutated.write_text(mutant.apply(text))
        if not build.compile(part, source, mutated, made):
            return "invalid"
        for test in part.tests:
            program = folder / test
            if not build.link(part, test, made, program):
                return "invalid"
            if not passes(program, timeout_s):
                return "killed"
    return "survived"


def read_parts(wanted: list[str]) -> list[Part]:
    entries = tomllib.loads(PLAN.read_text())["part"]
    parts = [Part(name, tuple(ROOT / file for file in entry["files"]), tuple(entry["tests"])) for name, entry in entries.items()]
    unknown = set(wanted) - {part.name for part in parts}
    if unknown:
        raise SystemExit(f"{PLAN.relative_to(ROOT)}: no part named {', '.join(sorted(unknown))}")
    return [part for part in parts if not wanted or part.name in wanted]


def explained() -> dict[tuple[str, str, str], str]:
    if not SURVIVORS.exists():
        return {}
    entries = tomllib.loads(SURVIVORS.read_text()).get("survivor", [])
    return {(entry["file"], entry["line"], entry["change"]): entry["reason"] for entry in entries}


def work_of(parts: list[Part], only: str | None, sample: int | None) -> list[tuple[Part, Path, str, Mutant]]:
    work = []
    for part in parts:
        for source in part.files:
            if only is None or only in source.name:
                text = source.read_text()
                work += [(part, source, text, mutant) for mutant in mutants(text)]
    if sample is not None and sample < len(work):
        work = random.Random(1).sample(work, sample)
    return work


def run(options: argparse.Namespace, parts: list[Part]) -> list[Result]:
    build = Build(options.build.resolve(), parts)
    for test in sorted({test for part in parts for test in part.tests}):
        if not passes(options.build / "tests/unit" / test, options.timeout_s):
            raise SystemExit(f"tools/mutate.py: {test} fails without a mutant")
    work = work_of(parts, options.only, options.sample)
    results: list[Result] = []
    began = time.monotonic()

    def one(item: tuple[Part, Path, str, Mutant]) -> Result:
        part, source, text, mutant = item
        verdict = judge(build, part, source, text, mutant, options.timeout_s)
        line_text = text.splitlines()[mutant.line - 1].strip()
        return Result(part.name, str(source.relative_to(ROOT)), mutant, line_text, verdict)

    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for done, result in enumerate(pool.map(one, work), 1):
            results.append(result)
            if sys.stderr.isatty() or done % 100 == 0:
                print(f"\r{done}/{len(work)} mutants, {time.monotonic() - began:.0f} s", end="", file=sys.stderr)
    print(file=sys.stderr)
    return results


def report(options: argparse.Namespace, parts: list[Part], results: list[Result]) -> int:
    reasons, good = explained(), True
    print("| part | mutants | killed | share | the same | unexplained |\n|---|---|---|---|---|---|")
    for part in parts:
        mine = [result for result in results if result.part == part.name and result.verdict != "invalid"]
        survivors = [result for result in mine if result.verdict == "survived"]
        known = sum(result.key in reasons for result in survivors)
        share = 1 - len(survivors) / len(mine) if mine else 1.0
        good = good and share >= options.least and known == len(survivors)
        print(f"| {part.name} | {len(mine)} | {len(mine) - len(survivors)} | {share:.1%} | {known} | {len(survivors) - known} |")
    for result in results:
        if result.verdict == "survived" and result.key not in reasons:
            print(f"{result.file}:{result.mutant.line}: {result.mutant.change}\n    {result.line_text}")
    if options.sample is None and options.only is None and not options.part:
        gone = set(reasons) - {result.key for result in results if result.verdict == "survived"}
        for file, line, change in sorted(gone):
            print(f"{SURVIVORS.relative_to(ROOT)}: no such survivor: {file}: {change}: {line}")
        good = good and not gone
    return 0 if good else 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", nargs="*", help="parts of tests/mutation/parts.toml (default all)")
    parser.add_argument("--build", type=Path, default=ROOT / "build/host-release", help="a configured build folder")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="mutants at a time (default: all cores)")
    parser.add_argument("--only", help="files whose name has this in it")
    parser.add_argument("--sample", type=int, help="so many mutants, drawn with a fixed seed, instead of all")
    parser.add_argument("--least", type=float, default=0.95, help="share that has to be killed (default 0.95)")
    parser.add_argument("--timeout-s", type=float, default=20.0, help="a test that takes longer has noticed (default 20)")
    options = parser.parse_args()
    parts = read_parts(options.part)
    return report(options, parts, run(options, parts))


if __name__ == "__main__":
    sys.exit(main())
