/* The port of an emulated board (firmware/mps2): its UART0 is the bus, and by its UART1 we call it (board/remote.h). */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "board/remote.h"
#include "rig.h"
#include "slcan_world.h"
#include "unity.h"

#define EMULATOR "qemu-system-arm"
/** REMOTE_WORDS has room for them. */
#define RECEIVED_AT_ONCE 100u

static const char *image;
static const char *machine;
static pid_t emulator;
static int bus_fd = -1;
static int control_fd = -1;
static slcan_world_t world, control;
static taper_port_t port;

/* ---- Sockets as streams */

static size_t read_socket(void *context, uint8_t *data, size_t size) {
    const ssize_t count = recv(*(const int *)context, data, size, 0);
    TEST_ASSERT_TRUE_MESSAGE(count != 0 && (count > 0 || errno == EAGAIN), "the emulator is gone");
    return count > 0 ? (size_t)count : 0;
}

static size_t write_socket(void *context, const uint8_t *data, size_t size) {
    const ssize_t count = send(*(const int *)context, data, size, MSG_NOSIGNAL);
    TEST_ASSERT_TRUE_MESSAGE(count >= 0 || errno == EAGAIN, "the emulator is gone");
    return count > 0 ? (size_t)count : 0;
}

static void wait_for_bytes(void *context) {
    struct pollfd readable = {.fd = *(const int *)context, .events = POLLIN};
    (void)poll(&readable, 1, 1);
}

/** A pair of sockets: ours, which does not block, and the emulator's. */
static int make_pair(int *ours) {
    int pair[2];
    TEST_ASSERT_EQUAL_INT(0, socketpair(AF_UNIX, SOCK_STREAM, 0, pair));
    TEST_ASSERT_EQUAL_INT(0, fcntl(pair[0], F_SETFL, O_NONBLOCK));
    TEST_ASSERT_EQUAL_INT(0, fcntl(pair[0], F_SETFD, FD_CLOEXEC));
    *ours = pair[0];
    return pair[1];
}

/* ---- The emulator */

static _Noreturn void become_emulator(int bus, int of_control) {
    char bus_device[64];
    char control_device[64];
    snprintf(bus_device, sizeof bus_device, "socket,id=bus,fd=%d", bus);
    snprintf(control_device, sizeof control_device, "socket,id=control,fd=%d", of_control);
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    execlp(EMULATOR, EMULATOR, "-M", machine, "-display", "none", "-monitor", "none", "-nodefaults",
           "-chardev", bus_device, "-serial", "chardev:bus", "-chardev", control_device, "-serial",
           "chardev:control", "-kernel", image, (char *)NULL);
    perror(EMULATOR);
    _exit(127);
}

static void start_emulator(void) {
    const int bus = make_pair(&bus_fd);
    const int of_control = make_pair(&control_fd);
    emulator = fork();
    TEST_ASSERT_TRUE(emulator >= 0);
    if (emulator == 0) {
        become_emulator(bus, of_control);
    }
    close(bus);
    close(of_control);
}

static void stop(void) {
    kill(emulator, SIGKILL);
    (void)waitpid(emulator, NULL, 0);
    close(bus_fd);
    close(control_fd);
}

/* ---- Calls */

static taper_slcan_message_t answer_of(remote_kind_t kind) {
    taper_slcan_message_t message = {0};
    TEST_ASSERT_TRUE_MESSAGE(slcan_world_hear(&control, &message, RIG_PATIENCE_ms),
                             "the board does not answer");
    TEST_ASSERT_EQUAL_HEX8(kind, remote_kind(&message));
    return message;
}

static void say_control(taper_slcan_message_t message) {
    slcan_world_say_message(&control, &message);
}

static uint32_t ask(remote_kind_t kind, unsigned index, uint32_t argument) {
    say_control(remote_value(kind, index, argument));
    const taper_slcan_message_t answer = answer_of(REMOTE_VALUE);
    return remote_u32(&answer);
}

static void put_words(const uint8_t *data, uint32_t length) {
    for (uint32_t at = 0; at < length; at += 8) {
        uint8_t word[8] = {0};
        memcpy(word, data + at, length - at < 8 ? length - at : 8);
        say_control(remote_message(REMOTE_PUT, at / 8, word, 8));
    }
}

static void hear_words(uint8_t *data, uint32_t length) {
    for (uint32_t at = 0; at < length; at += 8) {
        const taper_slcan_message_t answer = answer_of(REMOTE_WORD);
        memcpy(data + at, answer.data, length - at < 8 ? length - at : 8);
    }
}

static void get_words(uint8_t *data, uint32_t length) {
    for (uint32_t at = 0; at < length; at += 8) {
        say_control(remote_value(REMOTE_GET, at / 8, 0));
    }
    hear_words(data, length);
}

/* ---- The station's end */

/** Frames that the board's port gave, and nobody took here yet: an answer takes long. */
static struct {
    taper_frame_t frame[RECEIVED_AT_ONCE];
    uint32_t count, taken;
} received;

static void receive_some(void) {
    say_control(remote_value(REMOTE_RECEIVE, RECEIVED_AT_ONCE, 0));
    const taper_slcan_message_t answer = answer_of(REMOTE_VALUE);
    received.count = remote_u32(&answer);
    received.taken = 0;
    TEST_ASSERT_TRUE(received.count <= RECEIVED_AT_ONCE);
    for (uint32_t i = 0; i < received.count; i++) {
        uint8_t words[16];
        hear_words(words, sizeof words);
        remote_unpack(words, &received.frame[i]);
    }
}

static bool port_receive(void *context, taper_frame_t *frame) {
    (void)context;
    if (received.taken == received.count) {
        receive_some();
    }
    if (received.taken == received.count) {
        return false;
    }
    *frame = received.frame[received.taken++];
    return true;
}

static bool port_send(void *context, const taper_frame_t *frame) {
    uint8_t words[16];
    (void)context;
    remote_pack(frame, words);
    put_words(words, sizeof words);
    return ask(REMOTE_SEND, 0, 0) != 0;
}

static void port_kick(void *context) {
    (void)context;
    (void)ask(REMOTE_KICK, 0, 0);
}

static uint32_t port_clock_us(void *context) {
    (void)context;
    return ask(REMOTE_CLOCK_US, 0, 0);
}

static uint32_t port_overflows(void *context) {
    (void)context;
    return ask(REMOTE_OVERFLOWS, 0, 0);
}

static unsigned place(unsigned area, unsigned copy) {
    return area << 4 | copy;
}

static bool port_store_read(void *context, unsigned area, unsigned copy, void *data, uint32_t length) {
    (void)context;
    if (ask(REMOTE_STORE_READ, place(area, copy), length) == 0) {
        return false;
    }
    get_words(data, length);
    return true;
}

static bool port_store_write(void *context, unsigned area, unsigned copy, const void *data, uint32_t length) {
    (void)context;
    put_words(data, length);
    return ask(REMOTE_STORE_WRITE, place(area, copy), length) != 0;
}

/** As the board's own port has it. */
static taper_port_t port_of_board(void) {
    const uint32_t has = ask(REMOTE_HAS, 0, 0);
    return (taper_port_t){
        .receive = port_receive,
        .send = port_send,
        .kick_watchdog = (has & REMOTE_HAS_KICK_WATCHDOG) != 0 ? port_kick : NULL,
        .clock_us = (has & REMOTE_HAS_CLOCK_US) != 0 ? port_clock_us : NULL,
        .receive_overflows = (has & REMOTE_HAS_RECEIVE_OVERFLOWS) != 0 ? port_overflows : NULL,
        .store_read = (has & REMOTE_HAS_STORE) != 0 ? port_store_read : NULL,
        .store_write = (has & REMOTE_HAS_STORE) != 0 ? port_store_write : NULL,
    };
}

/* ---- The rig */

static uint32_t now_ms(void) {
    return ask(REMOTE_NOW, 0, 0);
}

static void pass_ms(uint32_t ms) {
    const struct timespec pause = {.tv_nsec = 1000000L};
    const uint32_t began_ms = now_ms();
    while (now_ms() - began_ms < ms) {
        nanosleep(&pause, NULL);
    }
}

static void start(uint32_t begin_ms) {
    start_emulator();
    received.count = received.taken = 0;
    const taper_stream_t bus_stream = {.context = &bus_fd, .read = read_socket, .write = write_socket};
    const taper_stream_t control_stream = {
        .context = &control_fd, .read = read_socket, .write = write_socket};
    slcan_world_init(&world, &bus_stream, wait_for_bytes, &bus_fd);
    slcan_world_init(&control, &control_stream, wait_for_bytes, &control_fd);
    (void)answer_of(REMOTE_HELLO);
    (void)ask(REMOTE_SET_NOW, 0, begin_ms);
    port = port_of_board();
    TEST_ASSERT_EQUAL_HEX32(0, ask(REMOTE_HAS, 0, 0) & REMOTE_HAS_BUS_IS_OFF);
    slcan_world_open(&world);
}

static uint32_t record_max(void) {
    return ask(REMOTE_RECORD_MAX, 0, 0);
}

static void restart(void) {
    received.count = received.taken = 0;
    say_control(remote_value(REMOTE_RESET, 0, 0));
    (void)answer_of(REMOTE_HELLO);
}

static void say(const taper_frame_t *frame) {
    slcan_world_say_frame(&world, frame);
}

static void say_bad(rig_bad_t kind) {
    slcan_world_say_bad(&world, kind);
}

static void settle(void) {
    slcan_world_settle(&world);
}

static bool hear(taper_frame_t *frame, uint32_t wait_ms) {
    return slcan_world_hear_frame(&world, frame, wait_ms);
}

/** The world does not read: bytes wait in the socket, the emulated UART, and the board's queue. */
static void jam(bool is_jammed) {
    (void)is_jammed;
}

const rig_t rig = {
    .name = "board",
    .has = {.kick_watchdog = true, .clock_us = true, .receive_overflows = true, .store = true},
    .carries = SLCAN_WORLD_CARRIES,
    .port = &port,
    .start = start,
    .stop = stop,
    .now_ms = now_ms,
    .pass_ms = pass_ms,
    .say = say,
    .say_bad = say_bad,
    .settle = settle,
    .hear = hear,
    .jam = jam,
    .record_max = record_max,
    .restart = restart,
};

void rig_arguments(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: port_board IMAGE MACHINE\n");
        exit(2);
    }
    image = argv[1];
    machine = argv[2];
}
