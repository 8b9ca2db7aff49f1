/* The byte stream over TCP: an emulator that starts late, bytes both ways, one that goes away. */
#define _POSIX_C_SOURCE 200809L

#include "tcp_stream.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "unity.h"

#define PATIENCE_ms 20000u

static int listener;
static int peer;
static tcp_stream_t tcp;
static taper_stream_t stream;
static char address[64];
static char reason[200];

/** A port that nobody else has, not listened to yet. */
void setUp(void) {
    struct sockaddr_in place = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof place;
    listener = socket(AF_INET, SOCK_STREAM, 0);
    TEST_ASSERT_EQUAL_INT(0, bind(listener, (struct sockaddr *)&place, sizeof place));
    TEST_ASSERT_EQUAL_INT(0, getsockname(listener, (struct sockaddr *)&place, &size));
    snprintf(address, sizeof address, "127.0.0.1:%u", (unsigned)ntohs(place.sin_port));
    peer = -1;
    tcp = (tcp_stream_t){.fd = -1};
}

void tearDown(void) {
    tcp_stream_close(&tcp);
    if (peer >= 0) {
        close(peer);
    }
    close(listener);
}

static void connect_both(void) {
    TEST_ASSERT_EQUAL_INT(0, listen(listener, 1));
    TEST_ASSERT_TRUE_MESSAGE(tcp_stream_connect(&tcp, address, PATIENCE_ms, reason, sizeof reason), reason);
    peer = accept(listener, NULL, NULL);
    stream = tcp_stream_bytes(&tcp);
}

static void test_bytes_go_both_ways(void) {
    uint8_t data[8] = {0};
    connect_both();
    TEST_ASSERT_EQUAL_UINT(3, stream.write(stream.context, (const uint8_t *)"abc", 3));
    TEST_ASSERT_EQUAL_INT(3, recv(peer, data, 3, MSG_WAITALL));
    TEST_ASSERT_EQUAL_MEMORY("abc", data, 3);
    TEST_ASSERT_EQUAL_INT(2, send(peer, "xy", 2, 0));
    TEST_ASSERT_TRUE(tcp_stream_wait(&tcp, false, PATIENCE_ms));
    TEST_ASSERT_EQUAL_UINT(2, stream.read(stream.context, data, sizeof data));
    TEST_ASSERT_EQUAL_MEMORY("xy", data, 2);
}

static void test_reading_what_has_not_come_does_not_wait(void) {
    uint8_t data[8];
    connect_both();
    TEST_ASSERT_EQUAL_UINT(0, stream.read(stream.context, data, sizeof data));
    TEST_ASSERT_FALSE(tcp_stream_wait(&tcp, false, 1));
    TEST_ASSERT_FALSE(tcp.is_broken);
}

static void test_writing_to_one_who_does_not_read_ends_without_waiting(void) {
    static const uint8_t much[65536];
    size_t sent = 0;
    connect_both();
    for (size_t taken = 1; taken > 0; sent += taken) {
        taken = stream.write(stream.context, much, sizeof much);
    }
    TEST_ASSERT_FALSE(tcp.is_broken);
    TEST_ASSERT_TRUE(sent > 0);
}

static void test_one_who_goes_away_breaks_the_stream_once_his_last_bytes_are_read(void) {
    uint8_t data[8];
    connect_both();
    TEST_ASSERT_EQUAL_INT(2, send(peer, "xy", 2, 0));
    close(peer);
    peer = -1;
    TEST_ASSERT_TRUE(tcp_stream_wait(&tcp, false, PATIENCE_ms));
    TEST_ASSERT_EQUAL_UINT(2, stream.read(stream.context, data, sizeof data));
    while (!tcp.is_broken) { /* the end of the connection may come a moment later */
        TEST_ASSERT_TRUE(tcp_stream_wait(&tcp, false, PATIENCE_ms));
        TEST_ASSERT_EQUAL_UINT(0, stream.read(stream.context, data, sizeof data));
    }
    TEST_ASSERT_EQUAL_UINT(0, stream.write(stream.context, data, 1));
}

static void *listen_late(void *context) {
    const struct timespec pause = {.tv_nsec = 100 * 1000000L};
    (void)context;
    nanosleep(&pause, NULL);
    (void)listen(listener, 1);
    return NULL;
}

static void test_an_emulator_that_starts_late_is_waited_for(void) {
    pthread_t late;
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&late, NULL, listen_late, NULL));
    const bool connected = tcp_stream_connect(&tcp, address, PATIENCE_ms, reason, sizeof reason);
    pthread_join(late, NULL);
    TEST_ASSERT_TRUE_MESSAGE(connected, reason);
}

static void test_nobody_there_is_told_with_address_and_reason(void) {
    char expected[128];
    snprintf(expected, sizeof expected, "%s: Connection refused", address);
    TEST_ASSERT_FALSE(tcp_stream_connect(&tcp, address, 1, reason, sizeof reason));
    TEST_ASSERT_EQUAL_STRING(expected, reason);
}

static void test_an_address_without_host_or_port_is_told(void) {
    static const char *const bad[] = {"", "localhost", ":4000", "localhost:"};
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        TEST_ASSERT_FALSE(tcp_stream_connect(&tcp, bad[i], 1, reason, sizeof reason));
        TEST_ASSERT_NOT_NULL(strstr(reason, ": must be HOST:PORT"));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_bytes_go_both_ways);
    RUN_TEST(test_reading_what_has_not_come_does_not_wait);
    RUN_TEST(test_writing_to_one_who_does_not_read_ends_without_waiting);
    RUN_TEST(test_one_who_goes_away_breaks_the_stream_once_his_last_bytes_are_read);
    RUN_TEST(test_an_emulator_that_starts_late_is_waited_for);
    RUN_TEST(test_nobody_there_is_told_with_address_and_reason);
    RUN_TEST(test_an_address_without_host_or_port_is_told);
    return UNITY_END();
}
