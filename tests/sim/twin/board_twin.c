/**
 * A board on the host: the firmware behind SLCAN, driven as an emulated board is (taper/driven.h), on a TCP port.
 *
 *     board_twin STATION [pieces] [no-planner] [FAULT@CALL]
 *
 * Prints the port, then serves one connection after the other until it is killed. With `pieces` no more than three bytes pass
 * at a time. FAULT happens in the CALLth step or poll since the start: reset, silent, close, strange, refuse, crash.
 */
#define _POSIX_C_SOURCE 200809L

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "setup.h"
#include "taper/driven.h"
#include "taper/stations.h"

#define PIECE 3u

typedef struct {
    const char *fault; /**< NULL: none, or no more */
    unsigned long fault_call, calls;
    size_t most_bytes; /**< that pass at a time */
    int fd;
    bool is_broken;
    bool must_reset;
    taper_drive_setup_t kept;
    bool has_kept;
    taper_port_t port;
    taper_station_options_t options;
    taper_slcan_t slcan;
    taper_station_t station;
    taper_driven_t driven;
} twin_t;

static size_t at_most(const twin_t *twin, size_t size) {
    return size < twin->most_bytes ? size : twin->most_bytes;
}

static bool only_waits(void) {
    return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

static size_t read_bytes(void *context, uint8_t *data, size_t size) {
    twin_t *twin = context;
    const ssize_t count = twin->is_broken ? -1 : recv(twin->fd, data, at_most(twin, size), 0);
    if (count > 0) {
        return (size_t)count;
    }
    twin->is_broken = twin->is_broken || count == 0 || !only_waits();
    return 0;
}

/** Bytes for nobody are as good as taken. */
static size_t write_bytes(void *context, const uint8_t *data, size_t size) {
    twin_t *twin = context;
    const ssize_t count = twin->is_broken ? -1 : send(twin->fd, data, at_most(twin, size), MSG_NOSIGNAL);
    if (count >= 0) {
        return (size_t)count;
    }
    twin->is_broken = twin->is_broken || !only_waits();
    return twin->is_broken ? size : 0;
}

static void say(twin_t *twin, const char *text) {
    for (size_t done = 0; done < strlen(text);) {
        done += write_bytes(twin, (const uint8_t *)text + done, strlen(text) - done);
    }
}

static void break_down(twin_t *twin) {
    const char *fault = twin->fault;
    twin->fault = NULL;
    if (strcmp(fault, "reset") == 0) {
        twin->must_reset = true;
    } else if (strcmp(fault, "silent") == 0) {
        pause();
    } else if (strcmp(fault, "close") == 0) {
        (void)shutdown(twin->fd, SHUT_RDWR);
    } else if (strcmp(fault, "strange") == 0) {
        say(twin, "HardFault pc=1234\r");
    } else if (strcmp(fault, "refuse") == 0) {
        say(twin, "\a");
    } else if (strcmp(fault, "crash") == 0) {
        _exit(1);
    }
}

static void call_begins(void *context) {
    twin_t *twin = context;
    if (twin->fault != NULL && !twin->driven.is_hearing && ++twin->calls == twin->fault_call) {
        break_down(twin);
    }
}

/** As if an iteration took one instruction, and all else a thousand. */
static uint32_t call_ends(void *context) {
    const twin_t *twin = context;
    return 1000u + twin->driven.slice_iterations;
}

static uint32_t figure(void *context, taper_drive_figure_t which) {
    (void)context;
    return which == TAPER_DRIVE_STACK_USED_B ? 1234u : which == TAPER_DRIVE_STACK_SIZE_B ? 8192u : 0u;
}

static void keep(void *context, const taper_drive_setup_t *setup) {
    twin_t *twin = context;
    twin->kept = *setup;
    twin->has_kept = true;
}

static bool kept(void *context, taper_drive_setup_t *setup) {
    const twin_t *twin = context;
    *setup = twin->kept;
    return twin->has_kept;
}

static void reset(void *context) {
    ((twin_t *)context)->must_reset = true;
}

static void leave(void *context, uint8_t status) {
    (void)context;
    _exit(status);
}

static void boot(twin_t *twin, bool is_driven) {
    const taper_stream_t stream = {.context = twin, .read = read_bytes, .write = write_bytes};
    const taper_driven_board_t board = {.context = twin,
                                        .figure = figure,
                                        .set_up = keep,
                                        .resume = kept,
                                        .call_begins = call_begins,
                                        .call_ends = call_ends,
                                        .reset = reset,
                                        .exit = leave};
    taper_slcan_init(&twin->slcan, &stream);
    twin->port = taper_slcan_port(&twin->slcan);
    twin->options.port = &twin->port;
    taper_driven_init(&twin->driven, &twin->slcan, &twin->station, &twin->options, &board, is_driven);
}

/** Until the connection ends. */
static void serve(twin_t *twin) {
    while (!twin->is_broken) {
        (void)taper_driven_serve(&twin->driven, 0);
        if (twin->must_reset) {
            twin->must_reset = false;
            boot(twin, true);
            taper_slcan_open(&twin->slcan);
            continue;
        }
        struct pollfd wanted = {.fd = twin->fd, .events = POLLIN};
        if (!twin->is_broken) {
            (void)poll(&wanted, 1, -1);
        }
    }
}

static int listen_anywhere(void) {
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t length = sizeof address;
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    if (fd < 0 || bind(fd, (const struct sockaddr *)&address, sizeof address) != 0 || listen(fd, 1) != 0 ||
        getsockname(fd, (struct sockaddr *)&address, &length) != 0) {
        perror("board_twin");
        exit(1);
    }
    printf("%u\n", ntohs(address.sin_port));
    (void)fflush(stdout);
    return fd;
}

static bool find_station(twin_t *twin, const char *name) {
    for (unsigned i = 0; i < taper_station_count; i++) {
        if (strcmp(taper_stations[i]->name, name) == 0) {
            twin->options.config = taper_stations[i];
            twin->options.solver = taper_setup_solver(i);
            return true;
        }
    }
    return false;
}

static void accept_one(twin_t *twin, int listener) {
    const int on = 1;
    twin->fd = accept(listener, NULL, NULL);
    twin->is_broken = twin->fd < 0 || setsockopt(twin->fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on) != 0 ||
                      fcntl(twin->fd, F_SETFL, O_NONBLOCK) != 0;
}

/** A word of the command line. */
static void take_word(twin_t *twin, char *word) {
    char *at = strchr(word, '@');
    if (at != NULL) {
        *at = '\0';
        twin->fault = word;
        twin->fault_call = strtoul(at + 1, NULL, 10);
    } else if (strcmp(word, "pieces") == 0) {
        twin->most_bytes = PIECE;
    } else if (strcmp(word, "no-planner") == 0) {
        twin->options.solver = NULL;
    }
}

int main(int argc, char **argv) {
    static twin_t twin = {.most_bytes = SIZE_MAX};
    if (argc < 2 || !find_station(&twin, argv[1])) {
        fprintf(stderr, "board_twin STATION [pieces] [no-planner] [FAULT@CALL]\n");
        return 2;
    }
    for (int k = 2; k < argc; k++) {
        take_word(&twin, argv[k]);
    }
    const int listener = listen_anywhere();
    boot(&twin, false);
    for (;;) {
        accept_one(&twin, listener);
        serve(&twin);
        (void)close(twin.fd);
    }
}
