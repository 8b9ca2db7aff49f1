#define _GNU_SOURCE // SOCK_CLOEXEC

#include "notify.h"

#include <errno.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/** A whole positive number in an environment variable, or 0. */
static uint64_t number_in(const char *variable) {
    const char *text = getenv(variable);
    char *end = NULL;
    errno = 0;
    const uint64_t value = text != NULL ? strtoull(text, &end, 10) : 0;
    return text != NULL && text[0] >= '0' && text[0] <= '9' && *end == '\0' && errno == 0 ? value : 0;
}

/** A path, or "@name" in the abstract namespace. */
static bool set_address(taper_notify_t *notify, const char *name) {
    const size_t length = name != NULL ? strlen(name) : 0;
    if (length < 2 || length >= sizeof notify->address.sun_path || (name[0] != '/' && name[0] != '@')) {
        return false;
    }
    notify->address.sun_family = AF_UNIX;
    memcpy(notify->address.sun_path, name, length);
    if (name[0] == '@') {
        notify->address.sun_path[0] = '\0';
    }
    notify->address_length = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length);
    return true;
}

void taper_notify_open(taper_notify_t *notify) {
    memset(notify, 0, sizeof *notify);
    notify->fd = -1;
    if (!set_address(notify, getenv("NOTIFY_SOCKET"))) {
        return;
    }
    notify->fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const bool ours = getenv("WATCHDOG_PID") == NULL || number_in("WATCHDOG_PID") == (uint64_t)getpid();
    notify->watchdog_us = ours ? number_in("WATCHDOG_USEC") : 0;
}

void taper_notify_say(const taper_notify_t *notify, const char *state) {
    if (notify->fd >= 0) {
        (void)sendto(notify->fd, state, strlen(state), MSG_DONTWAIT | MSG_NOSIGNAL,
                     (const struct sockaddr *)&notify->address, notify->address_length);
    }
}

void taper_notify_kick(taper_notify_t *notify, uint64_t now_us) {
    if (notify->watchdog_us == 0 ||
        (notify->kicked_us != 0 && now_us - notify->kicked_us < notify->watchdog_us / 4)) {
        return;
    }
    notify->kicked_us = now_us;
    taper_notify_say(notify, "WATCHDOG=1");
}

void taper_notify_close(taper_notify_t *notify) {
    if (notify->fd >= 0) {
        (void)close(notify->fd);
        notify->fd = -1;
    }
}
