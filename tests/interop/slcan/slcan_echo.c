/**
 * An SLCAN adapter on a pseudo-terminal, whose station answers every frame by one with the next higher identifier.
 *
 *     slcan_echo
 *
 * Prints the terminal's name, and after each line of stdin "opens=N bad_lines=N overflows=N"; ends with stdin.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include "taper/slcan.h"

static taper_slcan_t slcan;
static taper_port_t port;

static size_t read_bytes(void *context, uint8_t *data, size_t size) {
    const ssize_t count = read(*(const int *)context, data, size);
    return count > 0 ? (size_t)count : 0;
}

static size_t write_bytes(void *context, const uint8_t *data, size_t size) {
    const ssize_t count = write(*(const int *)context, data, size);
    return count > 0 ? (size_t)count : 0;
}

/** @return file descriptor of the master's side, -1: errno. The other end, kept open, is raw. */
static int open_terminal(void) {
    struct termios settings;
    const int master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) {
        return -1;
    }
    const int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    if (slave < 0 || tcgetattr(slave, &settings) != 0) {
        return -1;
    }
    cfmakeraw(&settings);
    return tcsetattr(slave, TCSANOW, &settings) == 0 ? master : -1;
}

static void answer(taper_frame_t *frame) {
    frame->id = (uint16_t)((frame->id + 1u) & 0x7FFu);
    if (!port.send(port.context, frame)) {
        fprintf(stderr, "slcan_echo: frame %x was refused\n", (unsigned)frame->id);
    }
}

/** @return whether something was answered, which has to be pumped. */
static bool serve_once(void) {
    taper_frame_t frame;
    taper_slcan_message_t message;
    bool has_answered = false;
    taper_slcan_pump(&slcan, 0);
    while (port.receive(port.context, &frame)) {
        answer(&frame);
        has_answered = true;
    }
    if (taper_slcan_take_extended(&slcan, &message)) {
        message.id++;
        taper_slcan_send_extended(&slcan, &message);
        has_answered = true;
    }
    return has_answered;
}

/** @return false: stdin has ended. */
static bool report(void) {
    char line[100];
    if (fgets(line, sizeof line, stdin) == NULL) {
        return false;
    }
    printf("opens=%u bad_lines=%u overflows=%u\n", (unsigned)slcan.opens, (unsigned)slcan.bad_lines,
           (unsigned)slcan.overflows);
    fflush(stdout);
    return true;
}

int main(void) {
    int terminal = open_terminal();
    if (terminal < 0) {
        perror("slcan_echo: no terminal");
        return 1;
    }
    const taper_stream_t stream = {.context = &terminal, .read = read_bytes, .write = write_bytes};
    taper_slcan_init(&slcan, &stream);
    port = taper_slcan_port(&slcan);
    puts(ptsname(terminal));
    fflush(stdout);
    for (;;) {
        struct pollfd wanted[] = {{.fd = terminal, .events = POLLIN}, {.fd = STDIN_FILENO, .events = POLLIN}};
        wanted[0].events = (short)(wanted[0].events | (taper_slcan_is_drained(&slcan) ? 0 : POLLOUT));
        (void)poll(wanted, 2, -1);
        while (serve_once()) {
        }
        if (wanted[1].revents != 0 && !report()) {
            return 0;
        }
    }
}
