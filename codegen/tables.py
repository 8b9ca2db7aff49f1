"""Writes a station's description as C tables, and the sizes that the firmware's arrays have."""

from rows import planned_rows
from station import Connector, Group, Station
from station_model import Planning


def sizes_header(stations: list[Station], real: str) -> str:
    """include/taper/sizes.h: the greatest of each over the stations of this image."""
    return f"""\
/**
 * Sizes of this image: the greatest that any of its stations needs. Generated, see codegen/.
 * Stations: {", ".join(station.name for station in stations)}.
 */
#ifndef TAPER_SIZES_H
#define TAPER_SIZES_H

#define TAPER_MAX_CONNECTORS {max(len(station.connectors) for station in stations)}
#define TAPER_MAX_STEPS {max(station.steps for station in stations)}
#define TAPER_MAX_GROUPS {max(len(station.groups) for station in stations)}
/** Rows of a station's limits that the planner has (taper_row_is_planned), in every step. */
#define TAPER_MAX_PLAN_ROWS {max(len(planned_rows(station)) for station in stations)}
/** Lines of a vehicle's taper that a station plans with. */
#define TAPER_MAX_TAPER_LINES {max(station.planning.taper_lines for station in stations)}

/** Floating-point type of battery, horizon and planner: 1 double, 0 float. */
#define TAPER_REAL_IS_DOUBLE {int(real == "double")}

#endif
"""


def stations_header(stations: list[Station]) -> str:
    """include/taper/stations.h."""
    declared = "\n".join(
        f"/** {station.description}. */\nextern const taper_station_config_t taper_station_{station.name};"
        for station in stations
    )
    return f"""\
/** The stations that this image knows. Generated, see codegen/. */
#ifndef TAPER_STATIONS_H
#define TAPER_STATIONS_H

#include "taper/types.h"

{declared}

/** All of them, in the order above. */
extern const taper_station_config_t *const taper_stations[];
extern const unsigned taper_station_count;

#endif
"""


def stations_source(stations: list[Station]) -> str:
    """stations.c."""
    tables = "\n".join(_station(station) for station in stations)
    entries = "".join(f"    &taper_station_{station.name},\n" for station in stations)
    return f"""\
/* Generated, see codegen/. */
#include "taper/stations.h"

{tables}
const taper_station_config_t *const taper_stations[] = {{
{entries}}};

const unsigned taper_station_count = {len(stations)};
"""


def _station(station: Station) -> str:
    name = station.name
    groups = "".join(f"    {_group(group)}\n" for group in station.groups)
    connectors = "".join(f"    {_connector(connector)}\n" for connector in station.connectors)
    return f"""\
static const taper_group_config_t {name}_groups[] = {{
{groups}}};

static const taper_connector_config_t {name}_connectors[] = {{
{connectors}}};

const taper_station_config_t taper_station_{name} = {{
    .name = "{name}",
    .connectors = {name}_connectors,
    .groups = {name}_groups,
    .failsafe_W = {station.failsafe_W},
    .other_load_W = {station.other_load_W},
    .other_load_mA = {station.other_load_mA},
    .site_voltage_mV = {station.site_voltage_mV},
    .tick_ms = {station.tick_ms},
    .min_on_ms = {station.min_on_ms},
    .min_off_ms = {station.min_off_ms},
    .turn_ms = {station.turn_ms},
    .change_ms = {station.change_ms},
    .ramp_mA_per_s = {station.ramp_mA_per_s},
    .deadband_mA = {station.deadband_mA},
    .price_weight_permille = {station.price_weight_permille},
    .planning = {_planning(station.planning)},
    .line_to_line = {_bool(station.line_to_line)},
    .step_s = {station.step_s},
    .steps = {station.steps},
    .connector_count = {len(station.connectors)},
    .group_count = {len(station.groups)},
}};
"""


def _planning(planning: Planning) -> str:
    fields = {
        "objective": f"TAPER_OBJECTIVE_{planning.objective.upper().replace('-', '_')}",
        "horizon_steps": planning.horizon_steps,
        "outer_iterations": planning.outer_iterations,
        "taper_lines": planning.taper_lines,
        "on_events": _bool(planning.on_events),
        "learns_taper": _bool(planning.learns_taper),
        "lambda_milli_per_kWh2": planning.lambda_milli_per_kWh2,
    }
    return _initializer(fields)[:-1]


def _group(group: Group) -> str:
    limits = {
        "limit_W": group.limit_W,
        "limit_mA": group.limit_mA,
        "delta_mA": group.delta_mA,
        "imbalance_mA": group.imbalance_mA,
        "parent": "TAPER_NO_GROUP" if group.parent is None else group.parent,
    }
    return f"{_initializer(limits)} /* {group.name} */"


def _connector(connector: Connector) -> str:
    return _initializer(
        {
            "min_mA": connector.min_mA,
            "max_mA": connector.max_mA,
            "fallback_mA": connector.fallback_mA,
            "voltage_mV": connector.voltage_mV,
            "reaction_ms": connector.reaction_ms,
            "efficiency_permille": connector.efficiency_permille,
            "phases": connector.phases,
            "rotation": f"TAPER_ROTATION_{connector.rotation}",
            "line_to_line": _bool(connector.line_to_line),
            "group": connector.group,
            "bus": connector.bus,
            "node": connector.node,
            "is_dc": _bool(connector.kind == "DC"),
        }
    )


def _initializer(fields: dict[str, int | str]) -> str:
    return "{" + ", ".join(f".{name} = {value}" for name, value in fields.items()) + "},"


def _bool(value: bool) -> str:
    return "true" if value else "false"
