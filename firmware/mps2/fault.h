/**
 * Faults, NMI (the watchdog's first end) and interrupts that nobody asked for: a report on UART1, then a reset.
 *
 * The safe state is silence. Who is not stepped sends nothing, and every connector goes to its fallback current by itself
 * when the validity of its setpoint ends. So nothing is sent from here, not even a farewell as taper_station_stop() would:
 * what led here may have spoilt the station's memory, and a well-formed frame of wrong content is the one thing that could do
 * harm. The reset brings a new station up, which counts every connector with what it may still draw.
 */
#ifndef MPS2_FAULT_H
#define MPS2_FAULT_H

#include <stdint.h>

/** The handler. Runs on a stack of its own: the usual one may be what ran over. */
void mps2_fault_entry(void);

/** Reset the board, all but its memory. */
_Noreturn void mps2_reset(void);

#endif
