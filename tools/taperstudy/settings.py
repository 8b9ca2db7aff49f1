"""The settings that sections share: the paper's six, and what they are made of."""

from .cases import Case, Setting
from .model import Results
from .recipes import AcnWeek, DrawnBatteries, EqualBatteries, Sessions, SiteLimit, SyntheticDay

# All that the study or a campaign can use, and steps of the horizon if they are not the station's own.
STATIONS = (("hub", None), ("garage", None), ("paper", None), ("depot", None), ("caltech", None), ("dc_hub", None),
            ("garage", 48), ("paper", 48))
SYNTHETIC_ALPHAS = (0.02, 0.03, 0.05)
WEEK_ALPHAS = (0.05, 0.08, 0.1)
WEEK = "acn-jpl-2019-10-06"
OTHER_WEEK = "acn-caltech-2019-07-14"
SYNTHETIC_KW = 56.0
WEEK_SHARE = 0.35  # of the weeks with drawn batteries, as in tools/results.py
CONTINUOUS = ("--min-current-a", "0")  # the paper knows no minimum current

# The paper says neither how large the batteries of its real week are nor what its limit is. They are drawn as everywhere in
# this project: sizes of cars on the road, of which each request is a part (tools/import_acn.py). alpha is told per kWh in the
# battery, and says little of batteries of many sizes: a full one has lost as much of its power as one of 18 kWh has by the
# paper's alpha. That is the largest that the steepest alpha lets become full: 7.2 kW are 1.8 kWh a step. With 18 kWh for all,
# the literal reading, sensitivity.py has the same three settings.
LITERAL_BATTERY_KWH = 18.0
KWH_PER_STEP = 1.8
# The limit is as scarce as on the synthetic day: at full power it serves the requests of an average working day in as many
# hours. There 779.5 kWh are requested, and 56 kW deliver them in 13.92 h.
HOURS_OF_REQUESTS = 13.92

EVENTS = ("--replan", "events")
PAPER_POLICIES = ("equal-share", "edf", "mpc-log", "soc-mpc-log")
LOG_POLICIES = ("mpc-log", "soc-mpc-log")
POLICIES = (*PAPER_POLICIES, "mpc", "edf-soc", "llf", "soc-mpc")


def synthetic(alpha: float) -> Setting:
    return Setting(f"synthetic day, alpha {alpha:g}", SyntheticDay(alpha), SiteLimit(kw=SYNTHETIC_KW), "paper")


def week_setting(name: str, sessions: Sessions, limit: SiteLimit = SiteLimit(share=WEEK_SHARE)) -> Setting:
    return Setting(name, sessions, limit, "garage", options=CONTINUOUS)


def short_name(week: str) -> str:
    """acn-jpl-2019-10-06: jpl 2019-10-06."""
    return week.removeprefix("acn-").replace("-", " ", 1)


def lost_share(alpha: float) -> float:
    """Of its power, that a full battery of the real week has lost."""
    return round(alpha * LITERAL_BATTERY_KWH / KWH_PER_STEP, 6)


def real_week(week: str, alpha: float, hours: float = HOURS_OF_REQUESTS) -> Setting:
    return week_setting(f"{short_name(week)}, alpha {alpha:g}", AcnWeek(week, DrawnBatteries(lost_share(alpha))),
                        SiteLimit(hours=hours))


def equal_week(week: str, alpha: float, kwh: float = LITERAL_BATTERY_KWH) -> Setting:
    """The same with batteries of one size."""
    return week_setting(f"{kwh:g} kWh each, alpha {alpha:g}", AcnWeek(week, EqualBatteries(kwh, alpha)),
                        SiteLimit(hours=HOURS_OF_REQUESTS))


def six_settings() -> list[Setting]:
    """The paper's: a synthetic day and a real week, each with three tapers."""
    return [*map(synthetic, SYNTHETIC_ALPHAS), *(real_week(WEEK, alpha) for alpha in WEEK_ALPHAS)]


def gain_percent(results: Results, setting: Setting, with_soc: str, blind: str, options: tuple[str, ...] = ()) -> float:
    """How much more energy the policy that knows the taper delivers."""
    energies = [results.energy_kwh(Case(setting, policy, options)) for policy in (with_soc, blind)]
    return 100 * (energies[0] / energies[1] - 1)


def log_gain_percent(results: Results, setting: Setting, options: tuple[str, ...] = ()) -> float:
    return gain_percent(results, setting, "soc-mpc-log", "mpc-log", options)


def mean(values: list[float]) -> float:
    return sum(values) / len(values)
