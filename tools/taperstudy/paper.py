"""The experiments and figures of Chen and Zhang, and the same settings with the variants that do better."""

import numpy as np
from taperlib.charts import arrivals_per_hour

from . import figures
from .cases import Case, Setting
from .model import Cell, Figure, Outcome, Results, Section, Table, cases_of, policy_table, share_table
from .settings import (
    EVENTS, LOG_POLICIES, POLICIES, SYNTHETIC_ALPHAS, WEEK, WEEK_ALPHAS, gain_percent, log_gain_percent,
    mean, real_week, six_settings, synthetic,
)

PAPER_GAIN_PERCENT = 10.27
SHOWN = (synthetic(SYNTHETIC_ALPHAS[-1]), real_week(WEEK, WEEK_ALPHAS[-1]))  # in the figures: the steepest tapers
SECONDS_PER_HOUR = 3600.0


def _event_cases() -> list[Case]:
    return [Case(setting, policy, EVENTS) for setting in six_settings() for policy in LOG_POLICIES]


def _gain_table(results: Results) -> Table:
    rows: list[tuple[Cell, ...]] = []
    columns = []
    for setting in six_settings():
        gains = [log_gain_percent(results, setting), log_gain_percent(results, setting, EVENTS),
                 gain_percent(results, setting, "soc-mpc", "mpc")]
        columns.append(gains)
        rows.append((setting.name, *(round(gain, 2) for gain in gains)))
    rows.append(("average", *(round(float(gain), 2) for gain in np.mean(columns, axis=0))))
    title = f"Gain of knowing the taper in delivered energy [%]; the paper reports {PAPER_GAIN_PERCENT} on average"
    return Table("gain", title, ("setting", "log_utility", "log_utility_at_events_only", "throughput"), rows)


def most_below_percent(results: Results, settings: list[Setting]) -> float:
    """How far soc-mpc is below the best other policy where that is farthest; negative: above all everywhere."""
    def below(setting: Setting) -> float:
        best = max(results.energy_kwh(Case(setting, policy)) for policy in POLICIES if policy != "soc-mpc")
        return 100 * (1 - results.energy_kwh(Case(setting, "soc-mpc")) / best)
    return max(map(below, settings))


def _experiments(results: Results) -> Outcome:
    settings = six_settings()
    cases = [Case(setting, policy) for setting in settings for policy in POLICIES] + _event_cases()
    tables = [
        _gain_table(results),
        share_table(results, "shares", "Share of the clairvoyant bound [%]", settings, POLICIES),
        policy_table(results, "experiments", "All runs", cases),
    ]
    headlines = {
        "gain of soc-mpc-log over mpc-log, average of the six [%]":
            mean([log_gain_percent(results, setting) for setting in settings]),
        "the same, solved at events only [%]":
            mean([log_gain_percent(results, setting, EVENTS) for setting in settings]),
        "soc-mpc, least share of the bound in the six [%]":
            min(results.share_percent(Case(setting, "soc-mpc")) for setting in settings),
        "soc-mpc, most below another policy in the six [%]": most_below_percent(results, settings),
        "limit violations in all of these runs": sum(results.measures(case)["violations"] for case in cases),
    }
    plots = [Figure("Share of the clairvoyant bound", "The dashed line is what perfect foresight delivers.",
                    figures.shares(results, settings, POLICIES))]
    return Outcome(tables, plots, headlines)


def experiments() -> Section:
    return Section(
        "paper", "The paper's experiments",
        "Six settings: the paper's synthetic day and a real week of ACN-Data, each with three tapers. mpc-log and "
        "soc-mpc-log are the paper's MPC and SOC_MPC, with lambda 100 and a horizon of 24 steps; edf and equal-share are "
        "the paper's baselines. The others are not in the paper. At events only: solved when a vehicle comes, leaves or reaches its "
        "target, as in the paper, instead of in every step.",
        (*cases_of(six_settings(), POLICIES), *_event_cases()), _experiments)


def _arrivals_table(results: Results) -> Table:
    columns = ("hour", *(setting.name for setting in SHOWN))
    counts = [np.bincount((np.array([session.arrival_s for session in results.sessions(setting)]) // SECONDS_PER_HOUR
                           % 24).astype(int), minlength=24) for setting in SHOWN]
    return Table("arrivals", "Arrivals per hour of the day", columns,
                 [(hour, *(int(count[hour]) for count in counts)) for hour in range(24)])


def _stepwise_table(results: Results, setting: Setting, name: str) -> Table:
    hours = setting.tick_s / SECONDS_PER_HOUR
    blind, with_soc = (results.of(Case(setting, policy)).steps() for policy in LOG_POLICIES)
    rows: list[tuple[Cell, ...]] = [
        (round(time_s / SECONDS_PER_HOUR, 2), *(round(float(kw) * hours, 3) for kw in powers))
        for time_s, *powers in zip(blind.time_s, blind.limit_kw, blind.power_kw, with_soc.power_kw)
    ]
    return Table(name, f"Energy of every step [kWh]: {setting.name}", ("time_h", "limit", *LOG_POLICIES), rows)


def _final_table(results: Results, setting: Setting, name: str) -> Table:
    sessions = results.sessions(setting)
    states = [figures.final_kwh(results, Case(setting, policy), sessions) for policy in LOG_POLICIES]
    rows: list[tuple[Cell, ...]] = [
        (session.session_id, round(session.soc_target * session.battery_kwh, 3), *(float(kwh) for kwh in kwhs))
        for session, *kwhs in zip(sessions, *states)
    ]
    return Table(name, f"Energy in the batteries at departure [kWh]: {setting.name}",
                 ("session_id", "wanted", *LOG_POLICIES), rows)


def _figures(results: Results) -> Outcome:
    six = six_settings()
    plots = [Figure(f"Delivered energy of the methods: {place}", "The black lines are the clairvoyant bound.",
                    figures.energy_bars(results, settings, POLICIES))
             for place, settings in (("synthetic day", six[:3]), ("real week", six[3:]))]
    tables = [_arrivals_table(results)]
    for setting, kind in zip(SHOWN, ("synthetic", "week")):
        pair = [Case(setting, policy) for policy in LOG_POLICIES]
        plots += [
            Figure(f"Arrivals per hour: {setting.name}", "", arrivals_per_hour(results.sessions(setting))),
            Figure(f"Energy of every step: {setting.name}", "P(t) is what the limit allows in a step.",
                   figures.stepwise_energy(results, pair)),
            Figure(f"Final battery states: {setting.name}", "A vehicle's two marks are above each other.",
                   figures.final_states(results, pair)),
        ]
        tables += [_stepwise_table(results, setting, f"stepwise-{kind}"), _final_table(results, setting, f"final-{kind}")]
    return Outcome(tables, plots)


def paper_figures() -> Section:
    pairs = [Case(setting, policy) for setting in SHOWN for policy in LOG_POLICIES]
    return Section(
        "figures", "The paper's figures",
        "Arrivals per hour, delivered energy of the methods, energy of every step of mpc-log against soc-mpc-log with P(t), "
        "and the final states of the batteries of both; the last three at the steepest taper.",
        (*cases_of(six_settings(), POLICIES), *pairs), _figures)
