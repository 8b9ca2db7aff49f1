"""What the paper leaves open, varied: lambda, horizon, number of outer iterations, batteries, week."""

from dataclasses import replace

from . import figures
from .cases import Case, Setting, bound_of
from .model import Figure, Outcome, Results, Section, Table, cases_of, policy_table
from .recipes import Inputs
from .settings import (
    HOURS_OF_REQUESTS, LITERAL_BATTERY_KWH, LOG_POLICIES, SYNTHETIC_ALPHAS, WEEK, WEEK_ALPHAS, equal_week,
    gain_percent, log_gain_percent, mean, real_week, short_name, six_settings, synthetic,
)

LAMBDAS = (1, 10, 100, 1000)
CHOSEN_LAMBDA = 100  # the firmware's own
HORIZONS = (12, 24, 48)
CHOSEN_HORIZON = 24  # of the stations
OUTER_ITERATIONS = tuple(range(1, 9))
OTHER_BATTERIES_KWH = (12.0, 24.0)
HOURS = (6.0, 10.0, 12.0, HOURS_OF_REQUESTS, 18.0)
PAIRS = (*LOG_POLICIES, "mpc", "soc-mpc")


def _with_lambda(setting: Setting, policy: str, weight: int) -> Case:
    return Case(setting, policy, () if weight == CHOSEN_LAMBDA else ("--lambda", str(weight)))


def _gain_rows(settings: list[Setting], gains: list[list[float]]) -> list[tuple]:
    rows = [(setting.name, *(round(gain, 2) for gain in row)) for setting, row in zip(settings, gains)]
    return [*rows, ("average", *(round(mean(list(column)), 2) for column in zip(*gains)))]


def _lambda_outcome(results: Results) -> Outcome:
    settings = six_settings()
    gains = [[log_gain_percent(results, setting, _with_lambda(setting, "", weight).options) for weight in LAMBDAS]
             for setting in settings]
    shares = [[results.share_percent(_with_lambda(setting, "soc-mpc-log", weight)) for weight in LAMBDAS]
              for setting in settings]
    columns = ("setting", *(f"lambda_{weight}" for weight in LAMBDAS))
    tables = [Table("lambda-gain", "Gain of soc-mpc-log over mpc-log by lambda [%]", columns, _gain_rows(settings, gains)),
              Table("lambda-share", "soc-mpc-log, share of the bound by lambda [%]", columns, _gain_rows(settings, shares))]
    named = dict(zip((setting.name for setting in settings), gains))
    plot = figures.lines("lambda [1/kWh2]", "Gain of soc-mpc-log over mpc-log [%]", list(LAMBDAS), named, log_x=True)
    return Outcome(tables, [Figure("Gain by lambda", "", plot)])


def lambdas() -> Section:
    return Section(
        "lambda", "How it depends on lambda",
        "lambda weighs the squared energy that is missing at the end of the horizon against the sum of the logarithms. The "
        "paper does not state it.",
        tuple(_with_lambda(setting, policy, weight) for setting in six_settings() for weight in LAMBDAS
              for policy in LOG_POLICIES) + tuple(map(bound_of, six_settings())), _lambda_outcome)


def _with_horizon(setting: Setting, policy: str, steps: int) -> Case:
    """A shorter horizon is an option, a longer one needs a solver of its own."""
    if steps > CHOSEN_HORIZON:
        return Case(replace(setting, horizon=steps), policy)
    return Case(setting, policy, () if steps == CHOSEN_HORIZON else ("--horizon-steps", str(steps)))


def _horizon_gain(results: Results, setting: Setting, pair: tuple[str, str], steps: int) -> float:
    with_soc, blind = (results.energy_kwh(_with_horizon(setting, policy, steps)) for policy in pair)
    return 100 * (with_soc / blind - 1)


def _horizon_outcome(results: Results) -> Outcome:
    settings = six_settings()
    gains = [[_horizon_gain(results, setting, ("soc-mpc-log", "mpc-log"), steps) for steps in HORIZONS]
             for setting in settings]
    columns = ("setting", *(f"horizon_{steps}" for steps in HORIZONS))
    tables = [Table("horizon-gain", "Gain of soc-mpc-log over mpc-log by horizon [%]", columns,
                    _gain_rows(settings, gains))]
    for policy in ("soc-mpc-log", "soc-mpc"):
        shares = [[100 * results.energy_kwh(_with_horizon(setting, policy, steps)) / results.bound_kwh(setting)
                   for steps in HORIZONS] for setting in settings]
        tables.append(Table(f"horizon-share-{policy}", f"{policy}, share of the bound by horizon [%]", columns,
                            _gain_rows(settings, shares)))
    named = dict(zip((setting.name for setting in settings), gains))
    plot = figures.lines("Horizon [steps of 15 min]", "Gain of soc-mpc-log over mpc-log [%]", list(HORIZONS), named)
    return Outcome(tables, [Figure("Gain by horizon", "", plot)])


def horizons() -> Section:
    return Section(
        "horizon", "How it depends on the horizon",
        "12, 24 and 48 steps of 15 minutes. The paper does not state it.",
        tuple(_with_horizon(setting, policy, steps) for setting in six_settings() for steps in HORIZONS
              for policy in (*LOG_POLICIES, "soc-mpc")) + tuple(map(bound_of, six_settings())), _horizon_outcome)


def _outer_settings() -> list[Setting]:
    return [synthetic(SYNTHETIC_ALPHAS[-1]), real_week(WEEK, WEEK_ALPHAS[-1])]


def _outer_case(setting: Setting, policy: str, count: int) -> Case:
    return Case(setting, policy, ("--outer-iterations", str(count)))


def _outer_outcome(results: Results) -> Outcome:
    settings = _outer_settings()
    shares = {setting.name: [results.share_percent(_outer_case(setting, "soc-mpc-log", count))
                             for count in OUTER_ITERATIONS] for setting in settings}
    rows = [(count, *(round(share[index], 3) for share in shares.values()))
            for index, count in enumerate(OUTER_ITERATIONS)]
    table = Table("outer-iterations", "soc-mpc-log, share of the bound by outer iterations [%]",
                  ("outer_iterations", *shares), rows)
    plot = figures.lines("Outer iterations", "Share of the bound [%]", list(OUTER_ITERATIONS), shares)
    return Outcome([table], [Figure("Share of the bound by outer iterations", "", plot)])


def outer_iterations() -> Section:
    settings = _outer_settings()
    return Section(
        "outer-iterations", "How it depends on the number of outer iterations",
        "The log utility is maximised by so many quadratic programmes per plan. What is shown is the closed loop; how near a "
        "single plan comes to the exact one is told by tools/reference.py.",
        tuple(_outer_case(setting, "soc-mpc-log", count) for setting in settings for count in OUTER_ITERATIONS)
        + tuple(map(bound_of, settings)), _outer_outcome)


def _literal_settings() -> list[Setting]:
    return [equal_week(WEEK, alpha) for alpha in WEEK_ALPHAS]


def _battery_settings() -> list[Setting]:
    """All tapers for drawn batteries and for those of 18 kWh; for others the middle one's share of power lost."""
    middle = WEEK_ALPHAS[1] * LITERAL_BATTERY_KWH
    others = [equal_week(WEEK, round(middle / kwh, 6), kwh) for kwh in OTHER_BATTERIES_KWH]
    drawn = [replace(real_week(WEEK, alpha), name=f"drawn, as for alpha {alpha:g}") for alpha in WEEK_ALPHAS]
    return [*drawn, *_literal_settings(), *others]


def _pairs_table(results: Results, name: str, title: str, settings: list[Setting]) -> Table:
    rows = [(setting.name, round(log_gain_percent(results, setting), 2),
             round(gain_percent(results, setting, "soc-mpc", "mpc"), 2),
             *(round(results.share_percent(Case(setting, policy)), 2) for policy in PAIRS)) for setting in settings]
    return Table(name, title, ("setting", "gain_log_utility", "gain_throughput",
                               *(f"share_{policy}" for policy in PAIRS)), rows)


def _battery_outcome(results: Results) -> Outcome:
    settings = _battery_settings()
    title = "Gains of knowing the taper, and shares of the bound, by battery [%]"
    cases = [Case(setting, policy) for setting in settings for policy in PAIRS]
    literal = [*map(synthetic, SYNTHETIC_ALPHAS), *_literal_settings()]
    headlines = {"the same, with 18 kWh for all on the real week [%]":
                 mean([log_gain_percent(results, setting) for setting in literal])}
    return Outcome([_pairs_table(results, "batteries", title, settings),
                    policy_table(results, "batteries-runs", "All runs", cases)],
                   [Figure("Share of the bound by battery", "", figures.shares(results, settings, PAIRS))], headlines)


def batteries() -> Section:
    return Section(
        "batteries", "How it depends on the batteries of the real week",
        "ACN-Data has no battery sizes. The six settings draw them, from 24 to 100 kWh, as tools/import_acn.py does. Here also one "
        "size for all: 18 kWh with the paper's alpha to the letter, and others that have lost the same share of their power "
        "when full as those of 18 kWh at the middle alpha. The limit serves what is requested on a working day in the same "
        "hours as ever.",
        (*cases_of(_battery_settings(), PAIRS), *cases_of([*map(synthetic, SYNTHETIC_ALPHAS)], LOG_POLICIES)),
        _battery_outcome)


def _limit_settings() -> list[Setting]:
    return [replace(real_week(WEEK, WEEK_ALPHAS[1], hours=hours), name=f"{hours:g} h") for hours in HOURS]


def _limit_outcome(results: Results) -> Outcome:
    settings = _limit_settings()
    title = "Gains of knowing the taper, and shares of the bound, by the hours that the limit needs for the requests [%]"
    return Outcome([_pairs_table(results, "limit", title, settings)],
                   [Figure("Share of the bound by limit", "", figures.shares(results, settings, PAIRS))])


def limits() -> Section:
    return Section(
        "limit", "How it depends on the limit of the real week",
        "The middle taper, with limits that serve what is requested on an average working day in 6 to 18 hours at full power.",
        tuple(cases_of(_limit_settings(), PAIRS)), _limit_outcome)


def weeks(inputs: Inputs) -> Section:
    settings = [real_week(week, alpha) for week in inputs.weeks() for alpha in WEEK_ALPHAS]

    def outcome(results: Results) -> Outcome:
        title = "Gains of knowing the taper, and shares of the bound, by week [%]"
        return Outcome([_pairs_table(results, "weeks", title, settings)],
                       [Figure("Share of the bound by week", "", figures.shares(results, settings, PAIRS))])

    names = ", ".join(map(short_name, inputs.weeks()))
    return Section("weeks", "How it depends on the week", f"The weeks at hand: {names}.",
                   tuple(cases_of(settings, PAIRS)), outcome)
