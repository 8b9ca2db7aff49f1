#include "replay_clock.h"

#include <stdlib.h>
#include <string.h>

#include "memory.h"
#include "setup.h"
#include "taper/bus.h"

#define US_PER_MS 1000
/** A frame may seem to be sent so long before its call: what the first guess of the grid is wrong by, and drift. */
#define EARLY_us 5000
/** The clocks of the station and of the log drift apart: the grid is looked for anew in so many ticks on either side. */
#define SURROUNDINGS 16
/** Sent frames of one call follow each other closer than this. */
#define TRAIN_us 6000
/** Setpoints to one connector, of one call of a stop and the next: about 50 ms apart. No others follow so fast. */
#define STOP_LEAST_us 15000
#define STOP_MOST_us  85000

static const sim_replay_frame_t *first_status(const sim_replay_log_t *log) {
    for (size_t i = 0; i < log->count; i++) {
        if (log->frame[i].sent && sim_replay_is_status(&log->frame[i].frame)) {
            return &log->frame[i];
        }
    }
    return NULL;
}

/** Of the station's own recording, whose start is known. */
static void set_exact(sim_replay_log_t *log) {
    for (size_t i = 0; i < log->count; i++) {
        log->frame[i].time_ms = (log->frame[i].time_us - log->start_us) / US_PER_MS;
    }
}

/** The last tick that is not after `time_us`. */
static int64_t tick_us(int64_t time_us, uint32_t tick_ms) {
    const int64_t length_us = (int64_t)tick_ms * US_PER_MS;
    return (time_us < 0 ? time_us - length_us + 1 : time_us) / length_us * length_us;
}

/** The last time of the grid that is not after `time_us`. */
static int64_t call_us(int64_t time_us, uint32_t tick_ms) {
    const int64_t began_us = tick_us(time_us, tick_ms);
    const int64_t poll_us = (int64_t)TAPER_SETUP_POLL_ms * US_PER_MS;
    return began_us + (time_us - began_us) / poll_us * poll_us;
}

/** Sent frames that waited for the bus together. */
typedef struct {
    size_t end; // in the log: the first frame after it
    bool has_status;
} train_t;

/** The train that begins with the sent frame `i`. */
static train_t train_at(const sim_replay_log_t *log, size_t i) {
    train_t train = {.end = i + 1};
    uint64_t before_us = log->frame[i].time_us;
    for (; i < log->count && log->frame[i].time_us - before_us < TRAIN_us; i++) {
        const sim_replay_frame_t *frame = &log->frame[i];
        if (frame->sent) {
            train.has_status = train.has_status || sim_replay_is_status(&frame->frame);
            before_us = frame->time_us;
            train.end = i + 1;
        }
    }
    return train;
}

/** Of a frame, since time 0 of the log. */
static int64_t raw_us(const sim_replay_log_t *log, size_t i) {
    return (int64_t)(log->frame[i].time_us - log->start_us);
}

/** Time 0 as the least late of the first ticks has it: the very first takes longer, for it makes a plan. */
static void guess_start(sim_replay_log_t *log, uint64_t first_us, uint32_t tick_ms) {
    const int64_t length_us = (int64_t)tick_ms * US_PER_MS;
    log->start_us = first_us - TRAIN_us;
    int64_t least_us = INT64_MAX;
    for (size_t i = 0; i < log->count && raw_us(log, i) < SURROUNDINGS * length_us;) {
        if (!log->frame[i].sent || raw_us(log, i) < 0) {
            i++;
            continue;
        }
        const train_t train = train_at(log, i);
        if (train.has_status) { // the nearest tick
            const int64_t late_us = raw_us(log, i) - tick_us(raw_us(log, i) + length_us / 2, tick_ms);
            least_us = late_us < least_us ? late_us : least_us;
        }
        i = train.end;
    }
    log->start_us += (uint64_t)least_us;
}

/** What came before time 0 the station did not hear. */
static void drop_unheard(sim_replay_log_t *log) {
    size_t kept = 0;
    for (size_t i = 0; i < log->count; i++) {
        if (log->frame[i].sent || log->frame[i].time_us >= log->start_us) {
            log->frame[kept++] = log->frame[i];
        }
    }
    log->count = kept;
}

/** By how much the end of each tick comes after its beginning; INT64_MAX for a tick without. */
static int64_t *find_lags(const sim_replay_log_t *log, size_t ticks, uint32_t tick_ms) {
    int64_t *lag_us = sim_allocate(ticks, sizeof *lag_us);
    for (size_t k = 0; k < ticks; k++) {
        lag_us[k] = INT64_MAX;
    }
    for (size_t i = 0; i < log->count;) {
        if (!log->frame[i].sent) {
            i++;
            continue;
        }
        const train_t train = train_at(log, i);
        const int64_t began_us = tick_us(raw_us(log, i) + EARLY_us, tick_ms);
        const size_t k = (size_t)(began_us < 0 ? 0 : began_us) / ((size_t)tick_ms * US_PER_MS);
        if (train.has_status && k < ticks) {
            lag_us[k] = raw_us(log, i) - began_us;
        }
        i = train.end;
    }
    return lag_us;
}

/** The least lag around tick `k`. */
static int64_t lag_near(const int64_t *lag_us, size_t ticks, size_t k) {
    int64_t least = INT64_MAX;
    const size_t from = k < SURROUNDINGS ? 0 : k - SURROUNDINGS;
    for (size_t i = from; i < ticks && i <= k + SURROUNDINGS; i++) {
        least = lag_us[i] < least ? lag_us[i] : least;
    }
    return least == INT64_MAX ? 0 : least;
}

/** Of any other log. */
static void set_guessed(sim_replay_log_t *log, uint64_t first_us, uint32_t tick_ms) {
    guess_start(log, first_us, tick_ms);
    drop_unheard(log);
    const int64_t last_us = raw_us(log, log->count - 1);
    const size_t ticks = (size_t)(last_us / ((int64_t)tick_ms * US_PER_MS)) + 1;
    int64_t *lag_us = find_lags(log, ticks, tick_ms);
    train_t train = {0};
    int64_t called_us = 0;
    for (size_t i = 0; i < log->count; i++) {
        const int64_t tick = tick_us(raw_us(log, i), tick_ms) / ((int64_t)tick_ms * US_PER_MS);
        const int64_t time_us = raw_us(log, i) - lag_near(lag_us, ticks, (size_t)(tick < 0 ? 0 : tick));
        if (log->frame[i].sent && i >= train.end) {
            train = train_at(log, i);
            called_us = train.has_status ? tick_us(time_us + EARLY_us, tick_ms)
                                         : call_us(time_us + EARLY_us, tick_ms);
        }
        const int64_t station_us = log->frame[i].sent ? called_us : time_us;
        log->frame[i].time_ms = station_us < 0 ? 0 : (uint64_t)station_us / US_PER_MS;
    }
    free(lag_us);
}

/** Where the first connector's last setpoints stand in the log. @return whether there are so many. */
static bool last_setpoints(const sim_replay_log_t *log, size_t at[TAPER_SETUP_STOPS]) {
    const uint16_t id = TAPER_MESSAGE_SETPOINT << 6 | 1;
    unsigned found = TAPER_SETUP_STOPS;
    for (size_t i = log->count; i-- > 0 && found > 0;) {
        const sim_replay_frame_t *frame = &log->frame[i];
        if (frame->sent && frame->frame.id == id && frame->frame.bus == 0) {
            at[--found] = i;
        }
    }
    return found == 0;
}

/** Whether these are the calls of a stop: at their own distance, and no control tick after them. */
static bool is_stop(const sim_replay_log_t *log, const size_t at[TAPER_SETUP_STOPS]) {
    for (unsigned i = 1; i < TAPER_SETUP_STOPS; i++) {
        const uint64_t apart_us = log->frame[at[i]].time_us - log->frame[at[i - 1]].time_us;
        if (apart_us < STOP_LEAST_us || apart_us > STOP_MOST_us) {
            return false;
        }
    }
    for (size_t i = at[0]; i < log->count; i++) {
        if (log->frame[i].sent && sim_replay_is_status(&log->frame[i].frame)) {
            return false;
        }
    }
    return true;
}

static void find_stop(sim_replay_log_t *log) {
    size_t at[TAPER_SETUP_STOPS] = {0};
    log->stop_ms = UINT64_MAX;
    if (!last_setpoints(log, at) || !is_stop(log, at)) {
        return;
    }
    log->stop_ms =
        log->exact ? log->frame[at[0]].time_ms : (log->frame[at[0]].time_us - log->start_us) / US_PER_MS;
    unsigned call = 0;
    for (size_t i = at[0]; i < log->count; i++) {
        if (call + 1 < TAPER_SETUP_STOPS && i >= at[call + 1]) {
            call++;
        }
        if (log->frame[i].sent) {
            log->frame[i].time_ms = log->stop_ms + (uint64_t)call * TAPER_SETUP_STOP_ms;
        }
    }
}

bool sim_replay_set_clock(sim_replay_log_t *log, uint32_t tick_ms) {
    const sim_replay_frame_t *first = first_status(log);
    if (first == NULL) {
        return false;
    }
    if (log->exact) {
        set_exact(log);
    } else {
        set_guessed(log, first->time_us, tick_ms);
    }
    find_stop(log);
    for (size_t i = 0; i < log->count; i++) {
        if (log->frame[i].sent && log->frame[i].time_ms > log->end_ms) {
            log->end_ms = log->frame[i].time_ms;
        }
    }
    return true;
}
