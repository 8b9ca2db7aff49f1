#define _GNU_SOURCE // strtok_r

#include "replay_setup.h"

#include <stdio.h>
#include <string.h>

#include "exit_codes.h"

/** What was not given, as it was recorded. */
static void complete(sim_replay_setup_t *setup, const sim_replay_options_t *options) {
    const taper_companion_t *companion = &setup->companion;
    taper_setup_t *chosen = &setup->setup;
    chosen->station = options->station_given ? chosen->station : companion->station;
    chosen->limit_kw = chosen->limit_kw >= 0.0 ? chosen->limit_kw : companion->limit_W / 1000.0;
    chosen->failsafe_kw = chosen->failsafe_kw >= 0.0 ? chosen->failsafe_kw : companion->failsafe_W / 1000.0;
    chosen->tick_ms = chosen->tick_ms > 0 ? chosen->tick_ms : companion->tick_ms;
    chosen->time_scale = chosen->time_scale > 0 ? chosen->time_scale : companion->time_scale;
    chosen->iterations = chosen->iterations > 0 ? chosen->iterations : companion->iterations;
    chosen->no_planner = chosen->no_planner || !companion->planner;
    if (setup->name_count == 0) {
        setup->name_count = companion->buses;
        for (unsigned i = 0; i < companion->buses; i++) {
            setup->names[i] = companion->interface[i];
        }
    }
}

/** One line, if the station that replays is not the one that recorded: what is different about it. */
static void note_others(const sim_replay_setup_t *setup, const char *file) {
    char recorded[TAPER_COMPANION_TEXT];
    char present[TAPER_COMPANION_TEXT];
    char *recorded_rest = NULL;
    char *present_rest = NULL;
    const taper_companion_t now = taper_companion_of(
        &setup->made, setup->setup.station, setup->companion.start_us, setup->names, setup->name_count);
    (void)taper_companion_format(&setup->companion, recorded);
    (void)taper_companion_format(&now, present);
    const char *was = strtok_r(recorded, "\n", &recorded_rest);
    unsigned others = 0;
    for (char *is = strtok_r(present, "\n", &present_rest); is != NULL;
         is = strtok_r(NULL, "\n", &present_rest)) {
        if (was == NULL || strcmp(was, is) != 0) {
            if (others++ == 0) {
                fprintf(stderr, "taper-sim: note: not as %s.station says:", file);
            }
            fprintf(stderr, " %s", is);
        }
        was = was != NULL ? strtok_r(NULL, "\n", &recorded_rest) : NULL;
    }
    if (others > 0) {
        fprintf(stderr, "\n");
    }
}

int sim_replay_set_up(sim_replay_setup_t *setup, const sim_replay_options_t *options) {
    char reason[512];
    memset(setup, 0, sizeof *setup);
    setup->setup = options->setup;
    setup->name_count = options->name_count;
    for (unsigned i = 0; i < options->name_count; i++) {
        setup->names[i] = options->names[i];
    }
    const taper_companion_verdict_t verdict =
        taper_companion_read(options->file, &setup->companion, reason, sizeof reason);
    if (verdict == TAPER_COMPANION_BAD) {
        fprintf(stderr, "%s\n", reason);
        return SIM_EXIT_INPUT;
    }
    setup->own = verdict == TAPER_COMPANION_GOOD;
    if (setup->own) {
        complete(setup, options);
    } else if (!options->station_given) {
        fprintf(stderr, "taper-sim: --replay-log needs --station, for there is no %s.station\n",
                options->file);
        return SIM_EXIT_USAGE;
    }
    setup->setup.time_scale = setup->setup.time_scale > 0 ? setup->setup.time_scale : 1;
    if (!taper_setup_make(&setup->setup, &setup->made, reason, sizeof reason)) {
        fprintf(stderr, "taper-sim: %s\n", reason);
        return SIM_EXIT_USAGE;
    }
    if (setup->own) {
        note_others(setup, options->file);
    }
    return SIM_EXIT_OK;
}
