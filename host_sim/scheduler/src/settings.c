/* The station as described, and what a simulator may set of it. */
#include <math.h>
#include <string.h>

#include "scheduler_internal.h"
#include "taper/config_check.h"

#define MOST_kW 3276.7
#define MOST_A  20000.0
/** A value in thousandths counts as whole if it is so near to it: decimal fractions are not exact in binary. */
#define NEARLY 1e-6

static bool has_connector(const taper_scheduler_t *scheduler, int32_t i) {
    return i >= 0 && i < scheduler->config.connector_count;
}

static bool has_group(const taper_scheduler_t *scheduler, int32_t k) {
    return k >= 0 && k < scheduler->config.group_count;
}

/** Thousandths of a limit, rounded down. */
static int32_t thousandths(double value) {
    return (int32_t)floor(value * 1000 + NEARLY);
}

int32_t taper_scheduler_connectors(const taper_scheduler_t *scheduler) {
    return scheduler->config.connector_count;
}

int32_t taper_scheduler_groups(const taper_scheduler_t *scheduler) {
    return scheduler->config.group_count;
}

int32_t taper_scheduler_connector(const taper_scheduler_t *scheduler, int32_t connector,
                                  taper_scheduler_connector_t *description) {
    if (!has_connector(scheduler, connector) || description == NULL) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    const taper_connector_config_t *built = &scheduler->connector[connector];
    *description = (taper_scheduler_connector_t){
        .group = built->group,
        .lines = taper_booking_nominal(&scheduler->config, (uint8_t)connector).phases,
        .between = built->line_to_line,
        .min_A = built->min_mA / 1000.0,
        .max_A = built->max_mA / 1000.0,
        .voltage_V = built->voltage_mV / 1000.0,
    };
    return TAPER_SCHEDULER_OK;
}

int32_t taper_scheduler_group(const taper_scheduler_t *scheduler, int32_t group,
                              taper_scheduler_group_t *limits) {
    if (!has_group(scheduler, group) || limits == NULL) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    const taper_group_config_t *built = &scheduler->group[group];
    *limits = (taper_scheduler_group_t){
        .parent = built->parent == TAPER_NO_GROUP ? -1 : built->parent,
        .limit_kW = built->limit_W / 1000.0,
        .line_A = built->limit_mA / 1000.0,
        .delta_A = built->delta_mA / 1000.0,
    };
    return TAPER_SCHEDULER_OK;
}

/** A limit as it will be; below 0: it cannot be set. 0 leaves it as it is. */
static int32_t set_value(int32_t described, double wanted, double most) {
    if (!is_within(wanted, 0, most) || (wanted > 0 && described == 0)) {
        return -1;
    }
    const int32_t value = thousandths(wanted);
    return value > 0 ? value : described;
}

int32_t taper_scheduler_set_group(taper_scheduler_t *scheduler, int32_t group,
                                  const taper_scheduler_group_t *limits) {
    if (!has_group(scheduler, group) || limits == NULL) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    taper_group_config_t *kept = &scheduler->group[group];
    const int32_t limit_W = set_value(kept->limit_W, limits->limit_kW, MOST_kW);
    const int32_t limit_mA = set_value(kept->limit_mA, limits->line_A, MOST_A);
    const int32_t delta_mA = set_value(kept->delta_mA, limits->delta_A, MOST_A);
    if (limit_W < 0 || limit_mA < 0 || delta_mA < 0) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    if (group == 0) { /* a present limit that was never set is the description's */
        scheduler->limit_W = scheduler->limit_W == kept->limit_W ? limit_W : scheduler->limit_W;
        scheduler->config.failsafe_W = taper_min_i32(scheduler->config.failsafe_W, limit_W);
    }
    kept->limit_W = limit_W;
    kept->limit_mA = limit_mA;
    kept->delta_mA = delta_mA;
    return TAPER_SCHEDULER_OK;
}

/** Milliamperes of a rate that can be set, or below 0. */
static int32_t rate_mA(const taper_connector_config_t *connector, double rate_A) {
    const double steps = rate_A * 1000 / TAPER_CURRENT_STEP_mA;
    if (!is_within(rate_A, 0, connector->max_mA / 1000.0) || fabs(steps - round(steps)) > NEARLY) {
        return -1;
    }
    return (int32_t)lrint(steps) * TAPER_CURRENT_STEP_mA;
}

/** Fill `rates` with `rates_A`. @return whether they may be set. */
static bool read_rates(const taper_connector_config_t *connector, const double *rates_A, int32_t count,
                       rates_t *rates) {
    for (int32_t k = 0; k < count; k++) {
        const int32_t mA = rate_mA(connector, rates_A[k]);
        if (mA < 0 || (k > 0 && mA <= rates->rate_mA[k - 1])) {
            return false;
        }
        rates->rate_mA[k] = mA;
    }
    rates->count = (uint8_t)count;
    return true;
}

int32_t taper_scheduler_set_rates(taper_scheduler_t *scheduler, int32_t connector, const double *rates_A,
                                  int32_t count, int32_t continuous) {
    rates_t rates = {0};
    const bool counted = continuous != 0 ? count == 2 : is_within(count, 1, MAX_RATES);
    if (!has_connector(scheduler, connector) || rates_A == NULL || !counted) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    taper_connector_config_t *kept = &scheduler->connector[connector];
    const taper_connector_config_t before = *kept;
    if (!read_rates(kept, rates_A, count, &rates)) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    const bool from_nothing = continuous == 0 && rates.rate_mA[0] == 0 && count > 1;
    kept->min_mA = rates.rate_mA[from_nothing ? 1 : 0];
    kept->max_mA = rates.rate_mA[count - 1];
    kept->fallback_mA = 0; /* nobody is without a controller here */
    if (taper_config_check(&scheduler->config) != TAPER_OK) {
        *kept = before;
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    rates.count = continuous != 0 ? 0 : rates.count;
    scheduler->rates[connector] = rates;
    return TAPER_SCHEDULER_OK;
}

int32_t taper_scheduler_set_limit(taper_scheduler_t *scheduler, double limit_kW) {
    if (!is_within(limit_kW, 0, MOST_kW)) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    scheduler->limit_W = thousandths(limit_kW);
    return TAPER_SCHEDULER_OK;
}

/** Fill `curve`. @return whether times and limits are in range; their order is the firmware's to check. */
static bool read_course(const taper_scheduler_point_t *points, int32_t count, taper_limit_curve_t *curve) {
    for (int32_t k = 0; k < count; k++) {
        if (!is_within(points[k].time_s, 0, 1e12) || !is_within(points[k].limit_kW, 0, MOST_kW) ||
            (k > 0 && points[k].time_s <= points[k - 1].time_s)) {
            return false;
        }
        curve->point[k] = (taper_limit_point_t){.time_ms = scheduler_ms(points[k].time_s),
                                                .limit_W = thousandths(points[k].limit_kW)};
    }
    curve->count = (uint16_t)count;
    return count == 0 || points[count - 1].time_s - points[0].time_s <= TAPER_CURVE_SPAN_ms / 1000.0;
}

int32_t taper_scheduler_set_course(taper_scheduler_t *scheduler, const taper_scheduler_point_t *points,
                                   int32_t count) {
    taper_limit_curve_t curve = {0};
    if (!is_within(count, 0, TAPER_MAX_LIMIT_POINTS) || (count > 0 && points == NULL) ||
        !read_course(points, count, &curve) ||
        taper_limits_set_curve(&scheduler->limits, TAPER_CURVE_OF_FILE, &curve) != TAPER_OK) {
        return TAPER_SCHEDULER_ERR_ARGUMENT;
    }
    return TAPER_SCHEDULER_OK;
}

/** A guard sees multiples of 0.1 A only: 1 A for everybody, booked as the current that is asked about. */
static void book(const taper_scheduler_t *scheduler, uint8_t i, double current_A, taper_demand_t *demand) {
    const taper_booking_t nominal = taper_booking_nominal(&scheduler->config, i);
    *demand = (taper_demand_t){.active = true, .max_mA = 1000, .booking = nominal};
    demand->booking.permille = (int32_t)ceil(current_A * nominal.permille - NEARLY);
    demand->booking.W_per_A = (int32_t)ceil(current_A * nominal.W_per_A - NEARLY);
}

int32_t taper_scheduler_holds(const taper_scheduler_t *scheduler, const double *current_A) {
    taper_snapshot_t snapshot = {.count = scheduler->config.connector_count};
    taper_setpoints_t setpoints = {{0}};
    const taper_supply_t supply = taper_supply_of_W(scheduler->group[0].limit_W);
    for (uint8_t i = 0; i < snapshot.count; i++) {
        if (current_A == NULL || !is_within(current_A[i], 0, MOST_A)) {
            return TAPER_SCHEDULER_ERR_ARGUMENT;
        }
        book(scheduler, i, current_A[i], &snapshot.demand[i]);
        setpoints.current_mA[i] = 1000;
    }
    return taper_guard_passes(&scheduler->config, &snapshot, &supply, &setpoints);
}
