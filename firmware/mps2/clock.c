#include "clock.h"

#include "registers.h"

#define CYCLES_PER_ms (MPS2_CLOCK_Hz / 1000u)
#define CYCLES_PER_us (MPS2_CLOCK_Hz / 1000000u)

_Static_assert(MPS2_INSTRUCTIONS_PER_CYCLE *MPS2_CLOCK_Hz == 1000000000u, "an instruction is a nanosecond");

static volatile uint32_t milliseconds;
static uint32_t microseconds, counted; // and the cycles that they stand for

void mps2_systick_interrupt(void);

void mps2_systick_interrupt(void) {
    milliseconds++;
}

void mps2_clock_start(void) {
    MPS2_TIMER0->reload = UINT32_MAX;
    MPS2_TIMER0->value = UINT32_MAX;
    MPS2_TIMER0->control = MPS2_TIMER_ON;
    MPS2_SYSTICK_RELOAD = CYCLES_PER_ms - 1u;
    MPS2_SYSTICK_VALUE = 0;
    MPS2_SYSTICK_CONTROL = MPS2_SYSTICK_ON;
}

uint32_t mps2_clock_ms(void) {
    return milliseconds;
}

void mps2_clock_stop(void) {
    MPS2_SYSTICK_CONTROL = 0;
}

uint32_t mps2_clock_cycles(void) {
    return UINT32_MAX - MPS2_TIMER0->value;
}

uint32_t mps2_clock_us(void) {
    const uint32_t passed_us = (mps2_clock_cycles() - counted) / CYCLES_PER_us;
    microseconds += passed_us;
    counted += passed_us * CYCLES_PER_us;
    return microseconds;
}
