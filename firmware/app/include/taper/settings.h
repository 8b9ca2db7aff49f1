/**
 * What is set at the site without another image: the part of a station's description that a commissioning engineer may
 * narrow, and how the station works. Kept in the port's store, area TAPER_STORE_SETTINGS: both copies hold the same, and
 * power may go at any moment of a save: what was set before holds then, or what was set now.
 *
 *     static taper_site_t site;                                   // the caller owns the memory
 *     taper_settings_t settings;
 *     const taper_stored_t found = taper_settings_load(&port, &taper_station_hub, &settings);
 *     if (taper_settings_apply(&settings, &taper_station_hub, &site) != TAPER_OK) {
 *         settings = taper_settings_cautious(&taper_station_hub);  // of another description
 *         taper_settings_apply(&settings, &taper_station_hub, &site);
 *     }
 *     options.config = &site.config;
 *     options.settings_found = found;                             // for the event log
 */
#ifndef TAPER_SETTINGS_H
#define TAPER_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>

#include "taper/port.h"
#include "taper/types.h"

/** What was found in an area of the store. */
typedef enum {
    TAPER_STORED_NONE = 0,     /**< there is no store, or nothing was ever written */
    TAPER_STORED_GOOD = 1,     /**< the newest record */
    TAPER_STORED_OLD_COPY = 2, /**< a good record; the other copy is not: torn or rotten */
    TAPER_STORED_BAD = 3,      /**< no copy is good */
    TAPER_STORED_OTHER = 4,    /**< a sound record of an image or a station that keeps other things */
} taper_stored_t;

/** Who proposes in mode PLAN. The caller makes it true by `solver` and `policy` of the station's options. */
typedef enum {
    TAPER_PROPOSER_AS_BUILT = 0,
    TAPER_PROPOSER_PLANNER = 1,
    TAPER_PROPOSER_EDF = 2,
    TAPER_PROPOSER_LLF = 3,
} taper_proposer_t;

/** Each one absent (TAPER_ABSENT; 0 where it says so): as the station is described. */
typedef struct {
    int32_t limit_W;               /**< of the site, > 0, only lower than described */
    int32_t failsafe_W;            /**< >= 0, only lower than described */
    int32_t min_ac_mA;             /**< least current of every AC connector: 0 or >= 6 A */
    int32_t min_dc_mA;             /**< of every DC connector */
    int32_t price_weight_permille; /**< 0..1000 */
    uint32_t tick_ms;              /**< control tick; 0: as described */
    uint16_t
        iterations_per_tick; /**< solver iterations in a tick, <= TAPER_MAX_ITERATIONS; 0: the caller's own */
    uint8_t proposer;        /**< taper_proposer_t */
} taper_settings_t;

/** A description with settings in it. `config` points into it: it must stay where it is. */
typedef struct {
    taper_station_config_t config;
    taper_group_config_t groups[TAPER_MAX_GROUPS];
    taper_connector_config_t connectors[TAPER_MAX_CONNECTORS];
} taper_site_t;

/** Nothing is set. */
taper_settings_t taper_settings_none(void);

/** What holds when settings were lost: they may have been a lower limit, so the failsafe limit is the site's. */
taper_settings_t taper_settings_cautious(const taper_station_config_t *built);

/**
 * Settings from the store. Where nothing was ever set, none; where both copies are bad, or of another image, the cautious
 * ones. If one copy is not as good as the other it is written again. Call it before the station starts. Cost: O(bytes).
 */
taper_stored_t taper_settings_load(const taper_port_t *port, const taper_station_config_t *built,
                                   taper_settings_t *settings);

/**
 * Keep settings: first in the older copy, then in the other. Apply them first: what is refused there is not worth keeping.
 * They hold from the next start. @return false: the store did not take both; load tells which settings hold.
 */
bool taper_settings_save(const taper_port_t *port, const taper_settings_t *settings);

/**
 * `built` with `settings` in it. The failsafe limit is never above the site's; a fallback current below the least current
 * of its connector cannot be offered any more and becomes 0.
 * @return TAPER_ERR_CONFIG for a setting out of its range, or a description that taper_config_check() refuses; `site` is then
 *         `built` as it is: settings are used all, or none.
 */
taper_status_t taper_settings_apply(const taper_settings_t *settings, const taper_station_config_t *built,
                                    taper_site_t *site);

#endif
