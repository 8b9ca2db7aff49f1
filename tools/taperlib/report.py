"""Writes a comparison as table.csv, comparison.json and a report.html that needs no network."""

import csv
import io
import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import jinja2
import plotly.graph_objects as go
import plotly.offline

from . import charts
from .files import write_atomically
from .measures import Measures
from .sessions import Session, requested_kwh
from .simulator import Run

TEMPLATE_FOLDER = Path(__file__).resolve().parent / "templates"
PLOT_CONFIG = {"displaylogo": False, "responsive": True, "scrollZoom": False,
               "modeBarButtonsToRemove": ["select2d", "lasso2d", "autoScale2d"]}
ZOOMABLE = ("site_power", "missing_soc")


@dataclass(frozen=True)
class Comparison:
    title: str
    station: str
    sessions_file: str
    limit_text: str
    price_text: str | None
    tick_s: float
    bound_kwh: float
    bound_solve_s: float
    sessions: list[Session]
    runs: list[Run]
    table: list[Measures]
    problems: list[str]


def cell_text(row: Measures, name: str) -> str:
    """A value of the table as people read it; an absent one is a dash."""
    value = getattr(row, name)
    decimals = {"energy_kwh": 1, "share_of_bound_percent": 2, "unserved_kwh": 1, "jain_fairness": 4, "peak_kw": 2,
                "iterations_p50": 0, "iterations_max": 0, "solve_ms_p50": 3, "solve_ms_max": 3,
                "cost": 2, "cost_per_kwh": 4}
    if value is None:
        return "–"
    if name == "satisfied":
        return f"{value} / {row.sessions}"
    return f"{value:,.{decimals.get(name, 0)}f}" if isinstance(value, (int, float)) else value


Heading = tuple[str, str, str]  # field of Measures, its heading in the tables, and its unit
COST_HEADINGS: tuple[Heading, ...] = (("cost", "Cost", ""), ("cost_per_kwh", "Cost", "per kWh"))
HEADINGS: tuple[Heading, ...] = (
    ("policy", "Policy", ""), ("energy_kwh", "Energy", "kWh"), ("share_of_bound_percent", "Of bound", "%"),
    ("satisfied", "Satisfied", ""), ("unserved_kwh", "Unserved", "kWh"), ("jain_fairness", "Jain", ""),
    ("peak_kw", "Peak", "kW"), ("violations", "Violations", ""), ("fallback_ticks", "Fallback", "ticks"),
    ("solves", "Solves", ""), ("iterations_p50", "Iter.", "p50"), ("iterations_max", "Iter.", "max"),
    ("solve_ms_p50", "Solve", "ms p50"), ("solve_ms_max", "Solve", "ms max"),
)


def headings_of(table: list[Measures]) -> tuple[Heading, ...]:
    """The columns of people's tables: costs only where energy had a price."""
    return HEADINGS + (COST_HEADINGS if any(row.cost is not None for row in table) else ())


def table_csv(table: list[Measures]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(field.name for field in fields(Measures))
    for row in table:
        writer.writerow("" if value is None else value for value in asdict(row).values())
    return buffer.getvalue()


def comparison_json(comparison: Comparison) -> str:
    case = {
        "title": comparison.title,
        "station": comparison.station,
        "sessions_file": comparison.sessions_file,
        "sessions": len(comparison.sessions),
        "requested_kwh": requested_kwh(comparison.sessions),
        "limit": comparison.limit_text,
        "price": comparison.price_text,
        "tick_s": comparison.tick_s,
        "bound_kwh": comparison.bound_kwh,
        "bound_solve_s": comparison.bound_solve_s,
        "problems": comparison.problems,
        "policies": [asdict(row) for row in comparison.table],
    }
    return json.dumps(case, indent=2, ensure_ascii=False) + "\n"


def _chart_html(figure: go.Figure, zoomable: bool) -> str:
    config = PLOT_CONFIG | {"displayModeBar": zoomable}
    return figure.to_html(full_html=False, include_plotlyjs=False, config=config, default_width="100%")


def report_html(comparison: Comparison) -> str:
    solving = [run for run in comparison.runs if run.solves > 0]
    figures = {
        "site_power": charts.site_power(comparison.runs),
        "share_of_bound": charts.share_of_bound(comparison.table),
        "satisfied": charts.satisfied(comparison.table),
        "missing_soc": charts.missing_soc(comparison.sessions, comparison.runs),
        "arrivals": charts.arrivals_per_hour(comparison.sessions),
    }
    if solving:
        figures["iterations"] = charts.iterations(solving)
        figures["solve_times"] = charts.solve_times(solving)
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATE_FOLDER), autoescape=True, undefined=jinja2.StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )
    return environment.get_template("report.html.j2").render(
        comparison=comparison,
        requested_kwh=requested_kwh(comparison.sessions),
        headings=headings_of(comparison.table),
        cell_text=cell_text,
        colour_of=charts.colour_of,
        best_share=max(row.share_of_bound_percent for row in comparison.table),
        charts={name: _chart_html(figure, name in ZOOMABLE) for name, figure in figures.items()},
        plotly_js=plotly.offline.get_plotlyjs(),
    )


def write_comparison(comparison: Comparison, folder: Path) -> None:
    """Renders all first, so that an error leaves no file behind."""
    texts = {
        "table.csv": table_csv(comparison.table),
        "comparison.json": comparison_json(comparison),
        "report.html": report_html(comparison),
    }
    for name, text in texts.items():
        write_atomically(folder / name, text)
