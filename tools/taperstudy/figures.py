"""The plots of the study's report."""

from collections.abc import Iterable

import numpy as np
import plotly.graph_objects as go
from taperlib.charts import INK, colour_of, empty_figure
from taperlib.sessions import Session

from .cases import Case, Setting, case_of
from .model import Results

SECONDS_PER_HOUR = 3600.0


def energy_bars(results: Results, settings: Iterable[Setting], policies: Iterable[str]) -> go.Figure:
    """Delivered energy by setting, a bar per policy, and the bound as a line above them."""
    figure = empty_figure(430)
    settings = list(settings)
    names = [setting.name.replace(", ", "<br>") for setting in settings]
    for policy in policies:
        energies = [results.energy_kwh(Case(setting, policy)) for setting in settings]
        shares = [results.share_percent(Case(setting, policy)) for setting in settings]
        figure.add_trace(go.Bar(x=names, y=np.round(energies, 1), name=policy, marker={"color": colour_of(policy)},
                                customdata=np.round(shares, 2),
                                hovertemplate="%{y:.1f} kWh, %{customdata} % of the bound"))
    figure.add_trace(go.Scatter(
        x=names, y=[round(results.bound_kwh(setting), 1) for setting in settings], name="clairvoyant bound",
        mode="markers", marker={"symbol": "line-ew-open", "size": 60, "color": INK}, hovertemplate="%{y:.1f} kWh"))
    figure.update_layout(barmode="group", hovermode="x unified", legend_itemsizing="constant")
    figure.update_yaxes(title="Delivered energy [kWh]", rangemode="tozero")
    return figure


def shares(results: Results, settings: Iterable[Setting], methods: Iterable[str]) -> go.Figure:
    """Share of the bound, a row per setting and a mark per method."""
    settings = list(settings)
    figure = empty_figure(150 + 34 * len(settings))
    for method in methods:
        figure.add_trace(go.Scatter(
            x=[round(results.share_percent(case_of(setting, method)), 3) for setting in settings],
            y=[setting.name for setting in settings], mode="markers", name=method,
            marker={"size": 12, "color": colour_of(method), "opacity": 0.85}, hovertemplate="%{x:.2f} %"))
    figure.add_vline(x=100, line={"color": INK, "width": 1.5, "dash": "dash"})
    figure.update_xaxes(title="Share of the clairvoyant bound [%]")
    figure.update_yaxes(autorange="reversed", type="category")
    return figure


def stepwise_energy(results: Results, cases: Iterable[Case]) -> go.Figure:
    """Energy per step of each case, under what the limit P(t) allows."""
    figure = empty_figure(430)
    cases = list(cases)
    for index, case in enumerate(cases):
        steps = results.of(case).steps()
        hours = case.setting.tick_s / SECONDS_PER_HOUR
        time_h = steps.time_s / SECONDS_PER_HOUR
        if index == 0:
            figure.add_trace(go.Scatter(x=time_h, y=np.round(steps.limit_kw * hours, 3), name="P(t)", mode="lines",
                                        line={"color": INK, "width": 1.5, "dash": "dash", "shape": "hv"}))
        figure.add_trace(go.Scatter(x=time_h, y=np.round(steps.power_kw * hours, 3), name=case.policy, mode="lines",
                                    line={"color": colour_of(case.policy), "width": 1.8, "shape": "hv"}))
    figure.update_layout(hovermode="x unified")
    figure.update_xaxes(title="Time [h]")
    figure.update_yaxes(title="Delivered energy in the step [kWh]", rangemode="tozero")
    return figure


def final_states(results: Results, cases: Iterable[Case]) -> go.Figure:
    """Energy in every battery at departure, in the order of what was wanted."""
    figure = empty_figure(430)
    cases = list(cases)
    sessions = sorted(results.sessions(cases[0].setting), key=lambda session: session.soc_target * session.battery_kwh)
    number = np.arange(1, len(sessions) + 1)
    for case in cases:
        figure.add_trace(go.Scatter(x=number, y=final_kwh(results, case, sessions), name=case.policy, mode="markers",
                                    marker={"size": 6, "color": colour_of(case.policy)}, hovertemplate="%{y:.2f} kWh"))
    wanted = [round(session.soc_target * session.battery_kwh, 3) for session in sessions]
    figure.add_trace(go.Scatter(x=number, y=wanted, name="wanted", mode="lines", line={"color": INK, "width": 1.5}))
    figure.update_xaxes(title="Vehicle, by what it wanted")
    figure.update_yaxes(title="Energy in the battery at departure [kWh]", rangemode="tozero")
    return figure


def final_kwh(results: Results, case: Case, sessions: list[Session]) -> np.ndarray:
    """Energy in the batteries at departure; a vehicle that found no connector leaves as it came."""
    soc = results.of(case).soc_at_departure()
    return np.round([soc.get(session.session_id, session.soc_arrival) * session.battery_kwh for session in sessions], 3)


def lines(title_x: str, title_y: str, x: list[float], series: dict[str, list[float]], log_x: bool = False) -> go.Figure:
    figure = empty_figure(380)
    for name, values in series.items():
        figure.add_trace(go.Scatter(x=x, y=np.round(values, 3), name=name, mode="lines+markers",
                                    hovertemplate="%{y:.2f}"))
    figure.update_layout(hovermode="x unified")
    figure.update_xaxes(title=title_x, type="log" if log_x else "linear", tickvals=x)
    figure.update_yaxes(title=title_y)
    return figure
