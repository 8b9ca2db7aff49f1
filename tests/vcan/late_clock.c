/* Loaded before the daemon's libraries: a steady clock that runs away, so that every call of the station comes too late. */
#define _GNU_SOURCE
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#define AHEAD_PER_LOOK_ms 200

int clock_gettime(clockid_t clock, struct timespec *now) {
    static long ahead_ms;
    const int result = (int)syscall(SYS_clock_gettime, clock, now);
    if (clock == CLOCK_MONOTONIC) {
        ahead_ms += AHEAD_PER_LOOK_ms;
        now->tv_sec += ahead_ms / 1000;
    }
    return result;
}
