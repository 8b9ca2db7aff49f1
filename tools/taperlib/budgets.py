"""The budgets of the boards' images: a committed table of figures, their limits and why; checked, written, shown.

A figure may have two limits. `limit` is a little above what was measured last, so that growth is noticed: who means it raises
the limit by hand, and says why. `bound` is what the board has, or what was promised: it is not raised.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "tools/budgets.toml"
DOCS = ROOT / "docs/budgets.md"
MARGIN = 1.05
SMALL = 25
BEGIN, END = "<!-- begin: tools/budgets --write -->", "<!-- end -->"


class BadTable(Exception):
    """The table contradicts itself, or is not complete."""


@dataclass(frozen=True)
class Budget:
    """One figure of one image."""

    image: str
    figure: str
    measured: int
    limit: int
    why: str
    bound: int | None = None
    bound_why: str = ""
    note: str = ""

    def complaint(self, measured: int) -> str | None:
        """What is wrong with a figure, and what to do; None: nothing."""
        text = f"{self.image}: {self.figure} is {measured:,}, above "
        if self.bound is not None and measured > self.bound:
            return f"{text}its bound of {self.bound:,} ({self.bound_why}). {advice(self.image, self.figure)}."
        if measured > self.limit:
            return (f"{text}its limit of {self.limit:,} ({self.why}); it was {self.measured:,}. "
                    f"{advice(self.image, self.figure)}; or raise the limit in tools/budgets.toml, and say why.")
        return None


def limit_for(measured: int) -> int:
    """With a margin that small changes fit into."""
    return max(math.ceil(measured * MARGIN), measured + SMALL)


def advice(image: str, figure: str) -> str:
    if figure.startswith(("flash", "ram")):
        return f"`tools/budgets --map {image}` shows what takes the space"
    if figure.startswith("stack"):
        return "The deepest chain stands above: make its largest frames smaller"
    return "tests/board and callgrind (tools/budgets --host) show where the instructions go"


class Table:
    """tools/budgets.toml."""

    def __init__(self, text: str) -> None:
        self.text = text
        content = tomllib.loads(text)
        self.figures: dict[str, str] = content.pop("figures")
        self.history: dict[str, dict[str, str]] = content.pop("history", {})
        self.budgets = {image: dict(self._read(image, figures)) for image, figures in content.items()}

    @classmethod
    def read(cls, path: Path = TABLE) -> Table:
        return cls(path.read_text())

    def _read(self, image: str, figures: dict[str, dict]) -> Iterator[tuple[str, Budget]]:
        for figure, entry in figures.items():
            if figure not in self.figures:
                raise BadTable(f"{image}.{figure}: [figures] does not say what it is")
            budget = Budget(image, figure, **entry)
            if budget.bound is not None and budget.limit > budget.bound:
                raise BadTable(f"{image}.{figure}: the limit {budget.limit:,} is above the bound {budget.bound:,}")
            yield figure, budget

    def check(self, image: str, measured: dict[str, int]) -> list[str]:
        """Complaints about the figures of an image; also about those that the table does not have."""
        budgets = self.budgets.get(image, {})
        complaints = [f"{image}: {figure} is {value:,}, and has no entry in tools/budgets.toml; add one, with a limit"
                      for figure, value in measured.items() if figure not in budgets]
        found = (budgets[figure].complaint(value) for figure, value in measured.items() if figure in budgets)
        return complaints + [complaint for complaint in found if complaint]

    def with_measured(self, image: str, measured: dict[str, int], notes: dict[str, str]) -> Table:
        """The same with other measured values and notes. Limits are never raised, and lowered where there is much room."""
        text = self.text
        for figure, value in measured.items():
            text = _set_line(text, f"{image}.{figure}", "measured", str(value))
            budget = self.budgets.get(image, {}).get(figure)
            if budget and limit_for(value) < budget.limit / MARGIN:
                text = _set_line(text, f"{image}.{figure}", "limit", str(limit_for(value)))
        for figure, note in notes.items():
            text = _set_line(text, f"{image}.{figure}", "note", f'"{note}"')
        return Table(text)

    def docs(self) -> str:
        """The tables for docs/budgets.md."""
        return "\n".join([*self._figure_lines(), "", *self._note_lines(), "", *self._history_lines()])

    def _figure_lines(self) -> Iterator[str]:
        images = list(self.budgets)
        yield "| figure | " + " | ".join(f"`{image}`" for image in images) + " |"
        yield "|---" * (len(images) + 1) + "|"
        for figure, meaning in self.figures.items():
            if any(figure in self.budgets[image] for image in images):
                cells = [_cell(self.budgets[image].get(figure)) for image in images]
                yield f"| {meaning} | " + " | ".join(cells) + " |"

    def _note_lines(self) -> Iterator[str]:
        for image, budgets in self.budgets.items():
            for budget in budgets.values():
                if budget.note:
                    yield f"- `{image}`, {self.figures[budget.figure]}: {budget.note}"

    def _history_lines(self) -> Iterator[str]:
        for title, rows in self.history.items():
            yield f"**{title}**\n"
            columns = list(dict.fromkeys(column for row in rows.values() for column in row))
            yield "| | " + " | ".join(columns) + " |"
            yield "|---" * (len(columns) + 1) + "|"
            for name, row in rows.items():
                yield f"| {name} | " + " | ".join(_thousands(row.get(column, "")) for column in columns) + " |"


def _thousands(value: int | str) -> str:
    return f"{value:,}" if isinstance(value, int) else value


def _cell(budget: Budget | None) -> str:
    if budget is None:
        return ""
    bound = f", bound {budget.bound:,}" if budget.bound is not None else ""
    return f"**{budget.measured:,}** (limit {budget.limit:,}{bound})"


def _set_line(text: str, section: str, key: str, value: str) -> str:
    """`key = value` in a section of the file; everything else stays as it was written."""
    head = re.search(rf"^\[{re.escape(section)}\]\n", text, re.MULTILINE)
    if not head:
        return text
    end = text.find("\n[", head.end())
    end = len(text) if end < 0 else end
    body = text[head.end():end]
    line = f"{key} = {value}"
    found = re.search(rf"^{key} = .*$", body, re.MULTILINE)
    body = body[:found.start()] + line + body[found.end():] if found else f"{line}\n{body}"
    return text[:head.end()] + body + text[end:]


def page(old: str, table: Table) -> str:
    """docs/budgets.md with the tables between its marks renewed."""
    before, found, rest = old.partition(BEGIN)
    _, closed, after = rest.partition(END)
    if not found or not closed:
        raise BadTable(f"docs/budgets.md: {BEGIN} and {END} are not there")
    return f"{before}{BEGIN}\n{table.docs()}\n{END}{after}"
