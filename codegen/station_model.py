"""What a station is, to everything that is generated for it.

Units are the firmware's: integers in mA, mV, W, ms and permille. A limit, ramp, deadband or weight of 0 is none.
"""

from dataclasses import dataclass

# Bounds of the firmware's types (taper/types.h), of its boot-time check (config_check.c) and of the bus (bus.toml).
MAX_CONNECTORS = 240  # four buses of 60; a connector index is one byte
MAX_GROUPS = 254  # a group index is one byte; 255 says "no parent"
MAX_STEPS = 255  # one byte
NODES_PER_BUS = 60  # TAPER_NODES_PER_BUS
MAX_CURRENT_dA = 4094  # EVSE_STATUS.current_l1: 12 bits of 0.1 A, 0xFFF says "absent"
MIN_AC_CURRENT_dA = 60  # IEC 61851-1: a duty cycle of 10 % says 6 A, there is nothing below
MAX_LIMIT_W = 3_276_700  # SITE_LIMIT.limit: 15 bits of 100 W
MAX_LIMIT_mA = 10_000_000  # on a phase: more than MAX_LIMIT_W at any mains voltage
MAX_DELTA_mA = 20_000_000  # balanced load counts sqrt(3) times on a delta side
MAX_VOLTAGE_mV = 1_500_000  # low voltage ends at 1500 V DC
MAX_DELTA_SIDE_mV = 36_000_000  # distribution transformers
MAX_SUPPLY_permille = 100_000  # current on a supply phase for 1 A of setpoint
MIN_SITE_VOLTAGE_mV = 50_000  # phase to neutral: half of the least in use (Japan)
MAINS_mV = 230_000  # phase to neutral, IEC 60038
MAX_SWITCH_s = 86_400
MAX_CHANGE_s = 600
MAX_TICK_ms = 60_000
MAX_REACTION_ms = 60_000

MAX_OUTER_ITERATIONS = 20
MAX_TAPER_LINES = 2  # EV_PARAM_B with D, and E
MAX_LAMBDA_per_kWh2 = 10_000

OBJECTIVES = ("throughput", "log-utility")  # taper_objective_t
REPLANS = ("steps", "events")  # once a step and at every event, or at events only

# Supply phases of a connector's conductors L1, L2, L3, or of its first one or two: taper_rotation_t by name.
ROTATIONS = ("123", "231", "312", "132", "213", "321")
STRAIGHT = "123"


@dataclass(frozen=True)
class Group:
    """A node of the feeder tree. `parent` is an index into the station's groups, None for the site."""

    name: str
    limit_W: int
    parent: int | None
    limit_mA: int = 0  # on each phase
    delta_mA: int = 0  # on each line of the delta side of its transformer, times the ratio of windings
    imbalance_mA: int = 0  # between the sums of two phases

    @property
    def limits_phases(self) -> bool:
        """It matters which phase a connector draws from."""
        return self.limit_mA > 0 or self.delta_mA > 0 or self.imbalance_mA > 0


@dataclass(frozen=True)
class Connector:
    kind: str  # "AC" or "DC"
    phases: int
    voltage_mV: int  # phase to neutral on AC, or line to line
    min_mA: int
    max_mA: int
    group: int
    bus: int
    node: int
    fallback_mA: int = 0
    reaction_ms: int = 0
    efficiency_permille: int = 1000
    rotation: str = STRAIGHT  # of ROTATIONS
    line_to_line: bool = False

    @property
    def W_per_A(self) -> int:
        """Power of 1 A of setpoint, rounded up as in the firmware (taper_booking_nominal)."""
        volts = -(-self.voltage_mV // 1000)
        return -(-volts * self.phases * 1000 // self.efficiency_permille)


@dataclass(frozen=True)
class Planning:
    """How the planner plans (taper_planning_t)."""

    objective: str = "throughput"  # of OBJECTIVES
    horizon_steps: int = 0  # 0: all
    outer_iterations: int = 0  # of the log utility; 0: the firmware's default
    on_events: bool = False
    learns_taper: bool = False
    lambda_milli_per_kWh2: int = 0
    taper_lines: int = 1


@dataclass(frozen=True)
class Station:
    """The site is group 0, and a parent stands before its children."""

    name: str
    description: str
    steps: int
    step_s: int
    tick_ms: int
    min_on_ms: int
    min_off_ms: int
    failsafe_W: int
    other_load_W: int
    site_voltage_mV: int
    groups: tuple[Group, ...]
    connectors: tuple[Connector, ...]
    other_load_mA: int = 0  # the most of it on one phase
    turn_ms: int = 0
    change_ms: int = 0
    ramp_mA_per_s: int = 0
    deadband_mA: int = 0
    price_weight_permille: int = 0
    planning: Planning = Planning()

    @property
    def line_to_line(self) -> bool:
        """Some connector is."""
        return any(connector.line_to_line for connector in self.connectors)

    def groups_of(self, connector: int) -> list[int]:
        """The groups that `connector` draws through, ascending: the site first, its own last."""
        return way_to(self.groups, self.connectors[connector].group)

    def connectors_below(self, group: int) -> list[int]:
        """The connectors of `group` and of all groups below it."""
        return [i for i in range(len(self.connectors)) if group in self.groups_of(i)]


def way_to(groups: tuple[Group, ...], group: int | None) -> list[int]:
    """The groups from the site down to `group`."""
    way: list[int] = []
    while group is not None:
        way.append(group)
        group = groups[group].parent
    return way[::-1]
