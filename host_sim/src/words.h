/** Words for the bus's numbers, as they stand in the output: the names in taper/bus.h in lower case. */
#ifndef SIM_WORDS_H
#define SIM_WORDS_H

#include <stdint.h>

#include "taper/bus.h"

/** "init", "plan", ... */
const char *sim_mode_word(taper_mode_t mode);

/** Of a taper_reason_t: "no_vehicle", "planned", ... */
const char *sim_reason_word(uint8_t reason);

#endif
