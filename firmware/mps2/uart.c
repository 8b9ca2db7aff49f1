#include "uart.h"

#include "core.h"
#include "registers.h"

/** Close to 921,600 baud. The divider is at least 16. */
#define BAUD_DIVIDER 27u
/** A power of two. */
#define RING 256u

_Static_assert(BAUD_DIVIDER >= 16, "CMSDK UART: the least divider");
_Static_assert((RING & (RING - 1)) == 0, "free-running indices");

static uint8_t ring[RING];
static volatile uint32_t head, tail; // free-running: put at head, taken at tail

static volatile bool is_held; // the ring is full, and a byte waits in the UART

void mps2_uart_receive_interrupt(void);
void mps2_uart_transmit_interrupt(void);

void mps2_uart_start(void) {
    MPS2_UART0->baud_divider = BAUD_DIVIDER;
    MPS2_UART0->control = MPS2_UART_TX_ON | MPS2_UART_RX_ON | MPS2_UART_RX_IRQ;
    MPS2_NVIC_ENABLE = 1u << MPS2_IRQ_UART0_RX | 1u << MPS2_IRQ_UART0_TX;
}

/** Every access to the UART costs an emulator far more than an instruction: there are two for a byte. */
static void take_byte(void) {
    ring[head % RING] = (uint8_t)MPS2_UART0->data;
    head++;
}

void mps2_uart_receive_interrupt(void) {
    MPS2_UART0->interrupts = MPS2_UART_RX_EVENT;
    if (head - tail < RING) {
        take_byte();
    } else {
        is_held = true;
    }
}

/** That the UART can send again is only told to end a wait. */
void mps2_uart_transmit_interrupt(void) {
    MPS2_UART0->interrupts = MPS2_UART_TX_EVENT;
    MPS2_UART0->control &= ~MPS2_UART_TX_IRQ;
}

bool mps2_uart_has_received(void) {
    return head != tail;
}

/** The byte that found the ring full: there was no other interrupt since. */
static void take_held_byte(void) {
    const uint32_t state = mps2_interrupts_off();
    is_held = false;
    take_byte();
    mps2_interrupts_restore(state);
}

static size_t receive(void *context, uint8_t *data, size_t size) {
    (void)context;
    size_t count = 0;
    while (count < size && head != tail) {
        data[count++] = ring[tail % RING];
        tail++;
    }
    if (is_held && count > 0) {
        take_held_byte();
    }
    return count;
}

static bool can_send(void) {
    return (MPS2_UART0->state & MPS2_UART_TX_FULL) == 0;
}

/** End a sleep when the UART can send again. @return whether it can already. */
static bool ask_to_send(void) {
    const uint32_t state = mps2_interrupts_off();
    MPS2_UART0->control |= MPS2_UART_TX_IRQ;
    mps2_interrupts_restore(state);
    return can_send();
}

static size_t transmit(void *context, const uint8_t *data, size_t size) {
    (void)context;
    size_t count = 0;
    while (count < size && (can_send() || ask_to_send())) {
        MPS2_UART0->data = data[count++];
    }
    return count;
}

taper_stream_t mps2_uart_stream(void) {
    return (taper_stream_t){.read = receive, .write = transmit};
}
