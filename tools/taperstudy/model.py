"""What a section of the study is: cases, and what is made of their results."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import plotly.graph_objects as go
from taperlib.sessions import Session

from .cases import Case, Setting, bound_of, case_of
from .recipes import Inputs
from .store import Result

Cell = str | int | float | None


@dataclass(frozen=True)
class Table:
    """Becomes NAME.csv, and a table of the report."""

    name: str
    title: str
    columns: tuple[str, ...]
    rows: list[tuple[Cell, ...]]


@dataclass(frozen=True)
class Figure:
    title: str
    text: str
    figure: go.Figure


@dataclass(frozen=True)
class Outcome:
    """`headlines`: the numbers that docs/results.md states, by their name there."""

    tables: list[Table]
    figures: list[Figure] = field(default_factory=list)
    headlines: dict[str, float] = field(default_factory=dict)


class Results:
    """The results of a section's cases."""

    def __init__(self, inputs: Inputs, by_case: dict[Case, Result]) -> None:
        self._inputs = inputs
        self._by_case = by_case
        self._measures: dict[Case, dict] = {}

    def of(self, case: Case) -> Result:
        return self._by_case[case]

    def measures(self, case: Case) -> dict:
        if case not in self._measures:
            self._measures[case] = self._by_case[case].measures
        return self._measures[case]

    def energy_kwh(self, case: Case) -> float:
        return self.measures(case)["energy_kwh"]

    def bound_kwh(self, setting: Setting) -> float:
        return self.energy_kwh(bound_of(setting))

    def share_percent(self, case: Case) -> float:
        """Of the clairvoyant bound."""
        return 100 * self.energy_kwh(case) / self.bound_kwh(case.setting)

    def sessions(self, setting: Setting) -> list[Session]:
        return self._inputs.sessions(setting.sessions)


@dataclass(frozen=True)
class Section:
    name: str
    title: str
    text: str
    cases: tuple[Case, ...]
    outcome: Callable[[Results], Outcome]


def cases_of(settings: Iterable[Setting], methods: Iterable[str]) -> list[Case]:
    """Every method in every setting, and the bounds."""
    methods = tuple(methods)
    return [case for setting in settings
            for case in (bound_of(setting), *(case_of(setting, method) for method in methods))]


POLICY_COLUMNS = ("setting", "policy", "energy_kwh", "bound_kwh", "share_of_bound_percent", "satisfied", "sessions",
                  "jain_fairness", "violations", "fallback_ticks", "solves", "iterations_p50", "iterations_max")


def policy_row(results: Results, case: Case) -> tuple[Cell, ...]:
    measures = results.measures(case)
    counts = tuple(measures[name] for name in ("violations", "fallback_ticks", "solves", "iterations_p50", "iterations_max"))
    policy = " ".join([case.policy, *case.options])
    return (case.setting.name, policy, round(measures["energy_kwh"], 2), round(results.bound_kwh(case.setting), 2),
            round(results.share_percent(case), 3), measures["satisfied"], measures["sessions"],
            round(measures["jain_fairness"], 4), *counts)


def policy_table(results: Results, name: str, title: str, cases: Iterable[Case]) -> Table:
    return Table(name, title, POLICY_COLUMNS, [policy_row(results, case) for case in cases])


def share_table(results: Results, name: str, title: str, settings: Iterable[Setting], methods: Iterable[str]) -> Table:
    """A line per setting: the share of the bound by method [%], and the method that loses least."""
    methods = tuple(methods)
    rows: list[tuple[Cell, ...]] = []
    for setting in settings:
        shares = {method: results.share_percent(case_of(setting, method)) for method in methods}
        best = max(shares, key=shares.__getitem__)
        rows.append((setting.name, *(round(share, 2) for share in shares.values()), best, round(100 - shares[best], 2)))
    return Table(name, title, ("setting", *methods, "loses_least", "its_loss_percent"), rows)
