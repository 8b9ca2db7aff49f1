/** The station's store in memory that survives a reset, as flash or FRAM would on a real board. */
#ifndef MPS2_STORE_H
#define MPS2_STORE_H

#include <stdbool.h>
#include <stdint.h>

/** Nothing was ever written. */
void mps2_store_erase(void);

/** As store_read and store_write of taper_port_t. */
bool mps2_store_read(void *context, unsigned area, unsigned copy, void *data, uint32_t length);
bool mps2_store_write(void *context, unsigned area, unsigned copy, const void *data, uint32_t length);

/** Writes since the start of the image. */
uint32_t mps2_store_writes(void);

#endif
