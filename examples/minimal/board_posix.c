/* The board is a PC: the bus is SLCAN on stdin and stdout, and its end asks to stop. */
#define _POSIX_C_SOURCE 200809L

#include <poll.h>
#include <time.h>
#include <unistd.h>

#include "board.h"
#include "taper/slcan.h"

static taper_slcan_t slcan;
static bool has_ended;

static bool is_ready(int file, short event, int timeout_ms) {
    struct pollfd poll_fd = {.fd = file, .events = event};
    return poll(&poll_fd, 1, timeout_ms) > 0;
}

static size_t read_some(void *context, uint8_t *data, size_t size) {
    (void)context;
    if (has_ended || !is_ready(STDIN_FILENO, POLLIN, 0)) {
        return 0;
    }
    const ssize_t count = read(STDIN_FILENO, data, size);
    has_ended = count <= 0;
    return has_ended ? 0 : (size_t)count;
}

static size_t write_some(void *context, const uint8_t *data, size_t size) {
    (void)context;
    if (!is_ready(STDOUT_FILENO, POLLOUT, 0)) {
        return 0;
    }
    const ssize_t count = write(STDOUT_FILENO, data, size);
    return count < 0 ? 0 : (size_t)count;
}

/* Extended frames are not for a station. */
static void pump(void) {
    taper_slcan_message_t extended;
    do {
        taper_slcan_pump(&slcan, board_now_ms());
    } while (taper_slcan_take_extended(&slcan, &extended));
}

taper_port_t board_start(void) {
    const taper_stream_t stream = {.read = read_some, .write = write_some};
    taper_slcan_init(&slcan, &stream);
    return taper_slcan_port(&slcan);
}

uint32_t board_now_ms(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)now.tv_sec * 1000u + (uint32_t)(now.tv_nsec / 1000000);
}

void board_wait_ms(uint32_t duration_ms) {
    pump(); /* what the station sent */
    (void)is_ready(STDIN_FILENO, has_ended ? 0 : POLLIN, (int)duration_ms);
    pump(); /* what it will receive */
}

bool board_is_up(void) {
    return !has_ended;
}
