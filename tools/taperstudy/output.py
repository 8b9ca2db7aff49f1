"""Writes what sections found: a CSV per table, all tables in tables.md, and report.html, which needs no network."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import jinja2
import plotly.graph_objects as go
import plotly.offline
from taperlib.files import write_atomically

from .model import Cell, Outcome, Section, Table

TEMPLATES = Path(__file__).resolve().parent / "templates"
PLOT_CONFIG = {"displaylogo": False, "responsive": True, "scrollZoom": True,
               "modeBarButtonsToRemove": ["select2d", "lasso2d", "autoScale2d"]}
LONGEST_TABLE = 60  # rows that people read; the CSV has all


@dataclass(frozen=True)
class Found:
    section: Section
    outcome: Outcome


def table_csv(table: Table) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows(["" if cell is None else cell for cell in row] for row in table.rows)
    return buffer.getvalue()


def cell_text(cell: Cell) -> str:
    return "–" if cell is None else f"{cell:,.2f}" if isinstance(cell, float) else str(cell)


def _markdown_table(table: Table) -> list[str]:
    lines = [f"{table.title} ([{table.name}.csv]({table.name}.csv)):", "", f"| {' | '.join(table.columns)} |",
             "|---" * len(table.columns) + "|"]
    return [*lines, *(f"| {' | '.join(map(cell_text, row))} |" for row in table.rows), ""]


def tables_markdown(found: list[Found]) -> str:
    lines = ["# Tables of the study", "", "Written by `tools/study`; [README.md](README.md) says how to read them.", ""]
    for each in found:
        lines += [f"## {each.section.title}", "", each.section.text, ""]
        for table in each.outcome.tables:
            lines += _markdown_table(table) if len(table.rows) <= LONGEST_TABLE else [
                f"{table.title}: [{table.name}.csv]({table.name}.csv), {len(table.rows)} rows.", ""]
    return "\n".join(lines).rstrip() + "\n"


def _chart_html(figure: go.Figure) -> str:
    return figure.to_html(full_html=False, include_plotlyjs=False, config=PLOT_CONFIG, default_width="100%")


def report_html(found: list[Found]) -> str:
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True,
                                     undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("study.html.j2").render(
        found=found, cell_text=cell_text, chart_html=_chart_html, longest=LONGEST_TABLE,
        plotly_js=plotly.offline.get_plotlyjs())


def write_study(found: list[Found], folder: Path, whole: bool) -> None:
    """Renders all first, so that an error leaves no file behind. tables.md only of a whole study."""
    texts = {f"{table.name}.csv": table_csv(table) for each in found for table in each.outcome.tables}
    texts["report.html"] = report_html(found)
    if whole:
        texts["tables.md"] = tables_markdown(found)
    for name, text in texts.items():
        write_atomically(folder / name, text)
