/* The daemon's port: SocketCAN on vcan0, and its store in files. As root of tools/with-vcan: a jam is made with tc. */
#define _GNU_SOURCE
#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "board.h"
#include "rig.h"
#include "taper/socketcan.h"
#include "unity.h"

#define INTERFACE "vcan0"
/** A jam: the interface takes some 150 frames a second, and the socket has room for a few that wait. */
#define JAM "tbf rate 20kbit burst 100 limit 1mb"
#define TC  "PATH=$PATH:/usr/sbin:/sbin tc "

static taper_socketcan_t can;
static taper_port_t can_port;
static taper_notify_t notify = {.fd = -1};
static taper_board_t board;
static taper_port_t port;
static int world = -1;
static char folder[64];
static char store[80];
static uint64_t offset_ms; /**< of the station's clock to CLOCK_MONOTONIC */

/* ---- Time */

static uint64_t steady_ms(void) {
    return taper_board_steady_us() / 1000;
}

static uint32_t now_ms(void) {
    return (uint32_t)(steady_ms() + offset_ms);
}

static uint32_t clock_of_can(void *context) {
    (void)context;
    return now_ms();
}

static void pass_ms(uint32_t ms) {
    const struct timespec pause = {.tv_sec = ms / 1000, .tv_nsec = (long)(ms % 1000) * 1000000L};
    nanosleep(&pause, NULL);
}

static void begin_call(void) {
    taper_board_set_time(&board, steady_ms() + offset_ms);
}

/* ---- The world's end */

static void open_world(void) {
    const int on = 1;
    const can_err_mask_t no_errors = 0;
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(INTERFACE)};
    world = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
    TEST_ASSERT_TRUE_MESSAGE(world >= 0 && address.can_ifindex > 0,
                             "no " INTERFACE ": tools/with-vcan makes it");
    TEST_ASSERT_EQUAL_INT(0, setsockopt(world, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on));
    TEST_ASSERT_EQUAL_INT(0,
                          setsockopt(world, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &no_errors, sizeof no_errors));
    TEST_ASSERT_EQUAL_INT(0, bind(world, (struct sockaddr *)&address, sizeof address));
}

static void say_raw(const void *frame, size_t size) {
    while (write(world, frame, size) != (ssize_t)size) {
        TEST_ASSERT_EQUAL_INT_MESSAGE(ENOBUFS, errno, "the world cannot send");
        pass_ms(1);
    }
}

static void say(const taper_frame_t *frame) {
    struct can_frame out = {.can_id = frame->id, .can_dlc = frame->length};
    memcpy(out.data, frame->data, frame->length);
    say_raw(&out, sizeof out);
}

static void say_bad(rig_bad_t kind) {
    static const canid_t id[RIG_BAD_KINDS] = {
        [RIG_REMOTE] = CAN_RTR_FLAG | 0x123u,
        [RIG_EXTENDED] = CAN_EFF_FLAG | 0x123u,
        [RIG_EXTENDED_REMOTE] = CAN_EFF_FLAG | CAN_RTR_FLAG | 0x123u,
        [RIG_ERROR] = CAN_ERR_FLAG | CAN_ERR_CRTL,
        [RIG_FD] = 0x123u,
    };
    if (kind == RIG_FD) {
        const struct canfd_frame frame = {.can_id = id[kind], .len = 48};
        say_raw(&frame, sizeof frame);
    } else {
        const struct can_frame frame = {.can_id = id[kind], .can_dlc = 8};
        say_raw(&frame, sizeof frame);
    }
}

/** vcan delivers at once. The daemon fetches frames when its socket has some, not when the station wants them. */
static void settle(void) {
    taper_socketcan_drain(&can);
}

static bool hear(taper_frame_t *frame, uint32_t wait_ms) {
    struct pollfd readable = {.fd = world, .events = POLLIN};
    struct can_frame in;
    if (poll(&readable, 1, (int)wait_ms) <= 0) {
        return false;
    }
    TEST_ASSERT_EQUAL_INT((int)sizeof in, (int)read(world, &in, sizeof in));
    TEST_ASSERT_EQUAL_HEX32(in.can_id & CAN_SFF_MASK, in.can_id);
    *frame = (taper_frame_t){.id = (uint16_t)in.can_id, .length = in.can_dlc};
    memcpy(frame->data, in.data, sizeof frame->data);
    return true;
}

static bool is_jammed;

static bool nothing_is_delayed(void) {
    char line[200];
    bool is_empty = false;
    FILE *answer = popen(TC "-s qdisc show dev " INTERFACE, "r");
    TEST_ASSERT_NOT_NULL(answer);
    while (fgets(line, sizeof line, answer) != NULL) {
        is_empty = is_empty || strstr(line, "backlog 0b 0p") != NULL;
    }
    TEST_ASSERT_EQUAL_INT(0, pclose(answer));
    return is_empty;
}

/** What was taken leaves first: an interface that loses its discipline loses what is in it. */
static void jam(bool jammed) {
    for (uint32_t waited_ms = 0; !jammed && !nothing_is_delayed(); waited_ms += 20) {
        TEST_ASSERT_TRUE_MESSAGE(waited_ms < RIG_PATIENCE_ms, "a jam without end");
        pass_ms(20);
    }
    TEST_ASSERT_EQUAL_INT_MESSAGE(
        0,
        system(jammed ? TC "qdisc add dev " INTERFACE " root " JAM : TC "qdisc del dev " INTERFACE " root"),
        "tc: run it by tools/with-vcan -r");
    is_jammed = jammed;
}

static void bus_off(void) {
    const struct can_frame frame = {.can_id = CAN_ERR_FLAG | CAN_ERR_BUSOFF, .can_dlc = CAN_ERR_DLC};
    say_raw(&frame, sizeof frame);
}

/* ---- The station's end */

static void open_port(void) {
    static const char *const interfaces[] = {INTERFACE};
    const taper_socketcan_options_t options = {.interfaces = interfaces, .count = 1, .now_ms = clock_of_can};
    char reason[200];
    TEST_ASSERT_TRUE_MESSAGE(taper_socketcan_open(&can, &options, reason, sizeof reason), reason);
    can_port = taper_socketcan_port(&can);
    taper_board_init(&board, &can_port, NULL, &notify, store);
    port = taper_board_port(&board);
    begin_call();
}

static void start(uint32_t begin_ms) {
    snprintf(folder, sizeof folder, "/tmp/taper-ports.XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    snprintf(store, sizeof store, "%s/store", folder);
    offset_ms = (UINT64_C(1) << 32) + begin_ms - (uint32_t)steady_ms();
    open_port();
    open_world();
}

static uint32_t record_max(void) {
    return TAPER_STORE_RECORD_MAX;
}

static void restart(void) {
    taper_socketcan_close(&can);
    open_port();
}

static void remove_store(void) {
    static const char *const names[] = {"store.0", "store.1", "store.settings.0", "store.settings.1"};
    char path[160];
    for (unsigned i = 0; i < sizeof names / sizeof names[0]; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        (void)unlink(path);
    }
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, rmdir(folder), "the store left files behind");
}

static void stop(void) {
    if (is_jammed) {
        jam(false);
    }
    taper_socketcan_close(&can);
    close(world);
    remove_store();
}

const rig_t rig = {
    .name = "socketcan",
    .has = {.kick_watchdog = true,
            .clock_us = true,
            .bus_is_off = true,
            .receive_overflows = true,
            .store = true},
    .carries = {[RIG_REMOTE] = true,
                [RIG_EXTENDED] = true,
                [RIG_EXTENDED_REMOTE] = true,
                [RIG_ERROR] = true,
                [RIG_FD] = true},
    .port = &port,
    .start = start,
    .stop = stop,
    .now_ms = now_ms,
    .pass_ms = pass_ms,
    .begin_call = begin_call,
    .say = say,
    .say_bad = say_bad,
    .settle = settle,
    .hear = hear,
    .jam = jam,
    .bus_off = bus_off,
    .record_max = record_max,
    .restart = restart,
};

void rig_arguments(int argc, char **argv) {
    (void)argc;
    (void)argv;
}
