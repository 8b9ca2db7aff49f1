#include "frames_log.h"

#include "candump.h"

static void write_down(const sim_frames_log_t *log, const taper_frame_t *frame) {
    taper_candump_line_t line = {.time_us = log->time_ms * 1000u, .frame = *frame};
    char text[TAPER_CANDUMP_LINE];
    snprintf(line.interface, sizeof line.interface, "can%u", frame->bus);
    fwrite(text, 1, taper_candump_format(&line, text),
           log->file); // whoever closes the file finds what failed
}

static bool receive(void *context, taper_frame_t *frame) {
    const sim_frames_log_t *log = context;
    if (!log->inner.receive(log->inner.context, frame)) {
        return false;
    }
    if (log->file != NULL) {
        write_down(log, frame);
    }
    return true;
}

static bool send(void *context, const taper_frame_t *frame) {
    const sim_frames_log_t *log = context;
    return log->inner.send(log->inner.context, frame);
}

taper_port_t sim_frames_log_port(sim_frames_log_t *log, const taper_port_t *inner, FILE *file) {
    *log = (sim_frames_log_t){.file = file, .inner = *inner};
    return (taper_port_t){.context = log, .receive = receive, .send = send};
}
