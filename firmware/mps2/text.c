#include "text.h"

#include "registers.h"

#define BAUD_DIVIDER (MPS2_CLOCK_Hz / 115200u)
/** A character takes 2200 cycles: a UART that is not done by then never is. */
#define PATIENCE 10000u

void mps2_text_start(void) {
    MPS2_UART1->baud_divider = BAUD_DIVIDER;
    MPS2_UART1->control = MPS2_UART_TX_ON;
}

static void put(char character) {
    for (unsigned tries = 0; tries < PATIENCE && (MPS2_UART1->state & MPS2_UART_TX_FULL) != 0; tries++) {
    }
    MPS2_UART1->data = (uint8_t)character;
}

void mps2_text(const char *text) {
    for (; *text != '\0'; text++) {
        put(*text);
    }
}

static void begin_value(const char *name) {
    put(' ');
    mps2_text(name);
    put('=');
}

void mps2_text_hex(const char *name, uint32_t value) {
    begin_value(name);
    mps2_text("0x");
    for (unsigned digits = 8; digits > 0; digits--, value <<= 4) {
        put("0123456789abcdef"[value >> 28]);
    }
}

void mps2_text_u32(const char *name, uint32_t value) {
    char digits[11] = "";
    char *first = &digits[10];
    do {
        *--first = (char)('0' + value % 10u);
        value /= 10u;
    } while (value > 0);
    begin_value(name);
    mps2_text(first);
}
