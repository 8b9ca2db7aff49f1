/* The last gate. It shares no code with the allocator on purpose: one mistake must not blind both. */
#include "taper/allocator.h"

#define LINES 3u
/** sqrt(3) - 1, rounded up [permille]. */
#define FACET_permille 733

/** 100 kA [0.1 mA]: beyond it squares do not fit 64 bits. No limit is taken to be as great. */
#define MOST_uA100 INT64_C(1000000000)

/** What flows into a group. */
typedef struct {
    int64_t power_mW;
    int64_t line_uA[LINES]; /* to neutral, or of three phases, or of a wiring that is not known: L1, L2, L3 */
    int64_t pair_uA[LINES]; /* between two lines: L1-L2, L2-L3, L3-L1 */
    int64_t idle_uA[LINES]; /* of these on each line: what setpoints do not put there */
    int64_t unsure_uA[LINES]; /* and what they may not put there */
} load_t;

static bool connector_passes(const taper_connector_config_t *connector, const taper_demand_t *demand,
                             int32_t current_mA) {
    if (current_mA <= 0) {
        return current_mA == 0;
    }
    return demand->active && current_mA <= connector->max_mA && current_mA <= demand->max_mA &&
           current_mA >= demand->min_mA && current_mA % TAPER_CURRENT_STEP_mA == 0;
}

static int64_t quotient_up(int64_t dividend, int64_t divisor) {
    return (dividend + divisor - 1) / divisor;
}

/** Lines of a connector by its description, bit 0 L1 .. bit 2 L3. */
static uint8_t lines_of(const taper_connector_config_t *connector) {
    static const uint8_t first[] = {1, 1, 2, 4, 1, 2, 4};     /* by taper_rotation_t: line of conductor L1 */
    static const uint8_t first_two[] = {3, 3, 6, 5, 5, 3, 6}; /* of L1 and L2 */
    const uint8_t rotation =
        connector->rotation < sizeof first ? connector->rotation : TAPER_ROTATION_UNKNOWN;
    if (connector->is_dc) {
        return 7;
    }
    if (connector->line_to_line) {
        return first_two[rotation];
    }
    return connector->phases == 1 ? first[rotation] : 7;
}

/** Power of 1 A in the supply: as booked, but no less than the vehicle draws, with a converter's losses. */
static int32_t W_per_A_of(const taper_connector_config_t *connector, const taper_demand_t *demand) {
    int32_t drawn_W_per_A = demand->W_per_A;
    if (connector->is_dc) {
        drawn_W_per_A = (int32_t)quotient_up((int64_t)drawn_W_per_A * 1000, connector->efficiency_permille);
    }
    return taper_max_i32(drawn_W_per_A, demand->booking.W_per_A);
}

/** How a connector draws, by the snapshot, or else by its description. */
static taper_booking_t booking_of(const taper_station_config_t *config, const taper_demand_t *demand,
                                  uint8_t i) {
    const taper_connector_config_t *connector = &config->connectors[i];
    taper_booking_t booking = demand->booking;
    if (demand->booking.phases != 0) {
        booking.W_per_A = W_per_A_of(connector, demand);
        return booking;
    }
    booking = (taper_booking_t){
        .W_per_A = W_per_A_of(connector, demand),
        .permille = 1000,
        .phases = lines_of(connector),
        .line_to_line = connector->line_to_line,
    };
    if (connector->is_dc) { /* all of its power, over three phases */
        const int64_t W_per_A =
            quotient_up(quotient_up(connector->voltage_mV, 1000) * 1000, connector->efficiency_permille);
        booking.permille = (int32_t)quotient_up(W_per_A * 1000000, INT64_C(3) * config->site_voltage_mV);
    }
    return booking;
}

/** Add a connector's current to the lines or to the pair that it flows in. */
static void add_current(load_t *load, const taper_booking_t *booking, int32_t current_mA) {
    const int64_t current_uA = (int64_t)current_mA * booking->permille;
    load->power_mW += (int64_t)current_mA * booking->W_per_A;
    for (unsigned line = 0; line < LINES && booking->unsure != 0; line++) {
        load->idle_uA[line] += (booking->idle >> line & 1u) != 0u ? current_uA : 0;
        load->unsure_uA[line] += (booking->unsure >> line & 1u) != 0u ? current_uA : 0;
    }
    for (unsigned line = 0; line < LINES; line++) {
        const unsigned pair = 1u << line | 1u << (line + 1) % LINES;
        if (booking->line_to_line && booking->phases == pair) {
            load->pair_uA[line] += current_uA;
            return;
        }
    }
    for (unsigned line = 0; line < LINES; line++) {
        load->line_uA[line] += (booking->phases >> line & 1u) != 0u ? current_uA : 0;
    }
}

static void add_load(load_t *sum, const load_t *load) {
    sum->power_mW += load->power_mW;
    for (unsigned line = 0; line < LINES; line++) {
        sum->line_uA[line] += load->line_uA[line];
        sum->pair_uA[line] += load->pair_uA[line];
        sum->idle_uA[line] += load->idle_uA[line];
        sum->unsure_uA[line] += load->unsure_uA[line];
    }
}

/** A current of a pair, rounded up [0.1 mA]. */
static int64_t pair_uA100(const load_t *load, unsigned pair) {
    const int64_t current = quotient_up(load->pair_uA[pair % LINES], 100);
    return current < MOST_uA100 ? current : MOST_uA100;
}

/** Whether a current with this square [(0.1 mA)^2] fits beside `other_uA` in a line. */
static bool fits(int64_t square, int64_t other_uA, int32_t limit_mA) {
    const int64_t left_uA = (int64_t)limit_mA * 1000 - other_uA;
    const int64_t left = left_uA / 100 < MOST_uA100 ? left_uA / 100 : MOST_uA100 - 1;
    return left_uA >= 0 && square <= left * left;
}

/** A line carries the currents x and y of two pairs, which differ by 60 degrees: |I|^2 = x^2 + x y + y^2. */
static bool line_passes(const load_t *load, unsigned line, int32_t limit_mA) {
    if (load->pair_uA[line] == 0 && load->pair_uA[(line + 2) % LINES] == 0) {
        return load->line_uA[line] <= (int64_t)limit_mA * 1000; /* no angles to mind */
    }
    const int64_t x = pair_uA100(load, line);
    const int64_t y = pair_uA100(load, line + 2);
    return fits(x * x + x * y + y * y, load->line_uA[line], limit_mA);
}

/** What two windings to neutral carry, 60 degrees apart: exact for one alone, and for three phases alike. */
static int64_t windings_uA(int64_t x_uA, int64_t y_uA) {
    const int64_t less_uA = x_uA < y_uA ? x_uA : y_uA;
    return x_uA + y_uA - less_uA + quotient_up(less_uA * FACET_permille, 1000);
}

/**
 * Line a of a delta side carries AB + BC - 2 CA: |I|^2 = (AB^2 - AB BC + BC^2) + 2 CA (AB + BC) + 4 CA^2, and the windings a
 * and c, that is what flows from the lines a and c to neutral.
 */
static bool delta_passes(const load_t *load, unsigned line, int32_t limit_mA) {
    const int64_t ab = pair_uA100(load, line);
    const int64_t bc = pair_uA100(load, line + 1);
    const int64_t ca = pair_uA100(load, line + 2);
    const int64_t square = ab * ab - ab * bc + bc * bc + 2 * ca * (ab + bc) + 4 * ca * ca;
    return fits(square, windings_uA(load->line_uA[line], load->line_uA[(line + 2) % LINES]), limit_mA);
}

/** Current on a line as it counts for imbalance: pairs count on both of their lines. */
static int64_t booked_uA(const load_t *load, unsigned line) {
    return load->line_uA[line] + load->pair_uA[line] + load->pair_uA[(line + 2) % LINES];
}

/** The most that setpoints put on a line, against the least on another one. */
static bool balance_passes(const load_t *load, int32_t limit_mA) {
    const int64_t limit_uA = (int64_t)limit_mA * 1000;
    for (unsigned pair = 0; pair < LINES * (LINES - 1); pair++) {
        const unsigned more = pair % LINES;
        const unsigned less = (more + 1 + pair / LINES) % LINES;
        const int64_t most_uA = booked_uA(load, more) - load->idle_uA[more];
        const int64_t least_uA = booked_uA(load, less) - load->unsure_uA[less];
        if (most_uA - least_uA > limit_uA) {
            return false;
        }
    }
    return true;
}

/** Whether a group's load is within its own limits; `phase_mA`: of now, on each line. */
static bool load_passes(const taper_group_config_t *group, const load_t *load, const int32_t *phase_mA) {
    for (unsigned line = 0; line < LINES; line++) {
        const int32_t limit_mA = taper_max_i32(taper_min_i32(group->limit_mA, phase_mA[line]), 0);
        if (group->limit_mA != 0 && !line_passes(load, line, limit_mA)) {
            return false;
        }
        if (group->delta_mA != 0 && !delta_passes(load, line, group->delta_mA)) {
            return false;
        }
    }
    return (group->limit_W == 0 || load->power_mW <= (int64_t)group->limit_W * 1000) &&
           (group->imbalance_mA == 0 || balance_passes(load, group->imbalance_mA));
}

bool taper_guard_passes(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                        const taper_supply_t *supply, const taper_setpoints_t *setpoints) {
    static const int32_t as_described[LINES] = {INT32_MAX, INT32_MAX, INT32_MAX};
    load_t load[TAPER_MAX_GROUPS] = {0};
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const int32_t current_mA = setpoints->current_mA[i];
        if (!connector_passes(&config->connectors[i], &snapshot->demand[i], current_mA)) {
            return false;
        }
        const taper_booking_t booking = booking_of(config, &snapshot->demand[i], i);
        add_current(&load[config->connectors[i].group], &booking, current_mA);
    }
    const int32_t groups = taper_min_i32(config->group_count, TAPER_MAX_GROUPS); /* config_check.h: it is */
    for (int32_t k = groups; k-- > 0;) { /* children stand behind their parents */
        if (!load_passes(&config->groups[k], &load[k], k == 0 ? supply->phase_mA : as_described)) {
            return false;
        }
        if (k > 0) {
            add_load(&load[config->groups[k].parent], &load[k]);
        }
    }
    return load[0].power_mW <= (int64_t)taper_max_i32(supply->site_W, 0) * 1000;
}
