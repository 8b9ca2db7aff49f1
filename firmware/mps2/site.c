#include "site.h"

#include "solver.h"
#include "taper/fallback.h"
#include "taper/stations.h"

/** Short slices: the planner has 15 minutes, the tick a few milliseconds. */
#define ITERATIONS MPS2_ITERATIONS

_Static_assert(TAPER_PROPOSER_PLANNER == TAPER_DRIVE_PLANNER + 1 &&
                   TAPER_PROPOSER_EDF == TAPER_DRIVE_EDF + 1 && TAPER_PROPOSER_LLF == TAPER_DRIVE_LLF + 1,
               "a setting is a simulation's policy and one more: 0 is nothing set");

static void propose_edf(void *config, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                        taper_proposal_t *proposal) {
    (void)site_limit_W;
    taper_propose_edf(snapshot, ((const taper_station_config_t *)config)->tick_ms, proposal);
}

static void propose_llf(void *config, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                        taper_proposal_t *proposal) {
    (void)site_limit_W;
    taper_propose_llf(snapshot, ((const taper_station_config_t *)config)->tick_ms, proposal);
}

static void set_proposer(taper_station_options_t *options, uint8_t proposer, taper_site_t *site) {
    static taper_policy_t policy;
    options->solver = mps2_solver();
    if (proposer == TAPER_PROPOSER_EDF || proposer == TAPER_PROPOSER_LLF) {
        policy.propose = proposer == TAPER_PROPOSER_EDF ? propose_edf : propose_llf;
        policy.context = &site->config;
        options->policy = &policy;
        options->solver = NULL;
    }
}

taper_station_options_t mps2_site_options(const taper_port_t *port, taper_site_t *site) {
    taper_settings_t settings;
    taper_station_options_t options = {.config = &site->config, .port = port};
    options.settings_found = taper_settings_load(port, taper_stations[0], &settings);
    if (taper_settings_apply(&settings, taper_stations[0], site) != TAPER_OK) {
        settings = taper_settings_cautious(taper_stations[0]);
        (void)taper_settings_apply(&settings, taper_stations[0], site);
    }
    options.iterations_per_tick =
        settings.iterations_per_tick > 0 ? settings.iterations_per_tick : ITERATIONS;
    set_proposer(&options, settings.proposer, site);
    return options;
}

bool mps2_site_keep(const taper_port_t *port, const taper_drive_setup_t *setup) {
    taper_settings_t settings = taper_settings_none();
    settings.min_ac_mA = settings.min_dc_mA = setup->min_mA;
    settings.price_weight_permille = setup->price_weight_permille;
    settings.tick_ms = setup->tick_ms;
    settings.iterations_per_tick = setup->iterations_per_tick;
    settings.proposer = (uint8_t)(setup->policy + 1u);
    return taper_settings_save(port, &settings);
}

bool mps2_site_kept(const taper_port_t *port, taper_drive_setup_t *setup) {
    taper_settings_t settings;
    const taper_stored_t found = taper_settings_load(port, taper_stations[0], &settings);
    if ((found != TAPER_STORED_GOOD && found != TAPER_STORED_OLD_COPY) ||
        settings.proposer == TAPER_PROPOSER_AS_BUILT) {
        return false;
    }
    *setup = (taper_drive_setup_t){.tick_ms = settings.tick_ms,
                                   .iterations_per_tick = settings.iterations_per_tick,
                                   .policy = (uint8_t)(settings.proposer - 1u),
                                   .min_mA = settings.min_ac_mA,
                                   .price_weight_permille = settings.price_weight_permille};
    return true;
}
