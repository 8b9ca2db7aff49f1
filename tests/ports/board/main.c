/* The board's port, as its image has it, called from outside (remote.h). Instead of the station's main. */
#include <string.h>

#include "board.h"
#include "boot.h"
#include "clock.h"
#include "fault.h"
#include "registers.h"
#include "remote.h"
#include "uart.h"

#define BAUD_DIVIDER 16u

_Static_assert(REMOTE_WORDS * 8u > TAPER_STORE_RECORD_MAX, "a record that is too long fits into the buffer");

static mps2_board_t board;
static taper_slcan_t control;
static uint8_t buffer[REMOTE_WORDS * 8u];
static uint32_t offset_ms; // of the station's clock to the board's

/* ---- UART1, without interrupts */

static size_t read_uart(void *context, uint8_t *data, size_t size) {
    (void)context;
    if (size == 0 || (MPS2_UART1->state & MPS2_UART_RX_FULL) == 0) {
        return 0;
    }
    data[0] = (uint8_t)MPS2_UART1->data;
    return 1;
}

static size_t write_uart(void *context, const uint8_t *data, size_t size) {
    (void)context;
    if (size == 0 || (MPS2_UART1->state & MPS2_UART_TX_FULL) != 0) {
        return 0;
    }
    MPS2_UART1->data = data[0];
    return 1;
}

static void start_control(void) {
    const taper_stream_t stream = {.read = read_uart, .write = write_uart};
    MPS2_UART1->baud_divider = BAUD_DIVIDER;
    MPS2_UART1->control = MPS2_UART_TX_ON | MPS2_UART_RX_ON;
    taper_slcan_init(&control, &stream);
    taper_slcan_open(&control);
}

/* ---- The port */

static uint32_t now_ms(void) {
    return mps2_clock_ms() + offset_ms;
}

static uint32_t has(void) {
    const taper_port_t *port = &board.port;
    return (port->kick_watchdog != NULL ? (uint32_t)REMOTE_HAS_KICK_WATCHDOG : 0u) |
           (port->clock_us != NULL ? (uint32_t)REMOTE_HAS_CLOCK_US : 0u) |
           (port->bus_is_off != NULL || port->restart_bus != NULL ? (uint32_t)REMOTE_HAS_BUS_IS_OFF : 0u) |
           (port->receive_overflows != NULL ? (uint32_t)REMOTE_HAS_RECEIVE_OVERFLOWS : 0u) |
           (port->store_read != NULL && port->store_write != NULL ? (uint32_t)REMOTE_HAS_STORE : 0u);
}

static bool send(void) {
    taper_frame_t frame;
    remote_unpack(buffer, &frame);
    return board.port.send(board.port.context, &frame);
}

static uint32_t kick(void) {
    board.port.kick_watchdog(board.port.context);
    return 0;
}

static uint32_t set_now(uint32_t to_ms) {
    offset_ms = to_ms - mps2_clock_ms();
    return 0;
}

static bool use_store(bool writes, unsigned index, uint32_t length) {
    const taper_port_t *port = &board.port;
    const unsigned area = index >> 4;
    const unsigned copy = index & 0xFu;
    return length <= sizeof buffer && (writes ? port->store_write(port->context, area, copy, buffer, length)
                                              : port->store_read(port->context, area, copy, buffer, length));
}

/* ---- What is asked for */

static uint32_t value_of(unsigned kind, unsigned index, uint32_t argument) {
    switch (kind) {
    case REMOTE_HAS: return has();
    case REMOTE_RECORD_MAX: return TAPER_STORE_RECORD_MAX;
    case REMOTE_SEND: return send();
    case REMOTE_OVERFLOWS: return board.port.receive_overflows(board.port.context);
    case REMOTE_KICK: return kick();
    case REMOTE_CLOCK_US: return board.port.clock_us(board.port.context);
    case REMOTE_NOW: return now_ms();
    case REMOTE_SET_NOW: return set_now(argument);
    case REMOTE_STORE_READ: return use_store(false, index, argument);
    case REMOTE_STORE_WRITE: return use_store(true, index, argument);
    default: return UINT32_MAX;
    }
}

static void answer(taper_slcan_message_t message) {
    taper_slcan_send_extended(&control, &message);
}

/** How many, and then all of them. */
static void receive(unsigned most) {
    uint32_t count = 0;
    taper_frame_t frame;
    while (count < most && count < REMOTE_WORDS / 2u && board.port.receive(board.port.context, &frame)) {
        remote_pack(&frame, buffer + 16u * count++);
    }
    answer(remote_value(REMOTE_VALUE, 0, count));
    for (unsigned word = 0; word < 2u * count; word++) {
        answer(remote_message(REMOTE_WORD, word, buffer + 8u * word, 8));
    }
}

static void obey(const taper_slcan_message_t *message) {
    const unsigned kind = remote_kind(message);
    const unsigned index = remote_index(message);
    switch (kind) {
    case REMOTE_PUT: memcpy(buffer + 8u * index, message->data, 8); break;
    case REMOTE_GET: answer(remote_message(REMOTE_WORD, index, buffer + 8u * index, 8)); break;
    case REMOTE_RECEIVE: receive(index); break;
    case REMOTE_RESET: mps2_reset();
    default: answer(remote_value(REMOTE_VALUE, index, value_of(kind, index, remote_u32(message)))); break;
    }
}

/** As the station's main does; nobody drives. */
static void serve_bus(void) {
    taper_slcan_message_t forgotten;
    do {
        taper_slcan_pump(&board.slcan, now_ms());
    } while (taper_slcan_take_extended(&board.slcan, &forgotten));
}

static void serve_control(void) {
    taper_slcan_message_t message;
    taper_slcan_pump(&control, 0);
    if (taper_slcan_take_extended(&control, &message)) {
        obey(&message);
    }
}

int main(void) {
    (void)mps2_boot_begin();
    mps2_clock_start();
    mps2_uart_start();
    start_control();
    mps2_board_start(&board);
    answer(remote_value(REMOTE_HELLO, 0, 0));
    for (;;) {
        serve_bus();
        serve_control();
    }
}
