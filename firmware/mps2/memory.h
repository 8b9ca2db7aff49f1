/** Symbols of the linker script image.ld: places, not variables. */
#ifndef MPS2_MEMORY_H
#define MPS2_MEMORY_H

#include <stdint.h>

extern uint32_t mps2_ram_start[], mps2_ram_end[]; /**< all RAM that the image may use */
/** The stack is the lowest RAM: what runs over its limit leaves the RAM, and is a fault. */
extern uint32_t mps2_stack_limit[], mps2_stack_top[];
extern uint32_t mps2_data_load[], mps2_data_start[], mps2_data_end[];
extern uint32_t mps2_bss_start[], mps2_bss_end[];
extern uint32_t mps2_fault_stack_top[];

/** Keeps its contents over a reset; at power-on it holds anything. */
#define MPS2_NO_INIT __attribute__((section(".noinit")))

#endif
