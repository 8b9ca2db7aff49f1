/** Instructions of the core that C has no words for. */
#ifndef MPS2_CORE_H
#define MPS2_CORE_H

#include <stdint.h>

/** Interrupts off. @return what mps2_interrupts_restore() takes. */
static inline uint32_t mps2_interrupts_off(void) {
    uint32_t state;
    __asm volatile("mrs %0, primask\n cpsid i" : "=r"(state)::"memory");
    return state;
}

static inline void mps2_interrupts_restore(uint32_t state) {
    __asm volatile("msr primask, %0" ::"r"(state) : "memory");
}

/** Sleep until an interrupt is pending, even one that is off by mps2_interrupts_off(). */
static inline void mps2_wait_for_interrupt(void) {
    __asm volatile("dsb\n wfi" ::: "memory");
}

#endif
