#include "protect.h"

#include "memory.h"
#include "registers.h"

// ARMv7-M, B3.5: fields of the region's size and attributes.
#define ENABLED    (1u << 0)
#define SIZE(bits) (((bits) - 1u) << 1)  // of 2^bits bytes
#define CODE       (1u << 17)            // normal memory, write-through
#define RAM        (1u << 19 | 3u << 16) // normal memory, write-back, allocated on writes
#define DEVICE     (1u << 16)
#define READ_WRITE (1u << 24)
#define READ_ONLY  (5u << 24)
#define NEVER_RUN  (1u << 28)

#define CODE_BITS        22u // 4 MiB at 0
#define PERIPHERALS      0x40000000u
#define PERIPHERALS_BITS 16u // 64 KiB

static void set_region(uint32_t number, uint32_t base, uint32_t attributes) {
    MPS2_MPU_REGION = number;
    MPS2_MPU_BASE = base;
    MPS2_MPU_SIZE = attributes | ENABLED;
}

/** The linker script sees to it that the RAM's size is a power of two. */
static uint32_t ram_bits(void) {
    const uint32_t size = (uint32_t)((uintptr_t)mps2_ram_end - (uintptr_t)mps2_ram_start);
    return 31u - (uint32_t)__builtin_clz(size);
}

void mps2_protect_start(void) {
    set_region(0, 0, CODE | READ_ONLY | SIZE(CODE_BITS));
    set_region(1, (uint32_t)(uintptr_t)mps2_ram_start, RAM | READ_WRITE | NEVER_RUN | SIZE(ram_bits()));
    set_region(2, PERIPHERALS, DEVICE | READ_WRITE | NEVER_RUN | SIZE(PERIPHERALS_BITS));
    MPS2_MPU_CONTROL = MPS2_MPU_ON;
    __asm volatile("dsb\n isb" ::: "memory");
}
