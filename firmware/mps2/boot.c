#include "boot.h"

#include "memory.h"
#include "store.h"

#define MAGIC 0x54415052u // "TAPR"

static MPS2_NO_INIT mps2_boot_t boot;

uint32_t mps2_boot_begin(void) {
    if (boot.magic != MAGIC) {
        boot = (mps2_boot_t){.magic = MAGIC};
        mps2_store_erase();
    }
    const uint32_t fault = boot.fault;
    boot.fault = 0;
    boot.starts++;
    return fault;
}

mps2_boot_t *mps2_boot(void) {
    return &boot;
}

void mps2_boot_note_fault(uint32_t exception) {
    boot.fault = exception;
}
