"""The headline numbers of docs/results.md, held against what the study found.

They are the table below the line MARK: name, value, tolerance, and the bound that must hold in any case, such as
`>= 99.5`, or nothing.
"""

import operator
import re
from dataclasses import dataclass, replace
from pathlib import Path

from taperlib.files import InputError, number_at, read_text, write_atomically

MARK = "<!-- headline numbers: tools/study holds them against what it finds -->"
BOUND = re.compile(r"(>=|<=)\s*(\S+)")
HOLDS = {">=": operator.ge, "<=": operator.le}
COLUMNS = 4
DECIMALS = 2


@dataclass(frozen=True)
class Headline:
    name: str
    value: float
    tolerance: float
    bound: str
    line: int

    @property
    def text(self) -> str:
        return f"| {self.name} | {self.value:.{DECIMALS}f} | {self.tolerance:g} | {self.bound} |"


def _headline(cells: list[str], path: Path, line: int) -> Headline:
    where = f"{path}, line {line}"
    if len(cells) != COLUMNS:
        raise InputError(f"{where}: a headline has {COLUMNS} cells: name, value, tolerance, bound")
    name, value, tolerance, bound = cells
    if bound and not BOUND.fullmatch(bound):
        raise InputError(f"{where}: the bound '{bound}' is neither '>= NUMBER' nor '<= NUMBER'")
    if bound:
        number_at(BOUND.fullmatch(bound).group(2), f"{where}, bound")
    return Headline(name, number_at(value, f"{where}, value"), number_at(tolerance, f"{where}, tolerance"), bound, line)


def read_headlines(path: Path) -> list[Headline]:
    lines = read_text(path).splitlines()
    if MARK not in lines:
        raise InputError(f"{path}: has no line '{MARK}'")
    first = lines.index(MARK) + 1
    headlines = []
    for number, text in enumerate(lines[first:], start=first + 1):
        if text.startswith("|"):
            headlines.append((number, [cell.strip() for cell in text.strip().strip("|").split("|")]))
        elif headlines:
            break
    if len(headlines) < 3:
        raise InputError(f"{path}, line {first}: no table of headlines follows it")
    return [_headline(cells, path, number) for number, cells in headlines[2:]]  # heading and its rule come first


def _broken(headline: Headline, found: float) -> str | None:
    if abs(found - headline.value) > headline.tolerance:
        return f"says {headline.value:g}, within {headline.tolerance:g}; the study found {found:.4f}"
    if headline.bound:
        sign, limit = BOUND.fullmatch(headline.bound).groups()
        if not HOLDS[sign](found, float(limit)):
            return f"must be {headline.bound}; the study found {found:.4f}"
    return None


def broken_headlines(path: Path, found: dict[str, float], whole: bool) -> list[str]:
    """In words, each that no longer holds. A whole study must also find all that the page states."""
    headlines = read_headlines(path)
    stated = {headline.name for headline in headlines}
    reasons = [f"{path}: does not state '{name}', which the study found to be {value:.4f}"
               for name, value in found.items() if name not in stated]
    for headline in headlines:
        where = f"{path}, line {headline.line}: '{headline.name}'"
        if headline.name in found:
            reason = _broken(headline, found[headline.name])
            reasons += [f"{where} {reason}"] if reason else []
        elif whole:
            reasons.append(f"{where} is nothing that the study finds")
    return reasons


def accept_headlines(path: Path, found: dict[str, float]) -> None:
    """Writes the values found in the place of those that the page states; bounds stay."""
    lines = read_text(path).splitlines()
    for headline in read_headlines(path):
        if headline.name in found:
            lines[headline.line - 1] = replace(headline, value=found[headline.name]).text
    write_atomically(path, "\n".join(lines) + "\n")
