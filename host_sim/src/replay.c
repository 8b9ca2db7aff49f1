#include "replay.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "exit_codes.h"
#include "memory.h"
#include "replay_log.h"
#include "replay_setup.h"

/** In a log that is not the station's own, a sent frame may stand so long after its call, or before, for times are guessed. */
#define LATE_ms  900
#define EARLY_ms 200

typedef struct {
    sim_replay_log_t log;
    sim_replay_setup_t setup;
    taper_port_t port;
    taper_station_t station;
    uint64_t now_ms;    /**< of the present call */
    size_t next_input;  /**< in the log: what the station takes next, if it was received */
    size_t first_open;  /**< in the log: sent frames before this one are compared */
    bool *compared;     /**< [log.count] */
    bool differs;       /**< a difference was told */
    uint64_t setpoints; /**< reproduced */
    uint64_t others;    /**< other frames reproduced */
    uint64_t diagnoses; /**< CTRL_DIAG that differed */
    uint64_t extra;     /**< frames that the recording does not hold */
    uint64_t silent;    /**< ticks without any CTRL_STATUS in the recording */
    bool status_seen;   /**< in this call */
} replay_t;

static void print_bytes(const char *who, const taper_frame_t *frame) {
    printf(", %s ", who);
    for (unsigned i = 0; frame != NULL && i < frame->length; i++) {
        printf("%02x", (unsigned)frame->data[i]);
    }
    printf("%s", frame == NULL ? "nothing" : frame->length == 0 ? "no bytes" : "");
}

/** Tell the first difference. @param recorded, replayed NULL: no such frame */
static void tell_difference(replay_t *replay, const taper_frame_t *recorded, const taper_frame_t *replayed) {
    const taper_frame_t *frame = recorded != NULL ? recorded : replayed;
    const uint64_t wall_us = replay->log.start_us + replay->now_ms * 1000;
    if (replay->differs) {
        return;
    }
    replay->differs = true;
    printf("difference at %.3f s (%" PRIu64 ".%06" PRIu64 "): %s id %03X", (double)replay->now_ms / 1000.0,
           wall_us / 1000000, wall_us % 1000000, replay->log.interface[frame->bus], (unsigned)frame->id);
    print_bytes("recorded", recorded);
    print_bytes("replayed", replayed);
    printf("\n");
}

static bool equal(const taper_frame_t *a, const taper_frame_t *b) {
    return a->length == b->length && memcmp(a->data, b->data, a->length) == 0;
}

/** Counters of the port are in CTRL_DIAG, and no recording has them. */
static bool is_diagnosis(const taper_frame_t *frame) {
    return frame->id >> 6 == TAPER_MESSAGE_CTRL_DIAG;
}

/** Whether a sent frame with this time is surely of a later call. */
static bool is_later(const replay_t *replay, uint64_t time_ms) {
    return time_ms > replay->now_ms + (replay->log.exact ? 0 : LATE_ms);
}

/** The station's next frame that the recording holds for this call with the identifier of `frame`, or NULL. */
static sim_replay_frame_t *find_recorded(const replay_t *replay, const taper_frame_t *frame) {
    for (size_t i = replay->first_open; i < replay->log.count; i++) {
        sim_replay_frame_t *recorded = &replay->log.frame[i];
        if (recorded->sent && is_later(replay, recorded->time_ms)) {
            return NULL;
        }
        if (recorded->sent && !replay->compared[i] && recorded->frame.id == frame->id &&
            recorded->frame.bus == frame->bus) {
            return recorded;
        }
    }
    return NULL;
}

/** The next frame of the log that the station has heard by now. */
static bool receive(void *context, taper_frame_t *frame) {
    replay_t *replay = context;
    const sim_replay_log_t *log = &replay->log;
    while (replay->next_input < log->count && log->frame[replay->next_input].sent) {
        replay->next_input++;
    }
    if (replay->next_input == log->count || log->frame[replay->next_input].time_ms > replay->now_ms) {
        return false;
    }
    *frame = log->frame[replay->next_input].frame;
    frame->time_ms = (uint32_t)log->frame[replay->next_input].time_ms;
    replay->next_input++;
    return true;
}

/** What the recording does not hold was refused by the bus then, and so it is now: it leaves no gap in a counter. */
static bool compare(void *context, const taper_frame_t *frame) {
    replay_t *replay = context;
    const sim_replay_frame_t *recorded = find_recorded(replay, frame);
    if (recorded == NULL) {
        replay->extra++;
        return false;
    }
    replay->compared[recorded - replay->log.frame] = true;
    replay->status_seen = replay->status_seen || sim_replay_is_status(frame);
    if (equal(&recorded->frame, frame)) {
        *(frame->id >> 6 == TAPER_MESSAGE_SETPOINT ? &replay->setpoints : &replay->others) += 1;
    } else if (is_diagnosis(frame)) {
        replay->diagnoses++;
    } else {
        tell_difference(replay, &recorded->frame, frame);
    }
    return true;
}

/** After a call: what the recording holds up to now, and was not sent again. */
static void close_call(replay_t *replay, bool last) {
    const sim_replay_log_t *log = &replay->log;
    const uint64_t next_ms = last ? UINT64_MAX : replay->now_ms + 1;
    size_t i = replay->first_open;
    for (; i < log->count; i++) {
        const sim_replay_frame_t *frame = &log->frame[i];
        if (frame->sent && !replay->compared[i]) {
            if (frame->time_ms + (log->exact || last ? 0 : EARLY_ms) >= next_ms) {
                break;
            }
            tell_difference(replay, &frame->frame, NULL);
        }
    }
    replay->first_open = i;
}

static void call_station(replay_t *replay) {
    const uint32_t now_ms = (uint32_t)replay->now_ms;
    replay->status_seen = false;
    if (replay->now_ms >= replay->log.stop_ms) {
        taper_station_stop(&replay->station, now_ms);
    } else if (replay->now_ms % replay->setup.made.tick_ms == 0) {
        taper_station_step(&replay->station, now_ms);
        replay->silent += replay->status_seen ? 0 : 1;
    } else {
        taper_station_poll(&replay->station, now_ms);
    }
    close_call(replay, false);
}

/** The call after the present one, as the daemon makes them. */
static uint64_t next_call_ms(const replay_t *replay) {
    const uint64_t next_ms = taper_setup_next_ms(replay->now_ms, replay->setup.made.tick_ms);
    const uint64_t stop_ms = replay->log.stop_ms;
    if (replay->now_ms >= stop_ms) {
        return replay->now_ms + TAPER_SETUP_STOP_ms;
    }
    return next_ms < stop_ms ? next_ms : stop_ms;
}

static void run_calls(replay_t *replay) {
    while (!replay->differs && replay->now_ms <= replay->log.end_ms) {
        call_station(replay);
        replay->now_ms = next_call_ms(replay);
    }
    close_call(replay, true);
}

static void print_result(const replay_t *replay) {
    if (replay->silent > 0) {
        printf("%" PRIu64 " ticks have no CTRL_STATUS in the recording; they were filled in\n",
               replay->silent);
    }
    if (replay->extra > 0) {
        printf("%" PRIu64 " frames are not in the recording: taken as refused by the bus\n", replay->extra);
    }
    if (replay->diagnoses > 0) {
        printf("%" PRIu64 " CTRL_DIAG differ: they count what happened to the port\n", replay->diagnoses);
    }
    if (!replay->differs) {
        printf("%" PRIu64 " setpoints reproduced, and %" PRIu64 " other frames, in %.3f s\n",
               replay->setpoints, replay->others, (double)replay->log.end_ms / 1000.0);
    }
}

static bool init_station(replay_t *replay) {
    replay->port = (taper_port_t){.context = replay, .receive = receive, .send = compare};
    replay->setup.made.options.port = &replay->port;
    if (taper_station_init(&replay->station, &replay->setup.made.options) != TAPER_OK) {
        fprintf(stderr, "taper-sim: the firmware refuses the station with these options\n");
        return false;
    }
    return true;
}

static bool load_log(replay_t *replay, const char *file) {
    const sim_replay_setup_t *setup = &replay->setup;
    const sim_replay_source_t source = {.file = file,
                                        .names = setup->names,
                                        .name_count = setup->name_count,
                                        .buses = taper_setup_buses(&setup->made.config),
                                        .tick_ms = setup->made.tick_ms,
                                        .exact = setup->own,
                                        .start_us = setup->companion.start_us};
    return sim_replay_load(&replay->log, &source);
}

int sim_replay_run(const sim_replay_options_t *options) {
    replay_t *replay = sim_allocate(1, sizeof *replay);
    int code = sim_replay_set_up(&replay->setup, options);
    if (code == SIM_EXIT_OK && init_station(replay) && load_log(replay, options->file)) {
        replay->compared = sim_allocate(replay->log.count, sizeof *replay->compared);
        run_calls(replay);
        print_result(replay);
        code = replay->differs ? SIM_EXIT_DIFFERENT : SIM_EXIT_OK;
    } else if (code == SIM_EXIT_OK) {
        code = SIM_EXIT_INPUT;
    }
    free(replay->compared);
    sim_replay_free(&replay->log);
    free(replay);
    return code;
}
