/** The daemon: a station on SocketCAN, from start to stop. */
#ifndef TAPER_LINUX_DAEMON_H
#define TAPER_LINUX_DAEMON_H

#include "options.h"

/** Run until SIGTERM or SIGINT. @return the exit code; what went wrong is on stderr. One run per process. */
int taper_daemon_run(const taper_options_t *options, taper_made_t *made);

#endif
