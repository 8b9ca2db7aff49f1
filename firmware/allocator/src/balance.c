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

/** What setpoints put on the phases of a group, at most and at least: wirings may not be known. */
typedef struct {
    int64_t most_uA[PHASES], least_uA[PHASES];
} sums_t;

/** A group whose phases differ too much. */
typedef struct {
    uint8_t group;
    uint8_t strong, weak; /* bits of the phases */
    int64_t excess_uA;    /* <= 0: nothing to do */
} tilt_t;

/** That its setpoint may be on. */
static unsigned phases_of(const balance_t *balance, uint8_t i) {
    return balance->rows->booking[i].phases & ~(unsigned)balance->rows->booking[i].idle & 7u;
}

/** That it is on for sure. */
static unsigned sure_phases_of(const balance_t *balance, uint8_t i) {
    return phases_of(balance, i) & ~(unsigned)balance->rows->booking[i].unsure;
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

static void add_connector(const balance_t *balance, uint8_t i, sums_t *sums) {
    const int64_t current_uA = (int64_t)balance->current_mA[i] * permille_of(balance, i);
    for (unsigned phase = 0; phase < PHASES; phase++) {
        sums->most_uA[phase] += (phases_of(balance, i) >> phase & 1u) != 0u ? current_uA : 0;
        sums->least_uA[phase] += (sure_phases_of(balance, i) >> phase & 1u) != 0u ? current_uA : 0;
    }
}

static sums_t sums_of(const balance_t *balance, uint8_t group) {
    sums_t sums = {{0}, {0}};
    for (uint8_t i = 0; i < balance->config->connector_count; i++) {
        if (taper_group_contains(balance->config, group, i)) {
            add_connector(balance, i, &sums);
        }
    }
    return sums;
}

/** The two phases that may differ most; of those alike the first. */
static tilt_t tilt_of(const balance_t *balance, uint8_t k) {
    const sums_t sums = sums_of(balance, k);
    tilt_t tilt = {.group = k, .excess_uA = INT64_MIN};
    for (unsigned pair = 0; pair < PHASES * (PHASES - 1u); pair++) {
        const unsigned strong = pair / (PHASES - 1u);
        const unsigned other = pair % (PHASES - 1u);
        const unsigned weak = other < strong ? other : other + 1u;
        const int64_t apart_uA = sums.most_uA[strong] - sums.least_uA[weak];
        if (apart_uA > tilt.excess_uA) {
            tilt.strong = (uint8_t)(1u << strong);
            tilt.weak = (uint8_t)(1u << weak);
            tilt.excess_uA = apart_uA;
        }
    }
    tilt.excess_uA -= (int64_t)balance->config->groups[k].imbalance_mA * 1000;
    return tilt;
}

/** The first group from the leaves up that tilts: what helps it may help those above. */
static tilt_t find_tilt(const balance_t *balance) {
    tilt_t tilt = {.excess_uA = 0};
    for (uint8_t k = balance->config->group_count; k-- > 0 && tilt.excess_uA <= 0;) {
        if (balance->config->groups[k].imbalance_mA != 0) {
            tilt = tilt_of(balance, k);
        }
    }
    return tilt;
}

/** Whether less current of this connector makes the tilt less: it may be on the strong phase, and not on the weak one. */
static bool helps(const balance_t *balance, const tilt_t *tilt, uint8_t i) {
    return balance->current_mA[i] > 0 && permille_of(balance, i) > 0 &&
           (phases_of(balance, i) & tilt->strong) != 0 && (sure_phases_of(balance, i) & tilt->weak) == 0 &&
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

/** In the order in which they are cut: less of what is unsure helps between any two phases, and costs no other. */
typedef enum { UNSURE, ON_ONE_PHASE, ON_MORE, KINDS } kind_t;

static kind_t kind_of(const balance_t *balance, uint8_t i) {
    const unsigned phases = phases_of(balance, i);
    if (sure_phases_of(balance, i) != phases) {
        return UNSURE;
    }
    return (phases & (phases - 1u)) == 0u ? ON_ONE_PHASE : ON_MORE;
}

typedef void cut_t(balance_t *balance, tilt_t *tilt, uint8_t i);

/** Cut those of a kind that help, from the last one up. */
static void cut_those(balance_t *balance, tilt_t *tilt, kind_t kind, cut_t *how) {
    for (uint8_t place = balance->config->connector_count; place-- > 0 && tilt->excess_uA > 0;) {
        const uint8_t i = balance->order[place];
        if (helps(balance, tilt, i) && kind_of(balance, i) == kind) {
            how(balance, tilt, i);
        }
    }
}

static void cut(balance_t *balance, tilt_t *tilt, cut_t *how) {
    for (unsigned kind = 0; kind < KINDS; kind++) {
        cut_those(balance, tilt, (kind_t)kind, how);
    }
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
    /* It ends: while a group tilts, somebody on its strong phase and not for sure on its weak one has current, so every round
     * lowers somebody. A group needs two rounds, one for each phase above its weakest, but groups within groups, and currents of
     * unsure phases, could pass small cuts to and fro; so after as many rounds as that takes, and one per connector, each
     * switches at least one of them off. */
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
