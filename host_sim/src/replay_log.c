#define _GNU_SOURCE // getline

#include "replay_log.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "candump.h"
#include "memory.h"
#include "replay_clock.h"
#include "taper/bus.h"

#define US_PER_MS 1000
#define US_PER_S  1000000

bool sim_replay_is_of_station(uint16_t id) {
    const unsigned node = id & 0x3FU;
    switch (id >> 6) {
    case TAPER_MESSAGE_SETPOINT:
    case TAPER_MESSAGE_PLAN:
    case TAPER_MESSAGE_OUTLOOK:
    case TAPER_MESSAGE_ISOTP_TO: return true;
    case TAPER_MESSAGE_EMCY:
    case TAPER_MESSAGE_CTRL_STATUS:
    case TAPER_MESSAGE_CTRL_DIAG: return node == TAPER_NODE_CONTROLLER;
    default: return false;
    }
}

bool sim_replay_is_status(const taper_frame_t *frame) {
    return frame->id == (TAPER_MESSAGE_CTRL_STATUS << 6 | TAPER_NODE_CONTROLLER);
}

/** The bus of an interface, or -1: not one of the station's. New ones are added unless they were all named before. */
static int find_bus(sim_replay_log_t *log, const char *name, bool named) {
    for (unsigned i = 0; i < log->interfaces; i++) {
        if (strcmp(log->interface[i], name) == 0) {
            return (int)i;
        }
    }
    if (named || log->interfaces == SIM_REPLAY_BUSES) {
        return -1;
    }
    (void)snprintf(log->interface[log->interfaces], sizeof log->interface[0], "%s", name);
    return (int)log->interfaces++;
}

static void add(sim_replay_log_t *log, const taper_candump_line_t *line, int bus) {
    log->frame = sim_grow(log->frame, &log->room, log->count + 1, sizeof *log->frame);
    sim_replay_frame_t *frame = &log->frame[log->count++];
    *frame = (sim_replay_frame_t){
        .time_us = line->time_us, .frame = line->frame, .sent = sim_replay_is_of_station(line->frame.id)};
    frame->frame.bus = (uint8_t)bus;
}

/** All lines of the file. A last one that was cut short is left out. */
static bool read_lines(sim_replay_log_t *log, FILE *stream, const char *file, bool named) {
    char *text = NULL;
    size_t room = 0;
    bool good = true;
    ssize_t length = 0;
    for (unsigned long number = 1; good && (length = getline(&text, &room, stream)) >= 0; number++) {
        taper_candump_line_t line;
        const taper_candump_verdict_t verdict = taper_candump_parse(text, &line);
        if (text[length - 1] != '\n') {
            fprintf(stderr, "taper-sim: note: %s: the last line is cut short, and left out\n", file);
        } else if (verdict == TAPER_CANDUMP_BAD) {
            fprintf(stderr, "taper-sim: %s: line %lu is not one of a CAN log\n", file, number);
            good = false;
        } else if (verdict == TAPER_CANDUMP_FRAME) {
            const int bus = find_bus(log, line.interface, named);
            if (bus >= 0) {
                add(log, &line, bus);
            }
        }
    }
    free(text);
    if (ferror(stream)) {
        fprintf(stderr, "taper-sim: %s: %s\n", file, strerror(errno));
        good = false;
    }
    return good;
}

/** Times of the station's own recording are whole milliseconds from its start on. */
static bool check_exact(const sim_replay_log_t *log, const char *file) {
    for (size_t i = 0; log->exact && i < log->count; i++) {
        const uint64_t time_us = log->frame[i].time_us;
        if (time_us < log->start_us || (time_us - log->start_us) % US_PER_MS != 0) {
            fprintf(stderr,
                    "taper-sim: %s: (%" PRIu64 ".%06" PRIu64 ") is no time of the recording that %s.station "
                    "tells about\n",
                    file, time_us / US_PER_S, time_us % US_PER_S, file);
            return false;
        }
    }
    return true;
}

/** What can only be checked when all lines are known. */
static bool put_on_clock(sim_replay_log_t *log, const sim_replay_source_t *source) {
    if (log->interfaces > source->buses) {
        fprintf(stderr,
                "taper-sim: %s: more interfaces than the station has buses (%u); name them by --can\n",
                source->file, source->buses);
        return false;
    }
    if (!check_exact(log, source->file)) {
        return false;
    }
    if (!sim_replay_set_clock(log, source->tick_ms)) {
        fprintf(stderr, "taper-sim: %s: no CTRL_STATUS (id 240) of the station: no control tick to replay\n",
                source->file);
        return false;
    }
    return true;
}

bool sim_replay_load(sim_replay_log_t *log, const sim_replay_source_t *source) {
    *log = (sim_replay_log_t){
        .exact = source->exact, .start_us = source->start_us, .interfaces = source->name_count};
    for (unsigned i = 0; i < source->name_count; i++) {
        (void)snprintf(log->interface[i], sizeof log->interface[0], "%s", source->names[i]);
    }
    FILE *stream = fopen(source->file, "r");
    if (stream == NULL) {
        fprintf(stderr, "taper-sim: %s: %s\n", source->file, strerror(errno));
        return false;
    }
    const bool good = read_lines(log, stream, source->file, source->name_count > 0);
    (void)fclose(stream);
    return good && put_on_clock(log, source);
}

void sim_replay_free(sim_replay_log_t *log) {
    free(log->frame);
    log->frame = NULL;
}
