#include "taper/station.h"

#include <string.h>

#include "station_internal.h"
#include "taper/config_check.h"

/** A second controller that was not heard for this long is gone [ms]. */
#define RIVAL_GONE_ms UINT32_C(5000)

static bool options_are_sound(const taper_station_options_t *options) {
    return options->config != NULL && options->port != NULL && options->port->receive != NULL &&
           options->port->send != NULL && (options->policy == NULL || options->policy->propose != NULL) &&
           options->iterations_per_tick >= 1 && options->time_scale <= TAPER_MAX_TIME_SCALE;
}

static void init_layers(taper_station_t *station) {
    const taper_station_config_t *config = station->options.config;
    taper_session_init(&station->sessions, config);
    taper_limits_init(&station->limits, config);
    taper_supervisor_init(&station->supervisor);
    taper_allocator_init(&station->allocator);
    taper_shape_init(&station->shape);
    for (uint8_t i = 0; i < config->connector_count; i++) {
        taper_draw_init(&station->draw[i]);
    }
    taper_transfers_init(&station->transfers, config);
    station->sessions.log = &station->events;
    station->sessions.time_scale = station->options.time_scale;
    station->limits.log = &station->events;
    station->limits.time_scale = station->options.time_scale;
}

taper_status_t taper_station_init(taper_station_t *station, const taper_station_options_t *options) {
    if (station == NULL || options == NULL || !options_are_sound(options)) {
        return TAPER_ERR_ARGUMENT;
    }
    const taper_status_t config_status = taper_config_check(options->config);
    if (config_status != TAPER_OK) {
        return config_status;
    }
    if (options->time_scale > options->config->tick_ms) {
        return TAPER_ERR_ARGUMENT;
    }
    memset(station, 0, sizeof *station);
    station->options = *options;
    station->options.time_scale = options->time_scale == 0 ? 1 : options->time_scale;
    init_layers(station);
    taper_station_forget_sent(station);
    taper_station_seal(station);
    taper_record_load(station);
    if (options->solver != NULL) {
        return taper_planner_init(&station->planner, options->solver, options->config);
    }
    return TAPER_OK;
}

static void watch_rival(taper_station_t *station, uint32_t now_ms) {
    if (station->rival_heard && taper_elapsed_ms(now_ms, station->rival_ms) >= RIVAL_GONE_ms) {
        station->rival_heard = false;
    }
    if (station->rival_heard) {
        taper_alarm_raise(station, TAPER_EVENT_TWO_CONTROLLERS, 0, 0, now_ms);
    }
    if (station->limits.is_negative) {
        taper_alarm_raise(station, TAPER_EVENT_LIMIT_NEGATIVE, 0, TAPER_NODE_GATEWAY, now_ms);
    }
}

static void listen(taper_station_t *station, uint32_t now_ms) {
    const taper_station_config_t *config = station->options.config;
    station->events.now_ms = now_ms;
    station->events.unix_s = taper_session_unix_s(&station->sessions, now_ms);
    if (!station->started) {
        station->started = true;
        taper_record_start_clock(station, now_ms);
        taper_ledger_init(&station->ledger, config, taper_station_validity_ms(&station->options),
                          station->options.time_scale, now_ms);
        taper_event_note(&station->events, TAPER_EVENT_STARTED, 0, 0,
                         taper_saturate_i32(station->record.starts));
    }
    taper_station_receive(station, now_ms);
}

/** What step and poll begin with: the time, the frames, the state of the buses. */
static void begin(taper_station_t *station, uint32_t now_ms) {
    listen(station, now_ms);
    taper_ledger_update(&station->ledger, now_ms);
    taper_bus_guard_update(station, now_ms);
    watch_rival(station, now_ms);
    taper_station_check_seal(station,
                             now_ms); /* before they are worked out anew, and again before they are sent */
}

static void copy_counters(taper_station_t *station) {
    uint32_t *count = station->counters.count;
    count[TAPER_COUNTER_CLOCK_JUMPS] = station->sessions.clock_jumps;
    count[TAPER_COUNTER_SOC_JUMPS] = station->sessions.soc_jumps;
    count[TAPER_COUNTER_PARAMETERS_REPAIRED] = station->sessions.repaired;
    count[TAPER_COUNTER_LIMIT_FLAPS] = station->limits.flaps;
    count[TAPER_COUNTER_LIMITS_NEGATIVE] = station->limits.negative;
}

/** A step that comes late tells that the one before, or what ran beside it, took too long. */
static void watch_ticks(taper_station_t *station, uint32_t now_ms) {
    const uint32_t tick_ms = station->options.config->tick_ms / station->options.time_scale;
    const uint32_t passed_ms = station->stepped ? taper_elapsed_ms(now_ms, station->stepped_ms) : 0;
    const uint32_t late_ms = passed_ms > tick_ms ? passed_ms - tick_ms : 0;
    if (taper_self_ticked(&station->self, late_ms, tick_ms)) {
        taper_station_count(station, TAPER_COUNTER_TICK_OVERRUNS);
        taper_event_note(&station->events, TAPER_EVENT_TICK_OVERRUN, 0, 0, taper_saturate_i32(late_ms));
    }
    station->stepped = true;
    station->stepped_ms = now_ms;
}

/** Who leaves takes his name along. */
static void forget_identifiers(taper_station_t *station) {
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        const bool was_another = station->identifier_kept[i] && !taper_session_is_kept(&station->sessions, i);
        if (was_another || !taper_session_may_be_there(&station->sessions, i)) {
            taper_transfers_forget(&station->transfers, i);
            station->identifier_kept[i] = false;
        }
    }
}

void taper_station_step(taper_station_t *station, uint32_t now_ms) {
    const taper_port_t *port = station->options.port;
    begin(station, now_ms);
    watch_ticks(station, now_ms);
    taper_session_update(&station->sessions, now_ms);
    taper_limits_update(&station->limits, now_ms);
    forget_identifiers(station);
    taper_station_decide(station, now_ms);
    taper_station_send_setpoints(station, now_ms);
    copy_counters(station);
    taper_station_send_display(station, now_ms);
    taper_alarm_update(station, now_ms);
    taper_station_send_transfers(station, now_ms);
    memset(station->status_due, 1, sizeof station->status_due);
    taper_station_send_status(station, now_ms);
    taper_record_update(station, true, now_ms);
    if (port->kick_watchdog != NULL && taper_self_is_sound(&station->self)) {
        port->kick_watchdog(port->context);
    }
}

void taper_station_hear(taper_station_t *station, uint32_t now_ms) {
    listen(station, now_ms);
    taper_record_update(station, false, now_ms);
}

void taper_station_poll(taper_station_t *station, uint32_t now_ms) {
    begin(station, now_ms);
    taper_station_regrant(station, now_ms);
    taper_station_send_setpoints(station, now_ms);
    taper_alarm_update(station, now_ms);
    taper_station_send_transfers(station, now_ms);
    taper_station_send_status(station, now_ms);
    taper_record_update(station, false, now_ms);
}

void taper_station_stop(taper_station_t *station, uint32_t now_ms) {
    station->events.now_ms = now_ms;
    if (!station->stopped) {
        taper_event_note(&station->events, TAPER_EVENT_STOPPED, 0, 0, 0);
    }
    station->stopped = true;
    station->target = station->fallback;
    station->setpoints = station->fallback; /* never above what they have */
    taper_station_seal(station);
    taper_station_forget_sent(station);
    taper_station_send_setpoints(station, now_ms);
}

taper_status_t taper_station_set_limit_curve(taper_station_t *station, const taper_limit_curve_t *curve) {
    return curve == NULL ? TAPER_ERR_ARGUMENT
                         : taper_limits_set_curve(&station->limits, TAPER_CURVE_OF_FILE, curve);
}

taper_status_t taper_station_set_price_curve(taper_station_t *station, const taper_price_curve_t *curve) {
    return curve == NULL ? TAPER_ERR_ARGUMENT : taper_limits_set_price(&station->limits, curve);
}

const taper_event_log_t *taper_station_events(const taper_station_t *station) {
    return &station->events;
}

taper_mode_t taper_station_mode(const taper_station_t *station) {
    return station->supervisor.mode;
}

int32_t taper_station_site_limit_W(const taper_station_t *station) {
    return station->limit_now.supply.site_W;
}

uint32_t taper_station_counter(const taper_station_t *station, taper_counter_t counter) {
    return station->counters.count[counter];
}
