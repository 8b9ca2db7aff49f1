#define _GNU_SOURCE // getline

#include "replay_log.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "candump.h"
#include "memory.h"
#include "replay_clock.h"
#include "taper/bus.h"

bool sim_replay_is_of_station(uint16_t id) {
    const unsigned node = id & 0x3FU;
    switch (id >> 6) {
    case TAPER_MESSAGE_SETPOINT:
    case TAPER_MESSAGE_PLAN:
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
        .time_us = line->time_us, .frame = line->frame, .sent = line->direction == TAPER_CANDUMP_SENT};
    frame->frame.bus = (uint8_t)bus;
    log->exact = log->exact && line->direction != TAPER_CANDUMP_NO_WORD && line->time_us % 1000 == 0;
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

/** A log of candump does not tell who sent what: the identifier does. */
static void set_directions(sim_replay_log_t *log) {
    for (size_t i = 0; i < log->count && !log->exact; i++) {
        log->frame[i].sent = sim_replay_is_of_station(log->frame[i].frame.id);
    }
}

bool sim_replay_load(sim_replay_log_t *log, const char *file, const char *const *names, unsigned name_count,
                     unsigned buses, uint32_t tick_ms) {
    *log = (sim_replay_log_t){.exact = true, .interfaces = name_count};
    for (unsigned i = 0; i < name_count; i++) {
        (void)snprintf(log->interface[i], sizeof log->interface[0], "%s", names[i]);
    }
    FILE *stream = fopen(file, "r");
    if (stream == NULL) {
        fprintf(stderr, "taper-sim: %s: %s\n", file, strerror(errno));
        return false;
    }
    bool good = read_lines(log, stream, file, name_count > 0);
    (void)fclose(stream);
    if (good && log->interfaces > buses) {
        fprintf(stderr,
                "taper-sim: %s: more interfaces than the station has buses (%u); name them by --can\n", file,
                buses);
        good = false;
    }
    set_directions(log);
    if (good && !sim_replay_set_clock(log, tick_ms)) {
        fprintf(stderr, "taper-sim: %s: no CTRL_STATUS (id 240) of the station: no control tick to replay\n",
                file);
        good = false;
    }
    return good;
}

void sim_replay_free(sim_replay_log_t *log) {
    free(log->frame);
    log->frame = NULL;
}
