/** UART0 as a stream of bytes. Received bytes wait in a ring; when it is full, in the UART, and then at the sender. */
#ifndef MPS2_UART_H
#define MPS2_UART_H

#include "taper/slcan.h"

void mps2_uart_start(void);

taper_stream_t mps2_uart_stream(void);

/** Whether a byte waits. With interrupts off, this and "wait for interrupt" leave no gap. */
bool mps2_uart_has_received(void);

#endif
