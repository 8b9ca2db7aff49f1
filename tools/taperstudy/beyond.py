"""What is beyond the paper. Each section asks how much of the bound is lost, and which policy loses least."""

from dataclasses import dataclass, replace

from . import figures
from .cases import Setting, case_of
from .model import Figure, Outcome, Results, Section, cases_of, policy_table, share_table
from .recipes import AcnWeek, DailyDrop, DcDay, DrawnBatteries, SiteLimit
from .settings import OTHER_WEEK, POLICIES, SYNTHETIC_ALPHAS, WEEK, WEEK_SHARE, short_name, synthetic, week_setting

MINIMUM_A = ("--min-current-a", "6")
WEEK_DROP = DailyDrop(12, 15, 0.25)
SYNTHETIC_DROP = DailyDrop(12, 16, 0.25)
SYNTHETIC_DROP_KW = 80.0
DC_KW = 300.0  # for 12 connectors of 150 kW
DC_SEED = 1
DC_TICK_S = 60.0
NOISE = ("--meter-noise", "0.02")
WRONG_TAPER = ("--taper-error", "0.5")
LEARNING = ("soc-mpc-learned", "soc-mpc --learn-taper")


@dataclass(frozen=True)
class Topic:
    """A section that is settings times methods, and nothing else."""

    name: str
    title: str
    text: str
    settings: tuple[Setting, ...]
    methods: tuple[str, ...] = POLICIES

    def section(self) -> Section:
        return Section(self.name, self.title, self.text, tuple(cases_of(self.settings, self.methods)), self.outcome)

    def outcome(self, results: Results) -> Outcome:
        cases = [case_of(setting, method) for setting in self.settings for method in self.methods]
        title = "Share of the clairvoyant bound [%], and who loses least"
        tables = [share_table(results, self.name, title, self.settings, self.methods),
                  policy_table(results, f"{self.name}-runs", "All runs", cases)]
        plot = figures.shares(results, self.settings, self.methods)
        return Outcome(tables, [Figure("Share of the clairvoyant bound", "", plot)])


def _day() -> Setting:
    """The synthetic day with the steepest taper."""
    return synthetic(SYNTHETIC_ALPHAS[-1])


def _week(week: str, **changes: object) -> Setting:
    """A real week with drawn batteries, in steps."""
    return replace(week_setting(short_name(week), AcnWeek(week, DrawnBatteries())), **changes)


def _varied(setting: Setting, name: str, options: tuple[str, ...] = ()) -> Setting:
    return replace(setting, name=f"{setting.name}, {name}", options=(*setting.options, *options))


def curves() -> Topic:
    def day(pieces: int, fit: str) -> Setting:
        told = {1: "the peak alone", 2: "one line", 3: "two lines"}[pieces]
        name = f"told: {told}" if pieces == 1 else f"told: {told}, {fit}"
        return Setting(name, DcDay(DC_SEED, pieces, fit), SiteLimit(kw=DC_KW), "dc_hub", DC_TICK_S)

    return Topic(
        "curves", "Real charge curves",
        f"A day at a hub of 12 DC connectors with {DC_KW:g} kW: each vehicle obeys the curve of one of 113 real vehicles, "
        "and tells its peak power and up to two lines that fall. `mean` errs to both sides of the curve, `above` never holds a "
        "vehicle back. The bound knows the curves' concave hulls, which no curve is above: a part of what is lost against "
        "it is what no policy could deliver.",
        tuple(day(pieces, fit) for pieces, fit in ((1, "mean"), (2, "mean"), (3, "mean"), (2, "above"), (3, "above"))))


def _lost_percent(results: Results, setting: Setting) -> float:
    """What learning on line delivers less than knowing the taper."""
    known, learned = (results.energy_kwh(case_of(setting, method)) for method in ("soc-mpc", "soc-mpc-learned"))
    return 100 * (1 - learned / known)


@dataclass(frozen=True)
class LearningTopic(Topic):
    """With a headline: what learning costs where the taper that is told is right."""

    def outcome(self, results: Results) -> Outcome:
        told_right = [setting for setting in self.settings if "--taper-error" not in setting.options]
        days = [setting for setting in told_right if setting.name.startswith("synthetic")]
        week = [setting for setting in told_right if setting not in days]
        noisy = [setting for setting in days if NOISE[0] in setting.options]
        exact = [setting for setting in days if setting not in noisy]
        headlines = {
            f"soc-mpc-learned, most lost against knowing the taper, {name} [%]": max(
                _lost_percent(results, setting) for setting in settings)
            for name, settings in (("real week", week), ("synthetic day", exact), ("the same with wrong meters", noisy))
        }
        return replace(super().outcome(results), headlines=headlines)


def learned() -> Topic:
    errors = (("exact", ()), ("meters wrong by 2 %", NOISE), ("taper told wrong by up to 50 %", WRONG_TAPER))
    minutes = replace(_day(), name=f"{_day().name}, ticks of 60 s", tick_s=60.0)
    settings = [_varied(base, name, options) for base in (_day(), minutes, _week(WEEK)) for name, options in errors]
    return LearningTopic(
        "learned", "The taper learned on line",
        "soc-mpc-learned is told no taper, and learns it from what vehicles accept. soc-mpc --learn-taper takes what is "
        "told as a first guess. Meters with noise; tapers told wrong, by a factor between 0.5 and 1.5 that is drawn for "
        "each vehicle. The paper's day has one look at a vehicle in 15 minutes; a station has one each second, and ticks of "
        "60 s are nearer to that.",
        tuple(settings), ("mpc", "edf-soc", "llf", "soc-mpc", *LEARNING))


def departures() -> Topic:
    def week(week: str, driver: bool) -> Setting:
        setting = _week(week, sessions=AcnWeek(week, DrawnBatteries(), driver_departure=driver))
        return _varied(setting, "what drivers say" if driver else "real departures")

    return Topic(
        "departures", "Departures that drivers misjudge",
        "Drivers of ACN-Data said when they would leave, and stayed longer in about two thirds of the sessions. The station "
        "knows only what they said; the bound knows when they left.",
        tuple(week(name, driver) for name in (WEEK, OTHER_WEEK) for driver in (False, True)))


def soc() -> Topic:
    errors = (("exact", ()), ("SOC wrong by up to 10 %", ("--soc-error", "0.1")), ("no SOC", ("--soc", "absent")))
    return Topic(
        "soc", "A state of charge that is absent or wrong",
        "Each vehicle's SOC is off by a constant, drawn within 10 percentage points, or is never told; the energy that it "
        "wants is right. mpc, edf and equal-share do without in any case.",
        tuple(_varied(base, name, options) for base in (_day(), _week(WEEK)) for name, options in errors))


def minimum_current() -> Topic:
    week = _week(WEEK)
    to_the_second = AcnWeek(WEEK, DrawnBatteries(), step_s=None)
    return Topic(
        "minimum-current", "A minimum current of 6 A",
        "IEC 61851-1 knows no AC current between 0 and 6 A: not all that are there can charge at once, and the rest take "
        "turns. The bound knows no minimum. Ticks of 60 s besides steps of 15 min, with times to the second.",
        (_varied(_day(), "any current"), _varied(_day(), "6 A", MINIMUM_A), _varied(week, "any current"),
         _varied(replace(week, options=()), "6 A", MINIMUM_A),
         _varied(replace(week, options=(), sessions=to_the_second, tick_s=60.0), "6 A, ticks of 60 s", MINIMUM_A)))


def drop() -> Topic:
    day = replace(synthetic(SYNTHETIC_ALPHAS[0]), limit=SiteLimit(kw=SYNTHETIC_DROP_KW, drop=SYNTHETIC_DROP))
    week = _week(WEEK, limit=SiteLimit(share=WEEK_SHARE, drop=WEEK_DROP))
    return Topic(
        "drop", "A limit that drops",
        f"To a quarter, for three hours of each day of the week and for four of the synthetic day, whose limit is "
        f"{SYNTHETIC_DROP_KW:g} kW: told ahead, or by nobody before it is there.",
        tuple(_varied(base, name, options) for base in (day, week)
              for name, options in (("told ahead", ()), ("told by nobody", ("--limit-unannounced",)))))


def topics() -> list[Topic]:
    return [curves(), learned(), departures(), soc(), minimum_current(), drop()]
