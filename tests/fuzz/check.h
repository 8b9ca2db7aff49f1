/** What must hold whatever came over the bus. Each check prints what does not, and aborts. */
#ifndef TAPER_FUZZ_CHECK_H
#define TAPER_FUZZ_CHECK_H

#include "taper/message.h"
#include "taper/station.h"

/** Every field of a decoded message is in its range of `taper/message.h`, or absent. */
void check_message(const taper_message_t *message);

/** Session table, limits, snapshot, ledger and currents after a control tick. */
void check_station(const taper_station_t *station);

/** What the station tells connectors, after a tick or a poll. Cost: small. */
void check_currents(const taper_station_t *station);

/** A setpoint that left the station is one that its connector may have. */
void check_setpoint(const taper_station_config_t *config, const taper_message_t *message);

/** Print and abort unless `holds`. */
void check_that(bool holds, const char *what, long long value);

#endif
