"""The settings that sections share: the paper's six, and what they are made of."""

from .cases import Case, Setting
from .model import Results
from .recipes import AcnWeek, EqualBatteries, Sessions, SiteLimit, SyntheticDay

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

# The paper says neither how large the batteries of its real week are nor what its limit is. The data asks for 24.7 kWh per
# session on average, so batteries are as large as they can be: with 7.2 kW, or 1.8 kWh a step, and the steepest taper of
# 0.1, a battery of 18 kWh takes nothing more when it is full, and a larger one would never be.
WEEK_BATTERY_KWH = 18.0
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


def real_week(week: str, alpha: float, kwh: float = WEEK_BATTERY_KWH, hours: float = HOURS_OF_REQUESTS) -> Setting:
    return week_setting(f"{short_name(week)}, alpha {alpha:g}", AcnWeek(week, EqualBatteries(kwh, alpha)),
                        SiteLimit(hours=hours))


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
