/* The ranges of taper/message.h, written down a second time. */
#include <stdio.h>
#include <stdlib.h>

#include "check.h"
#include "taper/types.h"

void check_that(bool holds, const char *what, long long value) {
    if (!holds) {
        fprintf(stderr, "fuzz: must not be: %s = %lld\n", what, value);
        abort();
    }
}

static void in_range(const char *what, int64_t value, int64_t low, int64_t high) {
    check_that(value >= low && value <= high, what, value);
}

static void in_range_or_absent(const char *what, int32_t value, int32_t low, int32_t high) {
    if (value != TAPER_ABSENT) {
        in_range(what, value, low, high);
    }
}

static void check_emcy(const taper_emcy_t *emcy) {
    in_range("EMCY.severity", emcy->severity, TAPER_SEVERITY_INFO, TAPER_SEVERITY_FAULT);
}

static void check_site_limit(const taper_site_limit_t *limit) {
    in_range_or_absent("SITE_LIMIT.limit_W", limit->limit_W, -3276700, 3276700);
    in_range_or_absent("SITE_LIMIT.failsafe_W", limit->failsafe_W, -3276700, 3276700);
    in_range_or_absent("SITE_LIMIT.validity_s", limit->validity_s, 0, 254);
}

static void check_setpoint_ranges(const taper_setpoint_t *setpoint) {
    const int command = (int)setpoint->command;
    check_that(command == TAPER_COMMAND_EMERGENCY || (command >= 0 && command <= TAPER_COMMAND_STOP),
               "SETPOINT.command", command);
    in_range("SETPOINT.current_mA", setpoint->current_mA, 0, 6553400);
    in_range("SETPOINT.validity_ms", setpoint->validity_ms, 0, 127000);
    in_range("SETPOINT.fallback_mA", setpoint->fallback_mA, 0, 127000);
    in_range("SETPOINT.phase_mask", setpoint->phase_mask, 0, 7);
}

static void check_evse_status(const taper_evse_status_t *status) {
    in_range("EVSE_STATUS.pilot", (int)status->pilot, TAPER_PILOT_A, TAPER_PILOT_F);
    for (int k = 0; k < 3; k++) {
        in_range_or_absent("EVSE_STATUS.current_mA", status->current_mA[k], 0, 409400);
    }
    in_range("EVSE_STATUS.setpoint_echo", status->setpoint_echo, 0, 15);
    in_range("EVSE_STATUS.phases", status->phases, 0, 3);
}

static void check_ev_status(const taper_ev_status_t *ev) {
    in_range("EV_STATUS.error", ev->error, 0, 15);
    in_range_or_absent("EV_STATUS.soc_permille", ev->soc_permille, 0, 1000);
    in_range_or_absent("EV_STATUS.soc_age_s", ev->soc_age_s, 0, 254);
    in_range_or_absent("EV_STATUS.max_mA", ev->max_mA, 0, 6553400);
}

static void check_evse_elec(const taper_evse_elec_t *elec) {
    in_range_or_absent("EVSE_ELEC.voltage_mV", elec->voltage_mV, 0, 6553400);
    in_range_or_absent("EVSE_ELEC.power_W", elec->power_W, 0, 655340);
    in_range_or_absent("EVSE_ELEC.energy_Wh", elec->energy_Wh, 0, 655340);
}

static void check_time_sync(const taper_time_sync_t *time) {
    in_range("TIME_SYNC.ms", time->ms, 0, 999);
    in_range("TIME_SYNC.quality", time->quality, 0, 63);
}

static void check_ctrl_status(const taper_ctrl_status_t *status) {
    in_range("CTRL_STATUS.mode", status->mode, TAPER_MODE_INIT, TAPER_MODE_FAILSAFE);
    in_range("CTRL_STATUS.verdict", status->verdict, 0, 15);
    in_range("CTRL_STATUS.limit_source", status->limit_source, 0, 15);
    in_range("CTRL_STATUS.iterations", status->iterations, 0, 510);
}

static void check_param_a(const taper_ev_param_a_t *a) {
    in_range("EV_PARAM_A.revision", a->revision, 0, 15);
    in_range_or_absent("EV_PARAM_A.capacity_Wh", a->capacity_Wh, 100, 6553400);
    in_range_or_absent("EV_PARAM_A.soc_target_permille", a->soc_target_permille, 0, 1000);
    in_range_or_absent("EV_PARAM_A.soc_minimum_permille", a->soc_minimum_permille, 0, 1000);
    in_range_or_absent("EV_PARAM_A.soc_plug_in_permille", a->soc_plug_in_permille, 0, 1000);
}

static void check_param_b(const taper_ev_param_b_t *b) {
    in_range("EV_PARAM_B.revision", b->revision, 0, 15);
    in_range_or_absent("EV_PARAM_B.departure_min", b->departure_min, 0, 65534);
    in_range_or_absent("EV_PARAM_B.peak_W", b->peak_W, 0, 655340);
    in_range_or_absent("EV_PARAM_B.min_mA", b->min_mA, 0, 127000);
}

static void check_param_c(const taper_ev_param_c_t *c) {
    in_range("EV_PARAM_C.revision", c->revision, 0, 15);
    in_range_or_absent("EV_PARAM_C.target_Wh", c->target_Wh, -655340, 655340);
    in_range_or_absent("EV_PARAM_C.maximum_Wh", c->maximum_Wh, -655340, 655340);
    in_range_or_absent("EV_PARAM_C.minimum_Wh", c->minimum_Wh, -655340, 655340);
}

static void check_param_d(const taper_ev_param_d_t *d) {
    in_range("EV_PARAM_D.revision", d->revision, 0, 15);
    in_range_or_absent("EV_PARAM_D.taper_W", d->taper_W, 0, 655340);
}

static void check_param_e(const taper_ev_param_e_t *e) {
    in_range("EV_PARAM_E.revision", e->revision, 0, 15);
    in_range_or_absent("EV_PARAM_E.peak_W", e->peak_W, 0, 655340);
    in_range_or_absent("EV_PARAM_E.taper_W", e->taper_W, 0, 655340);
}

static void check_site_meter(const taper_site_meter_t *meter) {
    for (int k = 0; k < 3; k++) {
        in_range_or_absent("SITE_METER.other_mA", meter->other_mA[k], -3276700, 3276700);
    }
}

static void check_evse_info(const taper_evse_info_t *info) {
    in_range("EVSE_INFO.protocol_version", info->protocol_version, 0, 15);
    in_range_or_absent("EVSE_INFO.max_mA", info->max_mA, 0, 6553400);
    in_range_or_absent("EVSE_INFO.min_mA", info->min_mA, 0, 127000);
    in_range("EVSE_INFO.kind", info->kind, TAPER_KIND_UNKNOWN, TAPER_KIND_DC);
    in_range("EVSE_INFO.rotation", info->rotation, TAPER_ROTATION_UNKNOWN, TAPER_ROTATION_321);
}

static void check_plan(const taper_plan_t *plan) {
    for (int k = 0; k < 3; k++) {
        in_range_or_absent("PLAN.power_W", plan->power_W[k], 0, 655340);
    }
}

static void check_outlook(const taper_outlook_t *outlook) {
    in_range("OUTLOOK.waiting_place", outlook->waiting_place, 0, 15);
    in_range("OUTLOOK.waiting_of", outlook->waiting_of, 0, 15);
    in_range_or_absent("OUTLOOK.soc_at_departure_permille", outlook->soc_at_departure_permille, 0, 1000);
    in_range_or_absent("OUTLOOK.short_Wh", outlook->short_Wh, 0, 655340);
}

void check_message(const taper_message_t *message) {
    switch (message->kind) {
    case TAPER_MESSAGE_EMCY: check_emcy(&message->as.emcy); break;
    case TAPER_MESSAGE_SITE_LIMIT: check_site_limit(&message->as.site_limit); break;
    case TAPER_MESSAGE_SETPOINT: check_setpoint_ranges(&message->as.setpoint); break;
    case TAPER_MESSAGE_EVSE_STATUS: check_evse_status(&message->as.evse_status); break;
    case TAPER_MESSAGE_EV_STATUS: check_ev_status(&message->as.ev_status); break;
    case TAPER_MESSAGE_EVSE_ELEC: check_evse_elec(&message->as.evse_elec); break;
    case TAPER_MESSAGE_SITE_METER: check_site_meter(&message->as.site_meter); break;
    case TAPER_MESSAGE_TIME_SYNC: check_time_sync(&message->as.time_sync); break;
    case TAPER_MESSAGE_CTRL_STATUS: check_ctrl_status(&message->as.ctrl_status); break;
    case TAPER_MESSAGE_EV_PARAM_A: check_param_a(&message->as.ev_param_a); break;
    case TAPER_MESSAGE_EV_PARAM_B: check_param_b(&message->as.ev_param_b); break;
    case TAPER_MESSAGE_EV_PARAM_C: check_param_c(&message->as.ev_param_c); break;
    case TAPER_MESSAGE_EV_PARAM_D: check_param_d(&message->as.ev_param_d); break;
    case TAPER_MESSAGE_EV_PARAM_E: check_param_e(&message->as.ev_param_e); break;
    case TAPER_MESSAGE_EVSE_INFO: check_evse_info(&message->as.evse_info); break;
    case TAPER_MESSAGE_PLAN: check_plan(&message->as.plan); break;
    case TAPER_MESSAGE_OUTLOOK: check_outlook(&message->as.outlook); break;
    case TAPER_MESSAGE_CTRL_DIAG: break; /* integers of full range */
    default: check_that(false, "decoded as", (int)message->kind); break;
    }
}
