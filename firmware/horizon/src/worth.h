/** Private to the layer: the linear cost, which is what energy is worth to each vehicle in each step. */
#ifndef TAPER_WORTH_H
#define TAPER_WORTH_H

#include <stdbool.h>

#include "taper/real.h"
#include "taper/types.h"

/** What is the same for all vehicles of a problem. */
typedef struct {
    const taper_course_t *course;
    uint16_t step_s;
    uint8_t steps;
    taper_real_t best_W;    /**< greatest limit of the course, at least 1 */
    taper_real_t discount;  /**< of the worth, per step */
    taper_real_t per_milli; /**< worth that a thousandth of the price takes away; 0: no price counts */
    int32_t cheapest_milli; /**< least price of the course */
} taper_worth_t;

/** Share of step `t` in which a vehicle is there. The running step counts whole: its power is set now. */
taper_real_t taper_presence(int32_t departs_in_s, uint16_t step_s, uint8_t t);

/** Look at what is known; `course` must outlive the result. Cost: O(connectors + steps). */
taper_worth_t taper_worth_of_course(const taper_station_config_t *config, const taper_snapshot_t *snapshot,
                                    const taper_course_t *course);

/** The weight w_i of a vehicle (horizon.h). Cost: O(steps). */
taper_real_t taper_worth_weight(const taper_worth_t *worth, const taper_demand_t *demand);

/** Write the linear cost of a vehicle of this weight on its energies v(i,t), [steps]. Cost: O(steps). */
void taper_worth_write(const taper_worth_t *worth, taper_real_t weight, taper_real_t *linear);

/** Whether a vehicle had better wait: the price counts, falls within its stay, and there is time to spare. Cost: O(steps). */
bool taper_worth_waits(const taper_worth_t *worth, const taper_demand_t *demand);

#endif
