"""Whether a connector can ever be used: its least and its fallback current alone must fit the limits above it.

The same in C, for tables of any origin: firmware/app/src/config_check.c.
"""

from station_model import MAX_SUPPLY_permille, Connector, Group, Station, way_to


def reason_against(station: Station, connector: Connector) -> tuple[str, str] | None:
    """The key that is wrong and why, or None."""
    share = _supply_permille(station, connector)
    if share > MAX_SUPPLY_permille:
        return "efficiency", f"1 A would take more than {MAX_SUPPLY_permille // 1000} A of the supply"
    for k in way_to(station.groups, connector.group):
        reason = _reason_in(station.groups[k], connector, share)
        if reason is not None:
            return "min_A", f'{connector.min_mA / 1000:g} A {reason} of "{station.groups[k].name}"'
    fallback_W = _power_W(connector, connector.fallback_mA)
    if fallback_W > station.failsafe_W:
        failsafe_kW = f"{station.failsafe_W / 1000:.10g}"
        return "fallback_A", f"{fallback_W / 1000:.10g} kW, above the site's failsafe_kW of {failsafe_kW}"
    return None


def _power_W(connector: Connector, current_mA: int) -> int:
    return -(-connector.W_per_A * current_mA // 1000)


def _supply_permille(station: Station, connector: Connector) -> int:
    """Current on each supply phase in use for 1 A of setpoint, as in taper_booking_nominal."""
    if connector.kind == "AC":
        return 1000
    return -(-connector.W_per_A * 1_000_000 // (3 * station.site_voltage_mV))


def _reason_in(group: Group, connector: Connector, share: int) -> str | None:
    least_W = _power_W(connector, connector.min_mA)
    if 0 < group.limit_W < least_W:
        return f"need {least_W / 1000:.10g} kW, above limit_kW"
    least_mA = -(-connector.min_mA * share // 1000)
    if 0 < group.limit_mA < least_mA:
        return f"need {least_mA / 1000:.10g} A of a phase, above limit_A"
    one_phase = connector.kind == "AC" and connector.phases == 1
    if 0 < group.delta_mA < -(-least_mA * _delta_permille(connector) // 1000):
        return "are too much for delta_side_A"
    if one_phase and 0 < group.imbalance_mA < least_mA:
        return "on one phase are above imbalance_A"
    return None


def _delta_permille(connector: Connector) -> int:
    """What rows.c counts for 1 A on the line of the delta side that it loads most."""
    if connector.line_to_line:
        return 2000  # in the line that both its windings share
    return 1000 if connector.kind == "AC" and connector.phases == 1 else 1733  # sqrt(3), rounded up
