/** The parts of the adapter to each other. */
#ifndef TAPER_SLCAN_INTERNAL_H
#define TAPER_SLCAN_INTERNAL_H

#include "taper/slcan.h"

/** The longest answer, "V1013<CR>". */
#define SLCAN_ANSWER 6u

_Static_assert(sizeof((taper_slcan_t){0}.out) >= TAPER_SLCAN_LINE + SLCAN_ANSWER,
               "an answer fits behind a frame");

/** The value of `digits` (at most 8) hexadecimal digits. @return false: one of them is none. */
bool taper_slcan_get_hex(const char *text, unsigned digits, uint32_t *value);

/** Obey the line that came whole, and answer it: needs room for SLCAN_ANSWER in `out`. */
void taper_slcan_obey(taper_slcan_t *slcan);

#endif
