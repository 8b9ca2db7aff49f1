#include "worth.h"

#include <tgmath.h>

#include "taper/battery.h"
#include "taper/horizon.h"
#include "taper/real_math.h"

/** Discount of the worth where a price counts: having energy early must not outweigh having it cheaply. */
#define PRICED_DISCOUNT ((taper_real_t)0.99)
/** Worth that the dearest step loses at full weight. Below 0.99^24, so that no energy is worth less than nothing. */
#define PRICE_SPAN ((taper_real_t)0.75)
/** With this many times the known supply wanted, the price counts for nothing; a quarter less, in full. */
#define FULL_LOAD ((taper_real_t)1.25)
/** Who has less to spare than this does not wait for a lower price: the need takes longer as the taper falls. */
#define RESERVE_FACTOR ((taper_real_t)1.25)
#define RESERVE_STEPS  2
/** Prices that differ by less than this part of their mean are not stretched to the whole span. */
#define LEAST_RANGE ((taper_real_t)0.25)

taper_real_t taper_presence(int32_t departs_in_s, uint16_t step_s, uint8_t t) {
    if (t == 0) {
        return 1;
    }
    const int32_t left_s = taper_clamp_i32(departs_in_s - (int32_t)t * step_s, 0, step_s);
    return (taper_real_t)left_s / (taper_real_t)step_s;
}

static void look_at_limits(taper_worth_t *worth) {
    worth->best_W = 1;
    for (uint8_t t = 0; t < worth->steps; t++) {
        worth->best_W = taper_real_max(worth->best_W, (taper_real_t)worth->course->limit_W[t]);
    }
}

/** How far the price may count, 0..1: where supply is short, to wait is to lose. */
static taper_real_t leisure(const taper_worth_t *worth, const taper_snapshot_t *snapshot) {
    taper_real_t wanted_Wh = 0;
    taper_real_t supply_W = 0;
    for (uint8_t i = 0; i < snapshot->count; i++) {
        wanted_Wh += snapshot->demand[i].active ? (taper_real_t)snapshot->demand[i].need_Wh : 0;
    }
    for (uint8_t t = 0; t < worth->steps; t++) {
        supply_W += (taper_real_t)worth->course->limit_W[t];
    }
    const taper_real_t supply_Wh = supply_W * (taper_real_t)worth->step_s / 3600;
    const taper_real_t load = supply_Wh > 0 ? wanted_Wh / supply_Wh : FULL_LOAD;
    return taper_real_max(taper_real_min(4 * (FULL_LOAD - load), 1), 0);
}

static void look_at_prices(taper_worth_t *worth, taper_real_t weight) {
    const int32_t *price = worth->course->milli_per_kWh;
    int32_t dearest = price[0];
    taper_real_t sum = 0;
    worth->cheapest_milli = price[0];
    for (uint8_t t = 0; t < worth->steps; t++) {
        worth->cheapest_milli = taper_min_i32(worth->cheapest_milli, price[t]);
        dearest = taper_max_i32(dearest, price[t]);
        sum += fabs((taper_real_t)price[t]);
    }
    const taper_real_t range = (taper_real_t)dearest - (taper_real_t)worth->cheapest_milli;
    const taper_real_t stretched = taper_real_max(range, LEAST_RANGE * sum / (taper_real_t)worth->steps);
    if (range > 0) {
        worth->discount += (PRICED_DISCOUNT - TAPER_DISCOUNT) * weight;
        worth->per_milli = PRICE_SPAN * weight / stretched;
    }
}

taper_worth_t taper_worth_of_course(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                                    const taper_course_t *course) {
    taper_worth_t worth = {
        .course = course, .step_s = config->step_s, .steps = config->steps, .discount = TAPER_DISCOUNT};
    look_at_limits(&worth);
    if (course->priced) {
        const taper_real_t weight = (taper_real_t)config->price_weight_permille / 1000;
        look_at_prices(&worth, weight * leisure(&worth, snapshot));
    }
    return worth;
}

/** Steps of a stay, each counted by its share of the best limit that is known; what is beyond the horizon, whole. */
static taper_real_t useful_steps(const taper_worth_t *worth, int32_t departs_in_s) {
    taper_real_t energy_W = 0;
    for (uint8_t t = 0; t < worth->steps; t++) {
        energy_W += taper_presence(departs_in_s, worth->step_s, t) * (taper_real_t)worth->course->limit_W[t];
    }
    const int32_t beyond_s = taper_max_i32(departs_in_s - (int32_t)worth->steps * worth->step_s, 0);
    return energy_W / worth->best_W + (taper_real_t)beyond_s / (taper_real_t)worth->step_s;
}

/** Steps that the need takes at what the vehicle takes now; 0 if it takes nothing. */
static taper_real_t charging_steps(const taper_demand_t *demand, uint16_t step_s) {
    const int32_t power_W = taper_min_i32(taper_demand_allowed_W(demand), taper_battery_limit_W(demand));
    return power_W > 0 ? (taper_real_t)demand->need_Wh * 3600 / (taper_real_t)power_W / (taper_real_t)step_s
                       : 0;
}

/**
 * Who leaves soon comes first, and who has little time to spare. The second part sees beyond the horizon, which the rows
 * cannot. Both count less for who cannot get all in time anyway, so that others are not left unsatisfied in vain
 * (docs/results.md, "The objective").
 */
taper_real_t taper_worth_weight(const taper_worth_t *worth, const taper_demand_t *demand) {
    const taper_real_t useful = useful_steps(worth, demand->departs_in_s);
    const taper_real_t charging = charging_steps(demand, worth->step_s);
    const taper_real_t laxity = taper_real_max(useful - charging, 0);
    const taper_real_t urgency = 8 / taper_real_max(useful, 1) + 3 / (laxity + 16);
    return useful < charging ? 1 + urgency * sqrt(sqrt(useful / charging)) : 1 + urgency;
}

/** What a unit of energy in step `t` is worth, before its price, where `discounted` is the weight times g^(t+1). */
static taper_real_t less_price(const taper_worth_t *worth, taper_real_t discounted, uint8_t t) {
    const taper_real_t dearer =
        (taper_real_t)worth->course->milli_per_kWh[t] - (taper_real_t)worth->cheapest_milli;
    return discounted - worth->per_milli * dearer;
}

void taper_worth_write(const taper_worth_t *worth, taper_real_t weight, taper_real_t *linear) {
    taper_real_t discounted = weight * worth->discount;
    taper_real_t present = less_price(worth, discounted, 0);
    for (uint8_t t = 0; t < worth->steps; t++) {
        discounted *= worth->discount;
        const taper_real_t next = t + 1 < worth->steps ? less_price(worth, discounted, (uint8_t)(t + 1)) : 0;
        linear[t] = next - present; /* the power u(i,t) is v(i,t) - v(i,t-1) */
        present = next;
    }
}

bool taper_worth_waits(const taper_worth_t *worth, const taper_demand_t *demand) {
    const int32_t *price = worth->course->milli_per_kWh;
    const taper_real_t spare =
        useful_steps(worth, demand->departs_in_s) - RESERVE_FACTOR * charging_steps(demand, worth->step_s);
    bool falls = false;
    for (uint8_t t = 1; t < worth->steps && (int32_t)t * worth->step_s < demand->departs_in_s; t++) {
        falls = falls || price[t] < price[0];
    }
    return worth->per_milli > 0 && spare > RESERVE_STEPS && falls;
}
