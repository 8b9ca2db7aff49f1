/** The station on a board: on its own clock, until a simulation takes it over. */
#include "board.h"
#include "boot.h"
#include "clock.h"
#include "core.h"
#include "free_run.h"
#include "taper/stations.h"
#include "text.h"
#include "uart.h"

// Too large for a stack, and there is one per image.
static mps2_board_t board;

static void tell_start(uint32_t fault) {
    mps2_text("taper: start: station=");
    mps2_text(taper_stations[0]->name);
    mps2_text_u32("starts", mps2_boot()->starts);
    mps2_text_u32("after_exception", fault);
    mps2_text("\n");
}

/** Until the next millisecond, or byte. */
static void rest(void) {
    const uint32_t state = mps2_interrupts_off();
    if (!mps2_uart_has_received()) {
        mps2_wait_for_interrupt();
    }
    mps2_interrupts_restore(state);
}

int main(void) {
    mps2_text_start();
    tell_start(mps2_boot_begin());
    mps2_clock_start();
    mps2_uart_start();
    mps2_board_start(&board);
    if (mps2_boot()->is_driven) {
        mps2_clock_stop();
    } else {
        mps2_free_run_start(&board.station, &board.options);
    }
    for (;;) {
        if (!mps2_board_serve(&board)) {
            mps2_free_run_call(&board.station, mps2_clock_ms());
        }
        rest();
    }
}
