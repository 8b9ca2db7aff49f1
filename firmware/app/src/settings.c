#include "taper/settings.h"

#include <string.h>

#include "bytes.h"
#include "stored.h"
#include "taper/config_check.h"
#include "taper/planner.h"

/** Changes with the meaning of the body's bytes: another layout is refused. */
#define LAYOUT 1u
#define BODY   28u

_Static_assert(TAPER_STORED_ENVELOPE + BODY <= TAPER_STORE_RECORD_MAX, "ports have room for it");

taper_settings_t taper_settings_none(void) {
    return (taper_settings_t){
        .limit_W = TAPER_ABSENT,
        .failsafe_W = TAPER_ABSENT,
        .min_ac_mA = TAPER_ABSENT,
        .min_dc_mA = TAPER_ABSENT,
        .price_weight_permille = TAPER_ABSENT,
    };
}

taper_settings_t taper_settings_cautious(const taper_station_config_t *built) {
    taper_settings_t settings = taper_settings_none();
    settings.limit_W = taper_max_i32(built->failsafe_W, 1); /* a site without any is no site */
    return settings;
}

/* ---- In the store */

static void put_body(taper_writer_t to, const taper_settings_t *settings) {
    taper_put_i32(&to, settings->limit_W);
    taper_put_i32(&to, settings->failsafe_W);
    taper_put_i32(&to, settings->min_ac_mA);
    taper_put_i32(&to, settings->min_dc_mA);
    taper_put_i32(&to, settings->price_weight_permille);
    taper_put_u32(&to, settings->tick_ms);
    taper_put_u16(&to, settings->iterations_per_tick);
    taper_put_u8(&to, settings->proposer);
    taper_put_u8(&to, 0);
}

static taper_settings_t get_body(taper_reader_t from) {
    taper_settings_t settings;
    memset(&settings, 0, sizeof settings);
    settings.limit_W = taper_get_i32(&from);
    settings.failsafe_W = taper_get_i32(&from);
    settings.min_ac_mA = taper_get_i32(&from);
    settings.min_dc_mA = taper_get_i32(&from);
    settings.price_weight_permille = taper_get_i32(&from);
    settings.tick_ms = taper_get_u32(&from);
    settings.iterations_per_tick = taper_get_u16(&from);
    settings.proposer = taper_get_u8(&from);
    return settings;
}

/** Nothing is kept between two calls: settings are read once and written seldom. */
static taper_stored_area_t area_of(const taper_port_t *port, uint8_t bytes[TAPER_STORED_ENVELOPE + BODY]) {
    return (taper_stored_area_t){.port = port,
                                 .bytes = bytes,
                                 .capacity = TAPER_STORED_ENVELOPE + BODY,
                                 .area = TAPER_STORE_SETTINGS,
                                 .layout = LAYOUT};
}

taper_stored_t taper_settings_load(const taper_port_t *port, const taper_station_config_t *built,
                                   taper_settings_t *settings) {
    uint8_t bytes[TAPER_STORED_ENVELOPE + BODY];
    taper_stored_area_t area = area_of(port, bytes);
    uint32_t length = 0;
    taper_stored_t found = taper_stored_read(&area, &length);
    const bool good = found == TAPER_STORED_GOOD || found == TAPER_STORED_OLD_COPY;
    if (good && length == BODY) {
        *settings = get_body((taper_reader_t){bytes + TAPER_STORED_HEADER});
        if (!area.copies_agree) {
            (void)taper_stored_write_twin(&area, BODY); /* in vain: the next load tries again */
        }
        return found;
    }
    found = good ? TAPER_STORED_OTHER : found;
    *settings = found == TAPER_STORED_NONE ? taper_settings_none() : taper_settings_cautious(built);
    return found;
}

bool taper_settings_save(const taper_port_t *port, const taper_settings_t *settings) {
    uint8_t bytes[TAPER_STORED_ENVELOPE + BODY];
    taper_stored_area_t area = area_of(port, bytes);
    uint32_t length = 0;
    if (!taper_stored_is_there(port)) {
        return false;
    }
    (void)taper_stored_read(&area, &length);
    put_body((taper_writer_t){bytes + TAPER_STORED_HEADER}, settings);
    return taper_stored_write(&area, BODY) && taper_stored_write_twin(&area, BODY);
}

/* ---- Into a description */

static void take_built(const taper_station_config_t *built, taper_site_t *site) {
    site->config = *built;
    if (built->group_count > TAPER_MAX_GROUPS || built->connector_count > TAPER_MAX_CONNECTORS) {
        return; /* the check refuses it as it is */
    }
    memcpy(site->groups, built->groups, built->group_count * sizeof site->groups[0]);
    memcpy(site->connectors, built->connectors, built->connector_count * sizeof site->connectors[0]);
    site->config.groups = site->groups;
    site->config.connectors = site->connectors;
}

static int32_t chosen(int32_t setting, int32_t described) {
    return setting == TAPER_ABSENT ? described : setting;
}

/** Whether a setting lowers what is described, or says nothing. */
static bool lowers(int32_t setting, int32_t described) {
    return setting == TAPER_ABSENT || (setting >= 0 && setting <= described);
}

static void set_minimum(taper_connector_config_t *connector, int32_t min_mA) {
    connector->min_mA = chosen(min_mA, connector->min_mA);
    if (connector->fallback_mA < connector->min_mA) {
        connector->fallback_mA = 0;
    }
}

static void set_all(const taper_settings_t *settings, taper_site_t *site) {
    taper_station_config_t *config = &site->config;
    site->groups[0].limit_W = chosen(settings->limit_W, site->groups[0].limit_W);
    config->failsafe_W =
        taper_min_i32(chosen(settings->failsafe_W, config->failsafe_W), site->groups[0].limit_W);
    config->price_weight_permille = chosen(settings->price_weight_permille, config->price_weight_permille);
    config->tick_ms = settings->tick_ms == 0 ? config->tick_ms : settings->tick_ms;
    for (uint8_t i = 0; i < config->connector_count; i++) {
        set_minimum(&site->connectors[i],
                    site->connectors[i].is_dc ? settings->min_dc_mA : settings->min_ac_mA);
    }
}

static bool are_in_range(const taper_settings_t *settings, const taper_station_config_t *built) {
    return lowers(settings->limit_W, built->groups[0].limit_W) &&
           lowers(settings->failsafe_W, built->failsafe_W) && settings->proposer <= TAPER_PROPOSER_LLF &&
           settings->iterations_per_tick <= TAPER_MAX_ITERATIONS;
}

taper_status_t taper_settings_apply(const taper_settings_t *settings, const taper_station_config_t *built,
                                    taper_site_t *site) {
    take_built(built, site);
    if (taper_config_check(built) != TAPER_OK || !are_in_range(settings, built)) {
        return TAPER_ERR_CONFIG;
    }
    set_all(settings, site);
    if (taper_config_check(&site->config) != TAPER_OK) {
        take_built(built, site);
        return TAPER_ERR_CONFIG;
    }
    return TAPER_OK;
}
