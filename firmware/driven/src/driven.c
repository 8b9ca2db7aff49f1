#include "taper/driven.h"

#include <string.h>

#include "taper/crc32.h"
#include "taper/fallback.h"

void taper_driven_init(taper_driven_t *driven, taper_slcan_t *slcan, taper_station_t *station,
                       const taper_station_options_t *options, const taper_driven_board_t *board,
                       bool is_driven) {
    memset(driven, 0, sizeof *driven);
    driven->slcan = slcan;
    driven->station = station;
    driven->options = *options;
    driven->board = *board;
    driven->is_driven = is_driven;
}

static void send(taper_driven_t *driven, taper_slcan_message_t message) {
    taper_slcan_send_extended(driven->slcan, &message);
}

/** Whoever opened the channel, or found it open after a reset. */
static void greet_newcomer(taper_driven_t *driven) {
    const taper_slcan_t *slcan = driven->slcan;
    if (slcan->is_open && (!driven->was_open || slcan->opens != driven->opens)) {
        send(driven, taper_drive_u32(TAPER_DRIVE_HELLO, 0, TAPER_DRIVE_VERSION));
    }
    driven->was_open = slcan->is_open;
    driven->opens = slcan->opens;
}

static void propose_edf(void *context, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                        taper_proposal_t *proposal) {
    (void)site_limit_W;
    taper_propose_edf(snapshot, ((const taper_station_config_t *)context)->tick_ms, proposal);
}

static void propose_llf(void *context, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                        taper_proposal_t *proposal) {
    (void)site_limit_W;
    taper_propose_llf(snapshot, ((const taper_station_config_t *)context)->tick_ms, proposal);
}

/** The station's description as the settings want it. */
static void describe(taper_driven_t *driven) {
    const taper_station_config_t *original = driven->options.config;
    driven->config = *original;
    driven->config.tick_ms = driven->setup.tick_ms;
    if (driven->setup.price_weight_permille != TAPER_ABSENT) {
        driven->config.price_weight_permille = driven->setup.price_weight_permille;
    }
    for (uint8_t i = 0; i < original->connector_count; i++) {
        driven->connectors[i] = original->connectors[i];
        if (driven->setup.min_mA != TAPER_ABSENT) {
            driven->connectors[i].min_mA = driven->setup.min_mA;
        }
    }
    driven->config.connectors = driven->connectors;
}

/** What waited for the station before, or was lost to it, is nothing to the new one. */
static void forget_frames(taper_driven_t *driven) {
    const taper_port_t *port = driven->options.port;
    taper_frame_t frame;
    while (port->receive(port->context, &frame)) {
    }
    driven->slcan->overflows = 0;
}

/** A new station by `driven->setup`. @return whether it took the settings. */
static bool make_station(taper_driven_t *driven) {
    taper_station_options_t options = driven->options;
    const uint8_t policy = driven->setup.policy;
    driven->is_driven = true;
    driven->is_ready = false;
    driven->now_ms = 0;
    driven->slice_iterations = 0;
    if (policy > TAPER_DRIVE_LLF) {
        return false;
    }
    forget_frames(driven);
    describe(driven);
    options.config = &driven->config;
    options.iterations_per_tick = driven->setup.iterations_per_tick;
    if (policy != TAPER_DRIVE_PLANNER) {
        driven->policy.propose = policy == TAPER_DRIVE_EDF ? propose_edf : propose_llf;
        driven->policy.context = &driven->config;
        options.policy = &driven->policy;
        options.solver = NULL;
    }
    driven->is_ready = taper_station_init(driven->station, &options) == TAPER_OK;
    driven->heard_instructions = driven->heard_frames = 0;
    driven->heard_since_step = driven->heard_worst = 0;
    return driven->is_ready;
}

static void finish(taper_driven_t *driven, taper_drive_kind_t kind, taper_drive_done_t *done) {
    const taper_station_t *station = driven->station;
    if (driven->is_ready) {
        done->hands_over = taper_station_hands_over(station);
        done->is_settled = taper_station_is_settled(station);
        done->mode = (uint8_t)taper_station_mode(station);
        done->plans = (uint16_t)taper_station_counter(station, TAPER_COUNTER_PLANS);
    }
    send(driven, taper_drive_done(kind, done));
}

/** The second part makes the station; both are there then. */
static void take_setup(taper_driven_t *driven, const taper_slcan_message_t *message, uint8_t part) {
    const taper_driven_board_t *board = &driven->board;
    taper_drive_done_t done = {.ok = false};
    const bool is_good = part <= 1 && taper_drive_get_setup(message, &driven->setup);
    if (is_good && part == 0) {
        return;
    }
    if (is_good && board->set_up != NULL) {
        board->set_up(board->context, &driven->setup);
    }
    done.ok = is_good && make_station(driven);
    finish(driven, TAPER_DRIVE_SETUP, &done);
}

static void resume(taper_driven_t *driven) {
    const taper_driven_board_t *board = &driven->board;
    taper_drive_done_t done = {.ok = false};
    done.ok = board->resume != NULL && board->resume(board->context, &driven->setup) && make_station(driven);
    finish(driven, TAPER_DRIVE_RESUME, &done);
}

/** A step, and how much of it was the planner's. */
static bool step(taper_driven_t *driven, uint32_t now_ms) {
    const taper_planner_t *planner = &driven->station->planner;
    const uint32_t started_ms = planner->started_ms;
    const uint16_t before = planner->iterations;
    const bool works = planner->verdict == TAPER_VERDICT_SOLVING;
    const uint16_t slices = planner->slices;
    taper_station_step(driven->station, now_ms);
    const bool is_new = planner->started_ms != started_ms;
    driven->slice_iterations = (uint16_t)(planner->iterations - (is_new ? 0 : before));
    return works || is_new || planner->slices != slices;
}

/** Frames of a driven station are taken in as they come. */
static void hear(taper_driven_t *driven) {
    const taper_driven_board_t *board = &driven->board;
    const uint32_t before = taper_station_counter(driven->station, TAPER_COUNTER_FRAMES_RECEIVED);
    driven->is_hearing = true;
    if (board->call_begins != NULL) {
        board->call_begins(board->context);
    }
    taper_station_hear(driven->station, driven->now_ms);
    const uint32_t instructions = board->call_ends != NULL ? board->call_ends(board->context) : 0;
    const uint32_t frames = taper_station_counter(driven->station, TAPER_COUNTER_FRAMES_RECEIVED) - before;
    driven->is_hearing = false;
    driven->heard_frames += frames;
    driven->heard_instructions += instructions;
    driven->heard_since_step += instructions;
    if (driven->heard_since_step > driven->heard_worst) {
        driven->heard_worst = driven->heard_since_step;
    }
}

static uint32_t frame_mean(const taper_driven_t *driven) {
    return driven->heard_frames == 0 ? 0 : (uint32_t)(driven->heard_instructions / driven->heard_frames);
}

static uint32_t kicks(const taper_driven_board_t *board) {
    return board->kicks != NULL ? board->kicks(board->context) : 0;
}

static void call_station(taper_driven_t *driven, uint8_t kind, uint32_t now_ms, taper_drive_done_t *done) {
    const taper_driven_board_t *board = &driven->board;
    const uint32_t kicks_before = kicks(board);
    if (board->call_begins != NULL) {
        board->call_begins(board->context);
    }
    switch (kind) {
    case TAPER_DRIVE_STEP:
        done->planned = step(driven, now_ms);
        driven->heard_since_step = 0;
        break;
    case TAPER_DRIVE_POLL: taper_station_poll(driven->station, now_ms); break;
    default: taper_station_stop(driven->station, now_ms); break;
    }
    done->instructions = board->call_ends != NULL ? board->call_ends(board->context) : 0;
    done->watchdog_kicked = kicks(board) != kicks_before;
}

/** A station that did not take its settings is not called. */
static void call(taper_driven_t *driven, uint8_t kind, uint32_t now_ms) {
    taper_drive_done_t done = {.ok = driven->is_ready};
    if (driven->is_ready) {
        call_station(driven, kind, now_ms, &done);
    }
    finish(driven, (taper_drive_kind_t)kind, &done);
}

static void look(taper_driven_t *driven, uint8_t connector) {
    taper_outlook_t outlook = {.soc_at_departure_permille = TAPER_ABSENT, .short_Wh = TAPER_ABSENT};
    if (driven->is_ready && connector < driven->options.config->connector_count) {
        outlook = taper_station_outlook(driven->station, connector);
    }
    send(driven, taper_drive_looked(connector, &outlook));
}

static uint32_t name_crc(const char *name) {
    return taper_crc32((const uint8_t *)name, (uint32_t)strlen(name));
}

static uint32_t figure(const taper_driven_t *driven, uint8_t index) {
    const taper_driven_board_t *board = &driven->board;
    switch (index) {
    case TAPER_DRIVE_ITERATIONS: return taper_planner_iterations(&driven->station->planner);
    case TAPER_DRIVE_SLICE_ITERATIONS: return driven->slice_iterations;
    case TAPER_DRIVE_BUILT_FOR: return driven->options.config->connector_count;
    case TAPER_DRIVE_NAME: return name_crc(driven->options.config->name);
    case TAPER_DRIVE_HAS_PLANNER: return driven->options.solver != NULL;
    case TAPER_DRIVE_FRAME_MEAN: return frame_mean(driven);
    case TAPER_DRIVE_FRAMES_WORST: return driven->heard_worst;
    default: return board->figure != NULL ? board->figure(board->context, (taper_drive_figure_t)index) : 0;
    }
}

static void tell(taper_driven_t *driven, uint8_t kind, uint8_t index) {
    uint32_t value = 0;
    if (kind == TAPER_DRIVE_FIGURE) {
        value = figure(driven, index);
    } else if (driven->is_ready && index < TAPER_COUNTERS) {
        value = taper_station_counter(driven->station, (taper_counter_t)index);
    }
    send(driven, taper_drive_u32(TAPER_DRIVE_VALUE, index, value));
}

static void leave(taper_driven_t *driven, uint8_t kind, uint8_t status) {
    const taper_driven_board_t *board = &driven->board;
    if (kind == TAPER_DRIVE_RESET && board->reset != NULL) {
        board->reset(board->context);
    } else if (kind == TAPER_DRIVE_EXIT && board->exit != NULL) {
        board->exit(board->context, status);
    }
}

/** What is not asked for here is none of ours. */
static void obey(taper_driven_t *driven, const taper_slcan_message_t *message) {
    uint8_t kind = 0;
    uint8_t index = 0;
    if (!taper_drive_split(message, &kind, &index)) {
        return;
    }
    switch (kind) {
    case TAPER_DRIVE_SETUP: take_setup(driven, message, index); break;
    case TAPER_DRIVE_TIME: driven->now_ms = taper_drive_get_u32(message); break;
    case TAPER_DRIVE_STEP:
    case TAPER_DRIVE_POLL:
    case TAPER_DRIVE_STOP: call(driven, kind, taper_drive_get_u32(message)); break;
    case TAPER_DRIVE_LOOK: look(driven, index); break;
    case TAPER_DRIVE_COUNTER:
    case TAPER_DRIVE_FIGURE: tell(driven, kind, index); break;
    case TAPER_DRIVE_RESUME: resume(driven); break;
    case TAPER_DRIVE_RESET:
    case TAPER_DRIVE_EXIT: leave(driven, kind, index); break;
    default: break;
    }
}

/** @return whether something was asked for. */
static bool serve_one(taper_driven_t *driven, uint32_t now_ms) {
    taper_slcan_message_t message;
    taper_slcan_pump(driven->slcan, driven->is_driven ? driven->now_ms : now_ms);
    greet_newcomer(driven);
    if (driven->is_driven && driven->is_ready && taper_slcan_has_frame(driven->slcan)) {
        hear(driven);
    }
    if (!taper_slcan_take_extended(driven->slcan, &message)) {
        return false;
    }
    obey(driven, &message);
    return true;
}

bool taper_driven_serve(taper_driven_t *driven, uint32_t now_ms) {
    while (serve_one(driven, now_ms)) {
    }
    return driven->is_driven;
}
