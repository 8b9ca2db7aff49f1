/** Words to the service manager (sd_notify(3)): a datagram to the socket in $NOTIFY_SOCKET, and the watchdog. */
#ifndef TAPER_LINUX_NOTIFY_H
#define TAPER_LINUX_NOTIFY_H

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>
#include <sys/un.h>

typedef struct {
    int fd; /**< -1: nobody listens */
    struct sockaddr_un address;
    socklen_t address_length;
    uint64_t watchdog_us; /**< 0: none is asked for */
    uint64_t kicked_us;
} taper_notify_t;

/** By the environment: NOTIFY_SOCKET, WATCHDOG_USEC, WATCHDOG_PID. Without them every call here does nothing. */
void taper_notify_open(taper_notify_t *notify);

/** Say `state`, such as "READY=1". Never blocks: a word that does not get through is lost. */
void taper_notify_say(const taper_notify_t *notify, const char *state);

/**
 * Say that all is well at `now_us` of any steady clock. Called more often than four times in the watchdog's interval, it
 * leaves some out; called twice in it, all are said.
 */
void taper_notify_kick(taper_notify_t *notify, uint64_t now_us);

void taper_notify_close(taper_notify_t *notify);

#endif
