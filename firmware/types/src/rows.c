#include "taper/rows.h"

/** sqrt(3) - 1, rounded up [permille]. */
#define FACET_permille 733
#define FULL_permille  1000
/** Three-phase current on a delta side: sqrt(3), rounded up [permille]. */
#define BALANCED_permille 1733

typedef enum { FAMILY_POWER, FAMILY_LINE, FAMILY_DELTA, FAMILY_DIFFERENCE, FAMILIES } family_t;

/** Place of a kind in its family: which line (0..2) and which of its two rows. */
typedef struct {
    family_t family;
    uint8_t line;
    bool second;
} place_t;

static place_t place_of(taper_row_kind_t kind) {
    if (kind == TAPER_ROW_POWER) {
        return (place_t){.family = FAMILY_POWER};
    }
    if (kind >= TAPER_ROW_L1_L2) {
        return (place_t){.family = FAMILY_DIFFERENCE, .line = (uint8_t)(kind - TAPER_ROW_L1_L2)};
    }
    const unsigned at = (unsigned)kind - TAPER_ROW_L1;
    return (place_t){
        .family = at < 6u ? FAMILY_LINE : FAMILY_DELTA, .line = (uint8_t)(at % 3u), .second = at % 6u >= 3u};
}

static int32_t limit_of(const taper_group_config_t *group, family_t family) {
    switch (family) {
    case FAMILY_POWER: return group->limit_W;
    case FAMILY_LINE: return group->limit_mA;
    case FAMILY_DELTA: return group->delta_mA;
    case FAMILY_DIFFERENCE:
    default: return group->imbalance_mA;
    }
}

static int32_t limit_at(const taper_station_config_t *config, uint8_t k, place_t place) {
    const int32_t limit = limit_of(&config->groups[k], place.family);
    if (limit == 0 || (place.second && !config->line_to_line)) {
        return TAPER_NO_LIMIT; /* none, or one that would say the same as the first */
    }
    return limit;
}

int32_t taper_row_limit(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind) {
    return limit_at(config, group, place_of(kind));
}

/** The same with what the site may have now. */
static int32_t limit_now_at(const taper_station_config_t *config, const taper_supply_t *supply, uint8_t k,
                            place_t place) {
    const int32_t limit = limit_at(config, k, place);
    if (limit == TAPER_NO_LIMIT || k != 0) {
        return limit;
    }
    if (place.family == FAMILY_POWER) {
        return taper_max_i32(taper_min_i32(limit, supply->site_W), 0);
    }
    if (place.family == FAMILY_LINE) {
        return taper_max_i32(taper_min_i32(limit, supply->phase_mA[place.line]), 0);
    }
    return limit;
}

int32_t taper_row_limit_now(const taper_station_config_t *config, const taper_supply_t *supply, uint8_t group,
                            taper_row_kind_t kind) {
    return limit_now_at(config, supply, group, place_of(kind));
}

static bool has_phase(const taper_booking_t *booking, unsigned phase) {
    return ((unsigned)booking->phases >> phase % 3u & 1u) != 0u;
}

/** The first phase of the pair that a line-to-line connector is between; 3: it is not between a pair. */
static unsigned pair_of(const taper_booking_t *booking) {
    static const uint8_t pairs[] = {3, 3, 3, 0, 3, 2, 1, 3};
    return booking->line_to_line ? pairs[booking->phases & 7u] : 3u;
}

static int32_t line_permille(const taper_booking_t *booking, unsigned line, bool second) {
    if (!has_phase(booking, line)) {
        return 0;
    }
    const unsigned pair = pair_of(booking);
    if (pair == 3u) {
        return FULL_permille;
    }
    return (pair == line) != second ? FULL_permille : FACET_permille;
}

static int32_t delta_permille(const taper_booking_t *booking, unsigned line, bool second) {
    const unsigned pair = pair_of(booking);
    if (pair < 3u) {
        const unsigned facet = (line + (second ? 1u : 0u)) % 3u;
        return pair == (line + 2u) % 3u ? 2 * FULL_permille : pair == facet ? FULL_permille : 0;
    }
    const bool windings = has_phase(booking, line) && has_phase(booking, line + 2u);
    const bool one = has_phase(booking, line) || has_phase(booking, line + 2u);
    if (windings) {
        return booking->line_to_line ? 2 * FULL_permille
                                     : BALANCED_permille; /* between lines: any of three */
    }
    return one ? FULL_permille : 0;
}

static int32_t difference_permille(const taper_booking_t *booking, unsigned line) {
    return (has_phase(booking, line) ? FULL_permille : 0) -
           (has_phase(booking, line + 1u) ? FULL_permille : 0);
}

static int32_t row_permille(const taper_booking_t *booking, place_t place) {
    if (place.family == FAMILY_LINE) {
        return line_permille(booking, place.line, place.second);
    }
    return place.family == FAMILY_DELTA ? delta_permille(booking, place.line, place.second)
                                        : difference_permille(booking, place.line);
}

static int32_t weight_at(const taper_booking_t *booking, place_t place) {
    if (place.family == FAMILY_POWER) {
        return booking->W_per_A;
    }
    const int32_t share_permille = row_permille(booking, place);
    if (share_permille % FULL_permille ==
        0) { /* nearly always: none, or all of it; a division of 64 bits is slow */
        return share_permille / FULL_permille * booking->permille;
    }
    const int64_t thousandths = (int64_t)share_permille * booking->permille;
    const int64_t part = thousandths % FULL_permille > 0 ? 1 : 0; /* rounded up */
    return (int32_t)(thousandths / FULL_permille + part);
}

int32_t taper_row_weight(const taper_booking_t *booking, taper_row_kind_t kind) {
    return weight_at(booking, place_of(kind));
}

uint8_t taper_rotation_phases(taper_rotation_t rotation, uint8_t conductors) {
    /* By rotation, of none to three conductors; one that is not known counts as straight. */
    static const uint8_t masks[][4] = {{0, 1, 3, 7}, {0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7},
                                       {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 4, 6, 7}};
    const unsigned known =
        (unsigned)rotation < sizeof masks / sizeof masks[0] ? rotation : TAPER_ROTATION_UNKNOWN;
    return masks[known][taper_min_i32(conductors, 3)];
}

static int32_t whole_V(int32_t voltage_mV) {
    return (voltage_mV + 999) / 1000;
}

taper_booking_t taper_booking_nominal(const taper_station_config_t *config, uint8_t i) {
    const taper_connector_config_t *connector = &config->connectors[i];
    const int32_t volts_V = whole_V(connector->voltage_mV);
    if (connector->is_dc) {
        const int32_t W_per_A =
            (volts_V * 1000 + connector->efficiency_permille - 1) / connector->efficiency_permille;
        const int32_t supply_mV = 3 * config->site_voltage_mV;
        return (taper_booking_t){.W_per_A = W_per_A,
                                 .permille =
                                     (int32_t)(((int64_t)W_per_A * 1000000 + supply_mV - 1) / supply_mV),
                                 .phases = 7};
    }
    const uint8_t conductors = connector->line_to_line ? 2 : connector->phases;
    return (taper_booking_t){.W_per_A = volts_V * connector->phases,
                             .permille = FULL_permille,
                             .phases =
                                 taper_rotation_phases((taper_rotation_t)connector->rotation, conductors),
                             .line_to_line = connector->line_to_line};
}

/** Power of 1 A of a vehicle in the supply: with a converter's losses, rounded up. */
static int32_t drawn_W_per_A(const taper_connector_config_t *connector, const taper_demand_t *demand) {
    if (!connector->is_dc) {
        return demand->W_per_A;
    }
    const int32_t efficiency = connector->efficiency_permille;
    return (int32_t)(((int64_t)demand->W_per_A * FULL_permille + efficiency - 1) / efficiency);
}

/** Least power of 1 A that counts for connector `i`: what its demand draws, with losses; else by the description. */
static int32_t least_W_per_A(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                             uint8_t i) {
    const taper_demand_t *demand = &snapshot->demand[i];
    if (demand->active) {
        return drawn_W_per_A(&config->connectors[i], demand);
    }
    const bool is_told = demand->booking.phases != 0 && demand->booking.W_per_A != 0;
    return is_told ? demand->booking.W_per_A : taper_booking_nominal(config, i).W_per_A;
}

taper_booking_t taper_booking_now(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                                  uint8_t i) {
    const taper_booking_t *told = &snapshot->demand[i].booking;
    taper_booking_t booking = told->phases == 0 ? taper_booking_nominal(config, i) : *told;
    booking.W_per_A = taper_max_i32(told->W_per_A, least_W_per_A(config, snapshot, i));
    return booking;
}

static bool some_group_limits(const taper_station_config_t *config, family_t family) {
    bool limited = false;
    for (uint8_t k = 0; k < config->group_count; k++) {
        limited = limited || limit_of(&config->groups[k], family) != 0;
    }
    return limited;
}

/** Add the rows of a kind to the list. */
static void list_kind(taper_rows_t *rows, const taper_station_config_t *config, const taper_supply_t *supply,
                      taper_row_kind_t kind, place_t place) {
    const unsigned row = rows->count++;
    rows->kind[row] = (uint8_t)kind;
    rows->sums = kind < TAPER_ROW_SUMS ? rows->count : rows->sums;
    for (uint8_t k = 0; k < config->group_count; k++) {
        rows->limit[k][row] = limit_now_at(config, supply, k, place);
    }
    for (uint8_t i = 0; i < config->connector_count; i++) {
        rows->weight[i][row] = weight_at(&rows->booking[i], place);
    }
}

void taper_rows_now(taper_rows_t *rows, const taper_station_config_t *config,
                    const taper_snapshot_t *snapshot, const taper_supply_t *supply) {
    bool limited[FAMILIES];
    for (int family = 0; family < FAMILIES; family++) {
        limited[family] = some_group_limits(config, (family_t)family);
    }
    for (uint8_t i = 0; i < config->connector_count; i++) {
        rows->booking[i] = taper_booking_now(config, snapshot, i);
    }
    rows->count = 0;
    rows->sums = 0;
    for (int kind = 0; kind < TAPER_ROW_KINDS; kind++) {
        const place_t place = place_of((taper_row_kind_t)kind);
        if (limited[place.family] && (!place.second || config->line_to_line)) {
            list_kind(rows, config, supply, (taper_row_kind_t)kind, place);
        }
    }
}

bool taper_group_contains(const taper_station_config_t *config, uint8_t k, uint8_t i) {
    uint8_t group = config->connectors[i].group;
    while (group != k && group != TAPER_NO_GROUP) {
        group = config->groups[group].parent;
    }
    return group == k;
}

bool taper_row_plans(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind, uint8_t i) {
    if (!taper_group_contains(config, group, i)) {
        return false;
    }
    const taper_booking_t booking = taper_booking_nominal(config, i);
    return taper_row_weight(&booking, kind) != 0;
}

static bool has_members(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind) {
    for (uint8_t i = 0; i < config->connector_count; i++) {
        if (taper_row_plans(config, group, kind, i)) {
            return true;
        }
    }
    return false;
}

/** Whether no connector weighs more in a row than in `other`, which has the same bound; of equals the first stays. */
static bool implies(const taper_station_config_t *config, uint8_t group, taper_row_kind_t other,
                    taper_row_kind_t kind) {
    bool equal = true;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const taper_booking_t booking = taper_booking_nominal(config, i);
        const int32_t weight = taper_row_weight(&booking, kind);
        const int32_t other_weight = taper_row_weight(&booking, other);
        if (taper_group_contains(config, group, i) && weight > other_weight) {
            return false;
        }
        equal = equal && (weight == other_weight || !taper_group_contains(config, group, i));
    }
    return !equal || other < kind;
}

/** Whether another line of the group says as much; no difference does. Not at the site: its lines differ by what else it draws. */
static bool is_implied(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind) {
    const place_t place = place_of(kind);
    for (int other = TAPER_ROW_L1; group != 0 && other < TAPER_ROW_SUMS; other++) {
        const bool is_alike = place_of((taper_row_kind_t)other).family == place.family &&
                              taper_row_limit(config, group, (taper_row_kind_t)other) != TAPER_NO_LIMIT;
        if (is_alike && other != (int)kind && implies(config, group, (taper_row_kind_t)other, kind)) {
            return true;
        }
    }
    return false;
}

bool taper_row_is_planned(const taper_station_config_t *config, uint8_t group, taper_row_kind_t kind) {
    return taper_row_limit(config, group, kind) != TAPER_NO_LIMIT && has_members(config, group, kind) &&
           !is_implied(config, group, kind);
}
