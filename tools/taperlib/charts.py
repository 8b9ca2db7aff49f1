"""The charts of the report. Colours belong to a policy and are the same in every chart."""

from collections.abc import Callable

import numpy as np
import plotly.graph_objects as go

from .measures import Measures, missing_soc_percent
from .sessions import Session
from .simulator import Run

# Okabe and Ito's palette, which colour-blind readers can tell apart; a planner and its baselines stay far apart.
COLOURS = {
    "soc-mpc": "#0072B2",
    "soc-mpc-log": "#1B4F72",
    "soc-mpc-learned": "#882255",
    "mpc": "#56B4E9",
    "mpc-log": "#7FB3D5",
    "edf": "#E69F00",
    "edf-soc": "#D55E00",
    "llf": "#009E73",
    "equal-share": "#CC79A7",
}
OTHER_COLOUR = "#777777"
INK = "#24292f"
GRID = "#e6e8eb"
POINTS_PER_TRACE = 4000
FIRST_DAY = np.datetime64("2001-01-01T00:00:00", "ms")  # any first of January: %j then counts the days from 1


def colour_of(policy: str) -> str:
    return COLOURS.get(policy, OTHER_COLOUR)


def downsampled_rows(value: np.ndarray, most: int = POINTS_PER_TRACE) -> np.ndarray:
    """Indices of at most `most` rows: of equal pieces the row of the smallest and of the largest value, in order."""
    if value.size <= most:
        return np.arange(value.size)
    pieces = np.array_split(np.arange(value.size), most // 2)
    lowest = [piece[np.argmin(value[piece])] for piece in pieces]
    highest = [piece[np.argmax(value[piece])] for piece in pieces]
    return np.unique(np.array(lowest + highest))


def _changes(value: np.ndarray) -> np.ndarray:
    """The rows at which a step function changes, and the last row."""
    changed = np.concatenate([[True], np.diff(value) != 0])
    changed[-1] = True
    return np.flatnonzero(changed)


def _times(time_s: np.ndarray) -> np.ndarray:
    return FIRST_DAY + np.round(time_s * 1000).astype("timedelta64[ms]")


def empty_figure(height: int) -> go.Figure:
    figure = go.Figure()
    font = {"family": "system-ui, -apple-system, Segoe UI, Helvetica, Arial, sans-serif", "size": 13, "color": INK}
    figure.update_layout(
        template="none", height=height, font=font, margin={"l": 70, "r": 24, "t": 16, "b": 56},
        paper_bgcolor="white", plot_bgcolor="white", hoverlabel={"font": font},
        legend={"orientation": "h", "yanchor": "bottom", "y": 1.02, "x": 0},
    )
    figure.update_xaxes(gridcolor=GRID, zeroline=False, linecolor="#c3c8ce", ticks="outside", tickcolor="#c3c8ce")
    figure.update_yaxes(gridcolor=GRID, zeroline=False, automargin=True)
    return figure


def site_power(runs: list[Run]) -> go.Figure:
    figure = empty_figure(430)
    rows = _changes(runs[0].limit_kw)
    figure.add_trace(go.Scatter(
        x=_times(runs[0].time_s[rows]), y=runs[0].limit_kw[rows], name="limit", mode="lines",
        line={"color": INK, "width": 1.5, "dash": "dash", "shape": "hv"}, hovertemplate="%{y:.1f} kW",
    ))
    for index, run in enumerate(runs):
        rows = downsampled_rows(run.power_kw)
        figure.add_trace(go.Scatter(
            x=_times(run.time_s[rows]), y=np.round(run.power_kw[rows], 3), name=run.policy, mode="lines",
            line={"color": colour_of(run.policy), "width": 1.4, "shape": "hv"}, hovertemplate="%{y:.1f} kW",
            visible=True if index < 2 else "legendonly",
        ))
    stops = [{"dtickrange": [None, 80_000_000], "value": "%H:%M\nday %-j"},
             {"dtickrange": [80_000_000, None], "value": "day %-j"}]
    figure.update_xaxes(type="date", tickformatstops=stops, hoverformat="day %-j, %H:%M", title="Time")
    highest_kw = max([runs[0].limit_kw.max(), *(run.power_kw.max() for run in runs)])
    figure.update_yaxes(title="Site power [kW]", range=[0, 1.06 * highest_kw])
    figure.update_layout(hovermode="x unified")
    return figure


def share_of_bound(table: list[Measures]) -> go.Figure:
    figure = empty_figure(90 + 36 * len(table))
    for row in table:
        figure.add_trace(go.Scatter(
            x=[row.share_of_bound_percent], y=[row.policy], mode="markers+text", showlegend=False,
            marker={"size": 14, "color": colour_of(row.policy)}, text=[f"  {row.share_of_bound_percent:.2f} %"],
            textposition="middle right", hovertemplate=f"{row.energy_kwh:.1f} kWh<extra>{row.policy}</extra>",
        ))
    shares = [row.share_of_bound_percent for row in table]
    spread = max(100 - min(shares), max(shares) - 100, 0.5)
    figure.add_vline(x=100, line={"color": INK, "width": 1.5, "dash": "dash"})
    figure.update_xaxes(title="Share of the clairvoyant bound [%]",
                        range=[min(min(shares), 100) - 0.08 * spread, max(max(shares), 100) + 0.25 * spread])
    figure.update_yaxes(autorange="reversed", type="category")
    return figure


def satisfied(table: list[Measures]) -> go.Figure:
    figure = empty_figure(90 + 36 * len(table))
    figure.add_trace(go.Bar(
        x=[row.satisfied for row in table], y=[row.policy for row in table], orientation="h", width=0.6,
        marker={"color": [colour_of(row.policy) for row in table]},
        text=[f"{row.satisfied} of {row.sessions}" for row in table], textposition="auto",
        hovertemplate="%{x} sessions<extra>%{y}</extra>", showlegend=False,
    ))
    figure.update_xaxes(title="Sessions that left with their target SOC", rangemode="tozero")
    figure.update_yaxes(autorange="reversed", type="category")
    return figure


def missing_soc(sessions: list[Session], runs: list[Run]) -> go.Figure:
    figure = empty_figure(380)
    for run in runs:
        missing = np.sort(missing_soc_percent(sessions, run))
        share_percent = 100 * np.arange(1, missing.size + 1) / missing.size
        figure.add_trace(go.Scatter(
            x=np.round(missing, 2), y=np.round(share_percent, 2), name=run.policy, mode="lines",
            line={"color": colour_of(run.policy), "width": 1.8, "shape": "hv"},
            hovertemplate="%{y:.1f} % of the sessions miss at most %{x:.1f} points",
        ))
    figure.update_xaxes(title="SOC missing at departure: target minus reached [percentage points]", rangemode="tozero")
    figure.update_yaxes(title="Share of the sessions [%]", range=[0, 101])
    return figure


def arrivals_per_hour(sessions: list[Session]) -> go.Figure:
    figure = empty_figure(300)
    hour_of_day = (np.array([session.arrival_s for session in sessions]) // 3600 % 24).astype(int)
    figure.add_trace(go.Bar(
        x=np.arange(24) + 0.5, y=np.bincount(hour_of_day, minlength=24), width=0.9, marker={"color": "#8c959f"},
        customdata=[f"{hour:02d}:00 to {hour + 1:02d}:00" for hour in range(24)],
        hovertemplate="%{y} arrivals<extra>%{customdata}</extra>", showlegend=False,
    ))
    figure.update_xaxes(title="Hour of the day (all days together)", tickvals=list(range(0, 25, 3)), range=[0, 24])
    figure.update_yaxes(title="Arrivals", rangemode="tozero")
    return figure


def _spread_bars(runs: list[Run], title: str, spread_of: Callable) -> go.Figure:
    figure = empty_figure(300)
    for run in runs:
        spread = spread_of(run)
        values = [spread.p50, spread.p99, spread.max]
        figure.add_trace(go.Bar(
            x=["median", "99th percentile", "maximum"], y=values, name=run.policy,
            marker={"color": colour_of(run.policy)}, texttemplate="%{y:.3~g}", textposition="outside",
            cliponaxis=False, hovertemplate="%{x}: %{y:.4~g}",
        ))
    figure.update_layout(showlegend=True, barmode="group", bargap=0.35)
    figure.update_yaxes(title=title, rangemode="tozero")
    return figure


def iterations(runs: list[Run]) -> go.Figure:
    return _spread_bars(runs, "Iterations per solve", lambda run: run.iterations)


def solve_times(runs: list[Run]) -> go.Figure:
    return _spread_bars(runs, "Time per solve [ms]", lambda run: run.solve_ms)
