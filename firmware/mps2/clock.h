/** Time: milliseconds by SysTick, and a finer count by TIMER0. */
#ifndef MPS2_CLOCK_H
#define MPS2_CLOCK_H

#include <stdint.h>

void mps2_clock_start(void);

/** Milliseconds since the start; wraps. */
uint32_t mps2_clock_ms(void);

/** Stop the milliseconds: a simulation has the clock. */
void mps2_clock_stop(void);

/** Microseconds since the start; wraps. To be called at least every 171 s. */
uint32_t mps2_clock_us(void);

/** Cycles of the 25 MHz clock; wraps after 171 s. */
uint32_t mps2_clock_cycles(void);

/** Instructions in a cycle of the emulator with -icount shift=0: one takes a nanosecond, and a cycle 40. */
#define MPS2_INSTRUCTIONS_PER_CYCLE 40u

#endif
