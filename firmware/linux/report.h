/** What the daemon tells people besides the station's events: counters, the CAN port, the service manager's status line. */
#ifndef TAPER_LINUX_REPORT_H
#define TAPER_LINUX_REPORT_H

#include "board.h"
#include "taper/socketcan.h"
#include "taper/station.h"

/** What was told last. Zeroed is "nothing yet". */
typedef struct {
    taper_socketcan_counters_t counters[TAPER_SOCKETCAN_BUSES];
    bool off[TAPER_SOCKETCAN_BUSES];
    uint64_t ports_ms;   /**< when trouble of the buses was told */
    uint64_t summary_ms; /**< and the summary */
    uint32_t store_errors;
    int record_error;
    char status[120];
} taper_report_t;

/** What the report is about. */
typedef struct {
    const taper_station_t *station;
    const taper_socketcan_t *can;
    const char *const *interfaces; /**< [interface_count]: names of the buses */
    uint8_t interface_count;
    const taper_board_t *board;
    uint64_t missed_ticks;
} taper_reported_t;

/** After a tick: log what changed, and the summary once a minute. */
void taper_report(taper_report_t *report, const taper_reported_t *about);

/** The counters in one line. */
void taper_report_summary(const taper_reported_t *about);

#endif
