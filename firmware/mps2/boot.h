/** What the board remembers over a reset, and forgets with the power: it is in memory that no start clears. */
#ifndef MPS2_BOOT_H
#define MPS2_BOOT_H

#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t magic;       /**< a mark: the power stayed on */
    uint32_t starts;      /**< since power-on */
    uint32_t fault;       /**< number of the exception that is ending this run; 0: none */
    bool is_driven;       /**< a simulation has the clock */
    bool channel_is_open; /**< of SLCAN, in both directions: who opened it need not notice a reset */
} mps2_boot_t;

/** Call it once, at the start. @return exception that ended the run before; 0: it was none. */
uint32_t mps2_boot_begin(void);

/** The memory itself. */
mps2_boot_t *mps2_boot(void);

/** From the fault handler: writes one word. */
void mps2_boot_note_fault(uint32_t exception);

#endif
