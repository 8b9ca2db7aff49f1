/*
 * Our end of ISO-TP on a CAN interface of Linux, for another implementation to talk to.
 *
 *   isotp_peer INTERFACE echo SEND_ID RECEIVE_ID BLOCK_SIZE SEPARATION_ms CAPACITY HOLD_ms
 *   isotp_peer INTERFACE transfers
 *
 * echo sends every message back HOLD_ms after it came; a message that comes until then is told to wait. transfers is the
 * station's end of all transfers, with one connector (node 1), the clock of this computer and a log of three events; what
 * they bring goes to stdout. Both print "ready" first, and run until they are killed.
 */
#define _DEFAULT_SOURCE /* NOLINT(bugprone-reserved-identifier): what glibc asks for */
#include <errno.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "taper/transfers.h"

#define WAITS         10
#define TIMEOUT_ms    1000
#define POLL_ms       1
#define FRAMES_PER_ms 4

static const taper_connector_config_t connectors[] = {{.max_mA = 32000, .voltage_mV = 230000, .node = 1}};
static const taper_group_config_t groups[] = {{.limit_W = 22000, .parent = TAPER_NO_GROUP}};
static const taper_station_config_t station = {
    .name = "peer", .connectors = connectors, .groups = groups, .connector_count = 1, .group_count = 1};
static const taper_event_log_t events = {
    .event = {{.time_ms = 1, .unix_s = 0, .data = 0, .code = TAPER_EVENT_STARTED},
              {.time_ms = 70000, .unix_s = 1700000000, .data = -7, .code = TAPER_EVENT_CLOCK_SET},
              {.time_ms = 4000000000,
               .unix_s = 4000000000,
               .data = 9,
               .code = TAPER_EVENT_SESSION_BEGUN,
               .node = 1}},
    .count = 3};

static uint32_t now_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)now.tv_sec * 1000u + (uint32_t)(now.tv_nsec / 1000000);
}

static int fail(const char *what) {
    fprintf(stderr, "isotp_peer: %s: %s\n", what, strerror(errno));
    return EXIT_FAILURE;
}

/** A raw socket bound to `interface`, or -1. */
static int open_can(const char *interface) {
    const int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK, CAN_RAW);
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(interface)};
    if (fd >= 0 && address.can_ifindex != 0 &&
        bind(fd, (const struct sockaddr *)&address, sizeof address) == 0) {
        return fd;
    }
    return -1;
}

/** The next classic data frame with an 11-bit identifier, if there is one. */
static bool receive(int fd, taper_frame_t *frame) {
    struct can_frame raw;
    while (read(fd, &raw, sizeof raw) == (ssize_t)sizeof raw) {
        if ((raw.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) == 0) {
            *frame = (taper_frame_t){.id = (uint16_t)raw.can_id, .length = raw.can_dlc, .time_ms = now_ms()};
            memcpy(frame->data, raw.data, sizeof frame->data);
            return true;
        }
    }
    return false;
}

/** Send, but not faster than a bus of 500 kbit/s does: vcan takes everything, and loses what nobody reads in time. */
static bool send_frame(int fd, const taper_frame_t *frame) {
    static uint32_t of_ms, sent;
    const uint32_t at_ms = now_ms();
    sent = at_ms == of_ms ? sent : 0;
    of_ms = at_ms;
    if (sent == FRAMES_PER_ms) {
        return false;
    }
    sent++;
    struct can_frame raw = {.can_id = frame->id, .can_dlc = frame->length};
    memcpy(raw.data, frame->data, sizeof raw.data);
    return write(fd, &raw, sizeof raw) == (ssize_t)sizeof raw;
}

/** @return false if the socket cannot be waited for any more. */
static bool wait_for_frames(int fd) {
    struct pollfd one = {.fd = fd, .events = POLLIN};
    return poll(&one, 1, POLL_ms) >= 0;
}

static void ready(void) {
    puts("ready");
    fflush(stdout);
}

typedef struct {
    taper_isotp_t link;
    enum { LISTENING, HOLDING, SENDING } phase;
    uint32_t hold_ms, since_ms;
} echo_t;

/** A whole message goes back when it was held long enough; its buffer is free when it is out. */
static void echo_message(echo_t *echo, uint32_t at_ms) {
    uint16_t length = 0;
    const bool whole = taper_isotp_received(&echo->link, &length) == TAPER_ISOTP_DONE;
    if (echo->phase == LISTENING && whole) {
        echo->phase = HOLDING;
        echo->since_ms = at_ms;
    }
    if (echo->phase == HOLDING && taper_elapsed_ms(at_ms, echo->since_ms) >= echo->hold_ms) {
        echo->phase = SENDING;
        (void)taper_isotp_send(&echo->link, echo->link.options.buffer, length, at_ms);
    }
    if (echo->phase == SENDING && taper_isotp_sending(&echo->link) != TAPER_ISOTP_BUSY) {
        echo->phase = LISTENING;
        taper_isotp_release(&echo->link, at_ms);
    }
}

static int run_echo(int fd, char **arguments) {
    static uint8_t buffer[TAPER_ISOTP_LONGEST];
    static echo_t echo;
    const taper_isotp_options_t options = {
        .send_id = (uint16_t)strtoul(arguments[0], NULL, 0),
        .receive_id = (uint16_t)strtoul(arguments[1], NULL, 0),
        .block_size = (uint8_t)strtoul(arguments[2], NULL, 0),
        .separation_ms = (uint8_t)strtoul(arguments[3], NULL, 0),
        .waits = WAITS,
        .timeout_ms = TIMEOUT_ms,
        .buffer = buffer,
        .capacity = (uint16_t)strtoul(arguments[4], NULL, 0),
    };
    echo.hold_ms = (uint32_t)strtoul(arguments[5], NULL, 0);
    if (taper_isotp_init(&echo.link, &options) != TAPER_OK) {
        fputs("isotp_peer: these options are refused\n", stderr);
        return EXIT_FAILURE;
    }
    ready();
    while (wait_for_frames(fd)) {
        taper_frame_t frame;
        while (receive(fd, &frame)) {
            (void)taper_isotp_take(&echo.link, &frame, now_ms());
        }
        echo_message(&echo, now_ms());
        while (taper_isotp_next(&echo.link, now_ms(), &frame) && send_frame(fd, &frame)) {
            taper_isotp_sent(&echo.link, now_ms());
        }
    }
    return fail("poll");
}

static void print_curve(const taper_limit_curve_t *curve, const taper_transfer_scene_t *scene) {
    printf("curve %u", curve->count);
    for (uint16_t k = 0; k < curve->count; k++) {
        const uint32_t ahead_s = taper_elapsed_ms(curve->point[k].time_ms, scene->now_ms) / 1000;
        printf(" %u:%d", (unsigned)(scene->unix_s + ahead_s), (int)curve->point[k].limit_W);
    }
    puts("");
}

static void print_price(const taper_price_curve_t *price, const taper_transfer_scene_t *scene) {
    printf("price %u", price->count);
    for (uint16_t k = 0; k < price->count; k++) {
        const uint32_t ahead_s = taper_elapsed_ms(price->point[k].time_ms, scene->now_ms) / 1000;
        printf(" %u:%d", (unsigned)(scene->unix_s + ahead_s), (int)price->point[k].milli_per_kWh);
    }
    puts("");
}

static void take(taper_transfers_t *transfers, const taper_frame_t *frame) {
    static taper_transfer_content_t content;
    const taper_transfer_scene_t scene = {.now_ms = now_ms(),
                                          .clock_is_set = true,
                                          .unix_s = (uint32_t)time(NULL),
                                          .time_scale = 1,
                                          .events = &events};
    switch (taper_transfers_take(transfers, frame, &scene, &content)) {
    case TAPER_RESULT_CURVE:
        print_curve(&content.curve, &scene);
        taper_transfers_answer(transfers, TAPER_ANSWER_ACCEPTED, scene.now_ms);
        break;
    case TAPER_RESULT_PRICE:
        print_price(&content.price, &scene);
        taper_transfers_answer(transfers, TAPER_ANSWER_ACCEPTED, scene.now_ms);
        break;
    case TAPER_RESULT_IDENTIFIER:
        printf("identifier %u %s\n", content.connector,
               taper_transfers_identifier(transfers, content.connector));
        break;
    case TAPER_RESULT_REFUSED: puts("refused"); break;
    case TAPER_RESULT_NONE: break;
    }
    fflush(stdout);
}

static int run_transfers(int fd) {
    static taper_transfers_t transfers;
    taper_transfers_init(&transfers, &station);
    ready();
    while (wait_for_frames(fd)) {
        taper_frame_t frame;
        while (receive(fd, &frame)) {
            take(&transfers, &frame);
        }
        while (taper_transfers_next(&transfers, now_ms(), &frame) && send_frame(fd, &frame)) {
            taper_transfers_sent(&transfers, &frame, now_ms());
        }
    }
    return fail("poll");
}

int main(int argc, char **argv) {
    const bool echo = argc == 9 && strcmp(argv[2], "echo") == 0;
    const bool transfers = argc == 3 && strcmp(argv[2], "transfers") == 0;
    if (!echo && !transfers) {
        fputs(
            "usage: isotp_peer INTERFACE echo SEND_ID RECEIVE_ID BLOCK_SIZE SEPARATION_ms CAPACITY HOLD_ms\n"
            "       isotp_peer INTERFACE transfers\n",
            stderr);
        return EXIT_FAILURE;
    }
    const int fd = open_can(argv[1]);
    if (fd < 0) {
        return fail(argv[1]);
    }
    return echo ? run_echo(fd, argv + 3) : run_transfers(fd);
}
