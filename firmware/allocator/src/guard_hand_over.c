/*
 * The last gate of the hand-over and of the fallback currents. It shares no code with rooms, grants and rows on purpose: one
 * mistake must not blind both. What rows bound by sums, it takes as the length of the phasor where currents flow between
 * two lines; currents to neutral are added, as in the rows.
 */
#include <string.h>

#include "taper/ledger.h"

#define LINES 3u
/** sqrt(3) - 1, rounded up [permille]. */
#define FACET_permille 733

/** What connectors below a group draw: power, current to neutral by line, and between lines L1-L2, L2-L3, L3-L1. */
typedef struct {
    int64_t power_mW;
    int64_t line_uA[LINES];
    int64_t pair_uA[LINES];
} load_t;

static int32_t power_W_per_A(const taper_connector_config_t *connector, const taper_demand_t *demand) {
    const int32_t booked_W_per_A = demand->booking.W_per_A;
    if (!demand->active && demand->booking.phases != 0 && booked_W_per_A != 0) {
        return booked_W_per_A;
    }
    int32_t W_per_A =
        demand->active ? demand->W_per_A : (connector->voltage_mV + 999) / 1000 * connector->phases;
    if (connector->is_dc) {
        const int32_t efficiency = connector->efficiency_permille;
        W_per_A = (W_per_A * 1000 + efficiency - 1) / efficiency;
    }
    return taper_max_i32(W_per_A, booked_W_per_A);
}

/** Lines that a connector is wired to by its description: bit 0 L1 .. bit 2 L3. */
static unsigned wired_lines(const taper_connector_config_t *connector) {
    /* of rotations unknown, 123, 231, 312, 132, 213, 321 */
    static const uint8_t first[] = {1, 1, 2, 4, 1, 2, 4};
    static const uint8_t first_two[] = {3, 3, 6, 5, 5, 3, 6};
    if (connector->is_dc || connector->phases == LINES) {
        return 7;
    }
    return (connector->line_to_line ? first_two : first)[connector->rotation];
}

/** Current in its supply for 1000 A of setpoint. */
static int32_t supply_permille(const taper_station_config_t *config,
                               const taper_connector_config_t *connector) {
    if (!connector->is_dc) {
        return 1000;
    }
    const int32_t volts = (connector->voltage_mV + 999) / 1000;
    const int32_t W_per_A =
        (volts * 1000 + connector->efficiency_permille - 1) / connector->efficiency_permille;
    const int64_t site_mV = 3 * (int64_t)config->site_voltage_mV;
    return (int32_t)((W_per_A * INT64_C(1000000) + site_mV - 1) / site_mV);
}

static void add_current(load_t *load, unsigned lines, bool between_lines, int64_t current_uA) {
    if (between_lines && (lines == 3u || lines == 6u || lines == 5u)) {
        load->pair_uA[lines == 3u ? 0 : lines == 6u ? 1 : 2] += current_uA;
        return;
    }
    for (unsigned line = 0; line < LINES; line++) {
        load->line_uA[line] += (lines >> line & 1u) != 0 ? current_uA : 0;
    }
}

static void add_connector(const taper_station_config_t *config, const taper_demand_t *demand, uint8_t i,
                          int32_t current_mA, load_t *load) {
    const taper_connector_config_t *connector = &config->connectors[i];
    load->power_mW += (int64_t)current_mA * power_W_per_A(connector, demand);
    if (demand->booking.phases != 0) {
        add_current(load, demand->booking.phases, demand->booking.line_to_line,
                    (int64_t)current_mA * demand->booking.permille);
    } else {
        add_current(load, wired_lines(connector), connector->line_to_line,
                    (int64_t)current_mA * supply_permille(config, connector));
    }
}

static void add_load(load_t *sum, const load_t *load) {
    sum->power_mW += load->power_mW;
    for (unsigned line = 0; line < LINES; line++) {
        sum->line_uA[line] += load->line_uA[line];
        sum->pair_uA[line] += load->pair_uA[line];
    }
}

/** Root of a square below 2^62, rounded up. */
static int64_t root(int64_t square) {
    int64_t below = -1; /* the greatest whose own square is smaller */
    for (int64_t bit = INT64_C(1) << 31; bit != 0; bit /= 2) {
        const int64_t trial = below + bit;
        below = trial * trial < square ? trial : below;
    }
    return below + 1;
}

static int64_t whole_mA(int64_t current_uA) {
    return taper_quotient(current_uA + 999, 1000);
}

/** Square of what two pairs bring to a line where they meet, 60 degrees apart: x^2 + x y + y^2 [mA^2]. */
static int64_t line_square(const load_t *load, unsigned line) {
    const int64_t x_mA = whole_mA(load->pair_uA[line]);
    const int64_t y_mA = whole_mA(load->pair_uA[(line + 2u) % LINES]);
    return x_mA * x_mA + x_mA * y_mA + y_mA * y_mA;
}

/** What two windings to neutral carry, 60 degrees apart: exact for one alone, and for three phases alike. */
static int64_t windings_uA(int64_t x_uA, int64_t y_uA) {
    const int64_t less_uA = x_uA < y_uA ? x_uA : y_uA;
    return x_uA + y_uA - less_uA + (less_uA * FACET_permille + 999) / 1000;
}

/** What flows from lines to neutral brings to a line on the delta side. */
static int64_t delta_windings_uA(const load_t *load, unsigned line) {
    return windings_uA(load->line_uA[line], load->line_uA[(line + 2u) % LINES]);
}

/** And the pairs, times the ratio of windings: AB + BC - 2 CA, 120 degrees apart [mA^2]. */
static int64_t delta_square(const load_t *load, unsigned line) {
    const int64_t a_mA = whole_mA(load->pair_uA[line]);
    const int64_t b_mA = whole_mA(load->pair_uA[(line + 1u) % LINES]);
    const int64_t c_mA = whole_mA(2 * load->pair_uA[(line + 2u) % LINES]);
    return a_mA * a_mA + b_mA * b_mA + c_mA * c_mA - a_mA * b_mA + a_mA * c_mA + b_mA * c_mA;
}

/** Whether a current with this square fits beside `other_uA`. */
static bool fits(int64_t other_uA, int64_t square, int32_t limit_mA) {
    const int64_t left_uA = (int64_t)taper_max_i32(limit_mA, 0) * 1000 - other_uA;
    const int64_t left_mA = left_uA < 0 ? -1 : taper_quotient(left_uA, 1000);
    return left_mA >= 0 && square <= left_mA * left_mA;
}

/* What is above a limit may be no more than it was before: only then the currents themselves are worked out. */

static bool line_passes(const load_t *before, const load_t *after, unsigned line, int32_t limit_mA) {
    const int64_t square = line_square(after, line);
    return fits(after->line_uA[line], square, limit_mA) ||
           after->line_uA[line] + 1000 * root(square) <=
               before->line_uA[line] + 1000 * root(line_square(before, line));
}

static bool delta_passes(const load_t *before, const load_t *after, unsigned line, int32_t limit_mA) {
    const int64_t windings = delta_windings_uA(after, line);
    const int64_t square = delta_square(after, line);
    return fits(windings, square, limit_mA) ||
           windings + 1000 * root(square) <=
               delta_windings_uA(before, line) + 1000 * root(delta_square(before, line));
}

static bool lines_pass(const taper_group_config_t *group, const int32_t *supply_mA, const load_t *before,
                       const load_t *after) {
    for (unsigned line = 0; line < LINES; line++) {
        const int32_t limit_mA = taper_min_i32(group->limit_mA, supply_mA[line]);
        if (group->limit_mA != 0 && !line_passes(before, after, line, limit_mA)) {
            return false;
        }
        if (group->delta_mA != 0 && !delta_passes(before, after, line, group->delta_mA)) {
            return false;
        }
    }
    return true;
}

/** Whether the power `before` and `after`, in mW, may be: within the limit, or no more. */
static bool power_passes(int64_t before, int64_t after, int32_t limit_W) {
    return after <= (int64_t)taper_max_i32(limit_W, 0) * 1000 || after <= before;
}

static bool group_passes(const taper_group_config_t *group, const taper_supply_t *supply,
                         const load_t *before, const load_t *after) {
    const int32_t limit_W = taper_min_i32(group->limit_W, supply->site_W);
    return (group->limit_W == 0 || power_passes(before->power_mW, after->power_mW, limit_W)) &&
           lines_pass(group, supply->phase_mA, before, after);
}

bool taper_guard_hand_over_passes(const taper_ledger_t *ledger, const taper_station_config_t *config,
                                  const taper_snapshot_t *snapshot, const taper_supply_t *supply,
                                  const taper_setpoints_t *granted) {
    const taper_supply_t described = taper_supply_of_W(INT32_MAX);
    load_t before[TAPER_MAX_GROUPS];
    load_t after[TAPER_MAX_GROUPS];
    memset(before, 0, config->group_count * sizeof *before);
    memset(after, 0, config->group_count * sizeof *after);
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const uint8_t group = config->connectors[i].group;
        const int32_t may_mA = taper_ledger_may_mA(ledger, i);
        add_connector(config, &snapshot->demand[i], i, may_mA, &before[group]);
        add_connector(config, &snapshot->demand[i], i, taper_max_i32(granted->current_mA[i], may_mA),
                      &after[group]);
    }
    const int32_t groups = taper_min_i32(config->group_count, TAPER_MAX_GROUPS); /* config_check.h: it is */
    for (int32_t k = groups; k-- > 0;) { /* children stand behind their parents */
        if (!group_passes(&config->groups[k], k == 0 ? supply : &described, &before[k], &after[k])) {
            return false;
        }
        if (k > 0) {
            add_load(&before[config->groups[k].parent], &before[k]);
            add_load(&after[config->groups[k].parent], &after[k]);
        }
    }
    return true;
}

bool taper_guard_fallback_passes(const taper_ledger_t *ledger, const taper_station_config_t *config,
                                 const taper_snapshot_t *snapshot, int32_t failsafe_W,
                                 const taper_setpoints_t *granted, const taper_setpoints_t *fallback) {
    int64_t after_mW = 0;
    bool is_told = false;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const int32_t W_per_A = power_W_per_A(&config->connectors[i], &snapshot->demand[i]);
        const int32_t told_mA = fallback->current_mA[i];
        if (told_mA < 0 || told_mA > granted->current_mA[i]) {
            return false;
        }
        is_told = is_told || told_mA > 0;
        after_mW += (int64_t)W_per_A * taper_max_i32(told_mA, taper_ledger_fallback_mA(ledger, i));
    }
    return !is_told || after_mW <= (int64_t)taper_max_i32(failsafe_W, 0) * 1000;
}
