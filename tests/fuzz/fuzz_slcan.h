/** The target for the SLCAN adapter, and an account of what was reached. */
#ifndef TAPER_FUZZ_SLCAN_H
#define TAPER_FUZZ_SLCAN_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint64_t inputs, bytes;
    uint64_t received, extended; /**< frames for the station, and beside it */
    uint64_t overflows;          /**< frames that were lost because the station took none */
    uint64_t sent;               /**< frames of the station that were heard */
    uint64_t refused, opens;
} fuzz_slcan_stats_t;

extern fuzz_slcan_stats_t fuzz_slcan_stats;

/** libFuzzer's entry. Aborts on what must not be. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
