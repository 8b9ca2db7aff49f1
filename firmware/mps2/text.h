/** A few words on UART1, for whoever debugs. They wait for the UART, but never for long. */
#ifndef MPS2_TEXT_H
#define MPS2_TEXT_H

#include <stdint.h>

void mps2_text_start(void);

void mps2_text(const char *text);

/** " name=0x12345678" */
void mps2_text_hex(const char *name, uint32_t value);

/** " name=123" */
void mps2_text_u32(const char *name, uint32_t value);

#endif
