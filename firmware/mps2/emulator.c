#include "emulator.h"

#define SYS_EXIT_EXTENDED    0x20u
#define APPLICATION_HAS_EXIT 0x20026u // ADP_Stopped_ApplicationExit

void mps2_emulator_exit(uint32_t status) {
    const uint32_t parameters[2] = {APPLICATION_HAS_EXIT, status};
    register uint32_t operation __asm("r0") = SYS_EXIT_EXTENDED;
    register const uint32_t *parameter __asm("r1") = parameters;
    __asm volatile("bkpt 0xAB" : "+r"(operation) : "r"(parameter) : "memory");
}
