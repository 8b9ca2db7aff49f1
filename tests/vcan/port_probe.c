/**
 * The SocketCAN port by hand: does what stdin says, and answers on stdout.
 *
 * port_probe INTERFACE[,INTERFACE...] [ID:MASK...]   (filters, in hex)
 *
 * With REFUSE_OPTIONS in the environment, the kernel seems to refuse all options of sockets, as qemu-user does.
 *
 *   send BUS ID DATA     "sent" or "refused" (hex; no data: -)
 *   flood BUS COUNT      frames 123 with a running number; "sent N"
 *   wait BUS MS          "readable" once the bus has something to read; "silent" if it has not for so long
 *   drain                fetch from the kernel; "drained"
 *   take                 "frame BUS ID DATA LENGTH AGE_MS" for each waiting frame, then "end N"
 *   state BUS            "off" or "on"
 *   restart BUS          "asked"
 *   counters BUS         "received=N sent=N ..."
 *   overflows BUS        a number, that of all buses
 *   shift SECONDS        "shifted": the system's clock is set, for this program only
 */
#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#include "taper/socketcan.h"

static taper_socketcan_t can;
static taper_port_t port;

static time_t shift_s;

int __real_clock_gettime(clockid_t clock, struct timespec *now);
int __wrap_clock_gettime(clockid_t clock, struct timespec *now);

int __real_setsockopt(int fd, int level, int name, const void *value, socklen_t size);
int __wrap_setsockopt(int fd, int level, int name, const void *value, socklen_t size);

/* The linker puts these in the place of clock_gettime() and setsockopt(). */

int __wrap_setsockopt(int fd, int level, int name, const void *value, socklen_t size) {
    if (getenv("REFUSE_OPTIONS") != NULL) {
        errno = ENOPROTOOPT;
        return -1;
    }
    return __real_setsockopt(fd, level, name, value, size);
}

int __wrap_clock_gettime(clockid_t clock, struct timespec *now) {
    const int result = __real_clock_gettime(clock, now);
    now->tv_sec += clock == CLOCK_REALTIME ? shift_s : 0;
    return result;
}

static uint32_t now_ms(void *context) {
    (void)context;
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000);
}

static uint8_t hex(const char *text) {
    const char two[] = {text[0], text[1], '\0'};
    return (uint8_t)strtoul(two, NULL, 16);
}

static void do_send(uint8_t bus, const char *id, const char *data) {
    taper_frame_t frame = {.bus = bus, .id = (uint16_t)strtoul(id, NULL, 16)};
    for (const char *at = data; strcmp(data, "-") != 0 && at[0] != '\0' && at[1] != '\0' && frame.length < 8;
         at += 2) {
        frame.data[frame.length++] = hex(at);
    }
    puts(port.send(port.context, &frame) ? "sent" : "refused");
}

static void do_flood(uint8_t bus, uint32_t count) {
    uint32_t sent = 0;
    for (uint32_t i = 0; i < count; i++) {
        taper_frame_t frame = {.bus = bus, .id = 0x123, .length = 4};
        memcpy(frame.data, &i, sizeof i);
        sent += port.send(port.context, &frame) ? 1u : 0u;
    }
    printf("sent %u\n", (unsigned)sent);
}

static void do_wait(uint8_t bus, const char *wait_ms) {
    struct pollfd socket = {.fd = taper_socketcan_fd(&can, bus), .events = POLLIN};
    puts(poll(&socket, 1, (int)strtol(wait_ms, NULL, 10)) > 0 ? "readable" : "silent");
}

static void do_take(void) {
    unsigned count = 0;
    for (taper_frame_t frame; port.receive(port.context, &frame); count++) {
        printf("frame %u %x ", frame.bus, frame.id);
        for (unsigned i = 0; i < frame.length; i++) {
            printf("%02x", frame.data[i]);
        }
        printf("%s %u %u\n", frame.length == 0 ? "-" : "", frame.length,
               (unsigned)(now_ms(NULL) - frame.time_ms));
    }
    printf("end %u\n", count);
}

static void do_counters(uint8_t bus) {
    const taper_socketcan_counters_t *is = taper_socketcan_counters(&can, bus);
    printf("received=%u sent=%u kernel_drops=%u queue_drops=%u send_refused=%u error_frames=%u bus_off=%u "
           "downs=%u "
           "restarts=%u\n",
           (unsigned)is->received, (unsigned)is->sent, (unsigned)is->kernel_drops, (unsigned)is->queue_drops,
           (unsigned)is->send_refused, (unsigned)is->error_frames, (unsigned)is->bus_off, (unsigned)is->downs,
           (unsigned)is->restarts);
}

static void obey(const char *word, uint8_t bus, const char *second, const char *third) {
    if (strcmp(word, "send") == 0) {
        do_send(bus, second, third);
    } else if (strcmp(word, "flood") == 0) {
        do_flood(bus, (uint32_t)strtoul(second, NULL, 10));
    } else if (strcmp(word, "wait") == 0) {
        do_wait(bus, second);
    } else if (strcmp(word, "drain") == 0) {
        taper_socketcan_drain(&can);
        puts("drained");
    } else if (strcmp(word, "take") == 0) {
        do_take();
    } else if (strcmp(word, "state") == 0) {
        puts(port.bus_is_off(port.context, bus) ? "off" : "on");
    } else if (strcmp(word, "restart") == 0) {
        port.restart_bus(port.context, bus);
        puts("asked");
    } else if (strcmp(word, "counters") == 0) {
        do_counters(bus);
    } else if (strcmp(word, "shift") == 0) {
        shift_s = strtol(second, NULL, 10);
        puts("shifted");
    } else if (strcmp(word, "overflows") == 0) {
        printf("%u\n", (unsigned)port.receive_overflows(port.context));
    } else {
        printf("unknown: %s\n", word);
    }
    fflush(stdout);
}

static int open_port(int argc, char **argv) {
    static taper_socketcan_filter_t filters[TAPER_SOCKETCAN_FILTERS];
    static const char *interfaces[TAPER_SOCKETCAN_BUSES];
    taper_socketcan_options_t options = {.interfaces = interfaces, .filters = filters, .now_ms = now_ms};
    for (char *name = strtok(argv[1], ","); name != NULL && options.count < TAPER_SOCKETCAN_BUSES;
         name = strtok(NULL, ",")) {
        interfaces[options.count++] = name;
    }
    for (int i = 2; i < argc && options.filter_count < TAPER_SOCKETCAN_FILTERS; i++) {
        char *mask;
        filters[options.filter_count].id = (uint16_t)strtoul(argv[i], &mask, 16);
        filters[options.filter_count++].mask = (uint16_t)strtoul(mask + 1, NULL, 16);
    }
    char reason[200];
    if (!taper_socketcan_open(&can, &options, reason, sizeof reason)) {
        fprintf(stderr, "port_probe: %s\n", reason);
        return 1;
    }
    port = taper_socketcan_port(&can);
    return 0;
}

int main(int argc, char **argv) {
    if (argc < 2 || open_port(argc, argv) != 0) {
        return 1;
    }
    puts("ready");
    fflush(stdout);
    char line[100];
    while (fgets(line, sizeof line, stdin) != NULL) {
        char word[20] = "";
        char second[20] = "";
        char third[20] = "";
        unsigned bus = 0;
        if (sscanf(line, "%19s %u %19s %19s", word, &bus, second, third) > 0) {
            obey(word, (uint8_t)bus, second, third);
        }
    }
    taper_socketcan_close(&can);
    return 0;
}
