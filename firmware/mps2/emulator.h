/** What only an emulator has. */
#ifndef MPS2_EMULATOR_H
#define MPS2_EMULATOR_H

#include <stdint.h>

/** End the emulator with an exit status, by semihosting. On a real board without a debugger: a fault, and a reset. */
void mps2_emulator_exit(uint32_t status);

#endif
