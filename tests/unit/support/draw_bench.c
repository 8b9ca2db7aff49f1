#include "draw_bench.h"

#define START_ms (UINT32_MAX - 3000u)

taper_draw_t draw;
taper_draw_report_t report;
uint32_t now_ms;

void bench_start(void) {
    now_ms = START_ms;
    taper_draw_init(&draw);
    report = (taper_draw_report_t){.plugged = true,
                                   .session = 1,
                                   .allowed_mA = 16000,
                                   .setpoint_mA = 16000,
                                   .measured_mA = 16000,
                                   .min_mA = 6000};
}

bool bench_update(void) {
    return taper_draw_update(&draw, &report, now_ms);
}

bool bench_update_after(uint32_t ms) {
    now_ms += ms;
    return bench_update();
}

void bench_draws(int32_t measured_mA) {
    report.measured_mA = measured_mA;
}

void bench_is_told(int32_t setpoint_mA, int32_t allowed_mA) {
    report.setpoint_mA = setpoint_mA;
    report.allowed_mA = allowed_mA;
}
