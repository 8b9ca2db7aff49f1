/* A microcontroller, to be filled in: the port template as it stands, and the milliseconds that SysTick counts. */
#include "board.h"
#include "port_template.h"
#include "taper/types.h"

static taper_template_board_t board;
static volatile uint32_t now_ms;

void SysTick_Handler(void);

/* Interrupt of the vector table, each millisecond. */
void SysTick_Handler(void) {
    now_ms++;
}

taper_port_t board_start(void) {
    return taper_template_port(&board); /* clocks, SysTick and CAN controllers are started before this */
}

uint32_t board_now_ms(void) {
    return now_ms;
}

void board_wait_ms(uint32_t duration_ms) {
    const uint32_t until_ms = now_ms + duration_ms;
    while (!taper_time_reached(now_ms, until_ms)) {
        __asm volatile("wfi");
    }
}

bool board_is_up(void) {
    return true;
}
