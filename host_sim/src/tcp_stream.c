#define _POSIX_C_SOURCE 200809L

#include "tcp_stream.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define RETRY_ms 20u

/** Host and port of "HOST:PORT", or of "[HOST]:PORT" with colons in it. @return false: it is neither. */
static bool split(const char *address, char host[256], char port[16]) {
    const char *colon = strrchr(address, ':');
    if (colon == NULL || colon == address || colon[1] == '\0') {
        return false;
    }
    const bool has_brackets = address[0] == '[' && colon[-1] == ']';
    const size_t length = (size_t)(colon - address) - (has_brackets ? 2u : 0u);
    if (length >= 256 || strlen(colon + 1) >= 16) {
        return false;
    }
    memcpy(host, address + (has_brackets ? 1 : 0), length);
    host[length] = '\0';
    memcpy(port, colon + 1, strlen(colon + 1) + 1);
    return true;
}

/** @return file descriptor; -1: errno. */
/** Where nobody listens on a port of ours, a connection can find itself, and would keep the port from who is to have it. */
static bool is_to_itself(int fd) {
    struct sockaddr_storage here = {0};
    struct sockaddr_storage there = {0};
    socklen_t here_B = sizeof here;
    socklen_t there_B = sizeof there;
    return getsockname(fd, (struct sockaddr *)&here, &here_B) == 0 &&
           getpeername(fd, (struct sockaddr *)&there, &there_B) == 0 && here_B == there_B &&
           memcmp(&here, &there, here_B) == 0;
}

static int connect_to(const struct addrinfo *place) {
    const int fd = socket(place->ai_family, place->ai_socktype, place->ai_protocol);
    const bool failed = fd >= 0 && connect(fd, place->ai_addr, place->ai_addrlen) != 0;
    if (failed || (fd >= 0 && is_to_itself(fd))) {
        const int error = failed ? errno : ECONNREFUSED;
        close(fd);
        errno = error;
        return -1;
    }
    return fd;
}

static int connect_to_any(const struct addrinfo *places) {
    int fd = -1;
    for (const struct addrinfo *place = places; place != NULL && fd < 0; place = place->ai_next) {
        fd = connect_to(place);
    }
    return fd;
}

static int64_t now_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static int connect_until(const struct addrinfo *places, int64_t end_ms) {
    const struct timespec pause = {.tv_nsec = RETRY_ms * 1000000L};
    int fd = connect_to_any(places);
    while (fd < 0 && now_ms() < end_ms) {
        nanosleep(&pause, NULL);
        fd = connect_to_any(places);
    }
    return fd;
}

static bool prepare(int fd) {
    const int on = 1;
    return setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on) == 0 &&
           fcntl(fd, F_SETFL, fcntl(fd, F_GETFL) | O_NONBLOCK) == 0;
}

bool tcp_stream_connect(tcp_stream_t *tcp, const char *address, unsigned timeout_ms, char *reason,
                        size_t reason_size) {
    const struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM};
    struct addrinfo *places = NULL;
    char host[256];
    char port[16];
    *tcp = (tcp_stream_t){.fd = -1};
    if (!split(address, host, port)) {
        snprintf(reason, reason_size, "%s: must be HOST:PORT", address);
        return false;
    }
    const int error = getaddrinfo(host, port, &hints, &places);
    if (error != 0) {
        snprintf(reason, reason_size, "%s: %s", address, gai_strerror(error));
        return false;
    }
    tcp->fd = connect_until(places, now_ms() + timeout_ms);
    freeaddrinfo(places);
    if (tcp->fd < 0 || !prepare(tcp->fd)) {
        snprintf(reason, reason_size, "%s: %s", address, strerror(errno));
        tcp_stream_close(tcp);
        return false;
    }
    return true;
}

static bool only_waits(int error) {
    return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

static size_t read_bytes(void *context, uint8_t *data, size_t size) {
    tcp_stream_t *tcp = context;
    if (tcp->is_broken || size == 0) {
        return 0;
    }
    const ssize_t count = recv(tcp->fd, data, size, 0);
    tcp->is_broken = count == 0 || (count < 0 && !only_waits(errno));
    return count > 0 ? (size_t)count : 0;
}

static size_t write_bytes(void *context, const uint8_t *data, size_t size) {
    tcp_stream_t *tcp = context;
    if (tcp->is_broken) {
        return 0;
    }
    const ssize_t count = send(tcp->fd, data, size, MSG_NOSIGNAL);
    tcp->is_broken = count < 0 && !only_waits(errno);
    return count > 0 ? (size_t)count : 0;
}

taper_stream_t tcp_stream_bytes(tcp_stream_t *tcp) {
    const taper_stream_t stream = {.context = tcp, .read = read_bytes, .write = write_bytes};
    return stream;
}

bool tcp_stream_wait(const tcp_stream_t *tcp, bool for_writing, unsigned timeout_ms) {
    struct pollfd wanted = {.fd = tcp->fd, .events = (short)(POLLIN | (for_writing ? POLLOUT : 0))};
    return poll(&wanted, 1, (int)timeout_ms) > 0;
}

void tcp_stream_close(tcp_stream_t *tcp) {
    if (tcp->fd >= 0) {
        close(tcp->fd);
    }
    tcp->fd = -1;
    tcp->is_broken = true;
}
