#include "stack.h"

#include "memory.h"

#define PAINT 0xA5C35A3Cu

static uint32_t *stack_pointer(void) {
    uint32_t *pointer;
    __asm volatile("mov %0, sp" : "=r"(pointer));
    return pointer;
}

void mps2_stack_paint(void) {
    // volatile: the compiler must not make it a call of memset, whose frame would be painted over.
    for (volatile uint32_t *word = mps2_stack_limit; word < stack_pointer(); word++) {
        *word = PAINT;
    }
}

uint32_t mps2_stack_used_B(void) {
    const uint32_t *word = mps2_stack_limit;
    while (word < mps2_stack_top && *word == PAINT) {
        word++;
    }
    return (uint32_t)(mps2_stack_top - word) * sizeof *word;
}

uint32_t mps2_stack_size_B(void) {
    return (uint32_t)(mps2_stack_top - mps2_stack_limit) * sizeof *mps2_stack_top;
}
