/* Imbalance cannot be kept by rooms: what one phase may have depends on what the others get. So it comes last. */
#include "taper/allocator.h"
#include "taper/rows.h"

#define PHASES 3u

typedef struct {
    const taper_station_config_t *config;
    const taper_snapshot_t *snapshot;
    const taper_rows_t *rows;
    uint8_t order[TAPER_MAX_CONNECTORS]; /* every connector once, who is cut last first */
    int32_t *current_mA;
} balance_t;

/** A group whose phases differ too much. */
typedef struct {
    uint8_t group;
    uint8_t strong, weak; /* bits of the phases */
    int64_t excess_uA;    /* <= 0: nothing to do */
} tilt_t;

static unsigned phases_of(const balance_t *balance, uint8_t i) {
    return balance->rows->booking[i].phases & 7u;
}

static int32_t permille_of(const balance_t *balance, uint8_t i) {
    return balance->rows->booking[i].permille;
}

/** A rank binds nobody: whom it does not name is cut first, who is named twice stands where it was first. */
static void order_all(balance_t *balance, const uint8_t *rank) {
    const uint8_t count = balance->config->connector_count;
    bool listed[TAPER_MAX_CONNECTORS] = {false};
    uint8_t place = 0;
    for (uint8_t k = 0; k < count; k++) {
        if (rank[k] < count && !listed[rank[k]]) {
            listed[rank[k]] = true;
            balance->order[place++] = rank[k];
        }
    }
    for (uint8_t i = 0; i < count; i++) {
        if (!listed[i]) {
            balance->order[place++] = i;
        }
    }
}

/** Add all currents to `sum_uA`, which is 0, by group and phase. */
static void sum_phases(const balance_t *balance, int64_t sum_uA[TAPER_MAX_GROUPS][PHASES]) {
    const taper_station_config_t *config = balance->config;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        for (unsigned phase = 0; phase < PHASES; phase++) {
            if ((phases_of(balance, i) >> phase & 1u) != 0u) {
                sum_uA[config->connectors[i].group][phase] +=
                    (int64_t)balance->current_mA[i] * permille_of(balance, i);
            }
        }
    }
    for (uint8_t k = config->group_count; k-- > 0;) { /* children stand behind their parents */
        const uint8_t parent = config->groups[k].parent;
        for (unsigned phase = 0; phase < PHASES && parent != TAPER_NO_GROUP; phase++) {
            sum_uA[parent][phase] += sum_uA[k][phase];
        }
    }
}

static tilt_t tilt_of(const balance_t *balance, uint8_t k, const int64_t *sum_uA) {
    unsigned strong = 0;
    unsigned weak = 0;
    for (unsigned phase = 1; phase < PHASES; phase++) {
        strong = sum_uA[phase] > sum_uA[strong] ? phase : strong;
        weak = sum_uA[phase] < sum_uA[weak] ? phase : weak;
    }
    const int32_t limit_mA = taper_row_limit(balance->config, k, TAPER_ROW_L1_L2);
    return (tilt_t){.group = k,
                    .strong = (uint8_t)(1u << strong),
                    .weak = (uint8_t)(1u << weak),
                    .excess_uA = sum_uA[strong] - sum_uA[weak] - (int64_t)limit_mA * 1000};
}

/** The first group from the leaves up that tilts: what helps it may help those above. */
static tilt_t find_tilt(const balance_t *balance) {
    int64_t sum_uA[TAPER_MAX_GROUPS][PHASES] = {0};
    sum_phases(balance, sum_uA);
    for (uint8_t k = balance->config->group_count; k-- > 0;) {
        const tilt_t tilt = tilt_of(balance, k, sum_uA[k]);
        if (tilt.excess_uA > 0) {
            return tilt;
        }
    }
    return (tilt_t){.excess_uA = 0};
}

/** Whether less current of this connector makes the tilt less: it is on the strong phase, and not on the weak one. */
static bool helps(const balance_t *balance, const tilt_t *tilt, uint8_t i) {
    return balance->current_mA[i] > 0 && permille_of(balance, i) > 0 &&
           (phases_of(balance, i) & tilt->strong) != 0 && (phases_of(balance, i) & tilt->weak) == 0 &&
           taper_group_contains(balance->config, tilt->group, i);
}

static void lower_to(balance_t *balance, tilt_t *tilt, uint8_t i, int32_t current_mA) {
    tilt->excess_uA -= (int64_t)(balance->current_mA[i] - current_mA) * permille_of(balance, i);
    balance->current_mA[i] = current_mA;
}

/** As far as it takes, but not below its minimum. */
static void lower(balance_t *balance, tilt_t *tilt, uint8_t i) {
    const int64_t step_uA = (int64_t)TAPER_CURRENT_STEP_mA * permille_of(balance, i);
    const int64_t steps = (tilt->excess_uA + step_uA - 1) / step_uA;
    const int64_t enough_mA = balance->current_mA[i] - steps * TAPER_CURRENT_STEP_mA;
    const int32_t min_mA = balance->snapshot->demand[i].min_mA;
    const int32_t least_mA =
        (min_mA + TAPER_CURRENT_STEP_mA - 1) / TAPER_CURRENT_STEP_mA * TAPER_CURRENT_STEP_mA;
    const int32_t lower_mA = taper_max_i32(taper_saturate_i32(enough_mA), least_mA);
    lower_to(balance, tilt, i, taper_min_i32(lower_mA, balance->current_mA[i]));
}

static void switch_off(balance_t *balance, tilt_t *tilt, uint8_t i) {
    lower_to(balance, tilt, i, 0);
}

static bool is_one_phase(const balance_t *balance, uint8_t i) {
    return (phases_of(balance, i) & (phases_of(balance, i) - 1u)) == 0u;
}

typedef void cut_t(balance_t *balance, tilt_t *tilt, uint8_t i);

/** Cut those on one phase, or on two, that help, from the last one up. */
static void cut_those(balance_t *balance, tilt_t *tilt, bool one_phase, cut_t *how) {
    for (uint8_t place = balance->config->connector_count; place-- > 0 && tilt->excess_uA > 0;) {
        const uint8_t i = balance->order[place];
        if (helps(balance, tilt, i) && is_one_phase(balance, i) == one_phase) {
            how(balance, tilt, i);
        }
    }
}

static void cut(balance_t *balance, tilt_t *tilt, cut_t *how) {
    cut_those(balance, tilt, true, how);
    cut_those(balance, tilt, false, how);
}

void taper_balance(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                   const taper_rows_t *rows, const uint8_t *rank, taper_setpoints_t *setpoints) {
    if (rows->count == rows->sums) {
        return; /* no group limits its imbalance */
    }
    balance_t balance;
    balance.config = config;
    balance.snapshot = snapshot;
    balance.rows = rows;
    balance.current_mA = setpoints->current_mA;
    order_all(&balance, rank);
    /* It ends: while a group tilts, somebody on its strong phase and not on its weak one has current, so every round lowers
     * somebody. A group needs two rounds, one for each phase above its weakest, but groups within groups could pass small cuts
     * to and fro; so after as many rounds as that takes, and one per connector, each switches at least one of them off. */
    const unsigned lowering = config->connector_count + 2u * config->group_count;
    unsigned rounds = 0;
    for (tilt_t tilt = find_tilt(&balance); tilt.excess_uA > 0; tilt = find_tilt(&balance)) {
        if (rounds < lowering) {
            cut(&balance, &tilt, lower);
        }
        cut(&balance, &tilt, switch_off);
        rounds++;
    }
}
