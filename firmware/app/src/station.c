#include "taper/station.h"

#include <string.h>

#include "station_internal.h"
#include "taper/config_check.h"

/** A second controller that was not heard for this long is gone [ms]. */
#define RIVAL_GONE_ms UINT32_C(5000)

static bool options_are_sound(const taper_station_options_t *options) {
    return options->config != NULL && options->port != NULL && options->port->receive != NULL &&
           options->port->send != NULL && (options->policy == NULL || options->policy->propose != NULL) &&
           options->iterations_per_tick >= TAPER_MIN_SLICE && options->time_scale <= TAPER_MAX_TIME_SCALE;
}

static void init_layers(taper_station_t *station) {
    const taper_station_config_t *config = station->options.config;
    taper_session_init(&station->sessions, config);
    taper_limits_init(&station->limits, config);
    taper_supervisor_init(&station->supervisor);
    taper_allocator_init(&station->allocator);
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
    memset(station, 0, sizeof *station);
    station->options = *options;
    station->options.time_scale = options->time_scale == 0 ? 1 : options->time_scale;
    init_layers(station);
    taper_station_forget_sent(station);
    taper_record_load(station);
    if (options->solver != NULL) {
        return taper_planner_init(&station->planner, options->solver, options->config);
    }
    return TAPER_OK;
}

static void note_mode(taper_station_t *station, taper_mode_t before) {
    const taper_mode_t mode = station->supervisor.mode;
    if (mode != before) {
        taper_event_note(&station->events, TAPER_EVENT_MODE, 0, 0, (int32_t)mode);
    }
    if (mode == TAPER_MODE_FALLBACK || mode == TAPER_MODE_FAILSAFE) {
        taper_station_count(station, TAPER_COUNTER_FALLBACK_TICKS);
    }
}

static taper_mode_t decide_mode(taper_station_t *station, uint32_t now_ms) {
    const taper_mode_t before = station->supervisor.mode;
    const taper_situation_t situation = {
        .gateway_alive = taper_limits_gateway_alive(&station->limits, now_ms),
        .gateway_heard = station->limits.heard,
        .proposal_ready = station->options.policy != NULL || taper_station_has_plan(station),
    };
    const taper_mode_t mode = taper_supervisor_update(&station->supervisor, &situation, now_ms);
    note_mode(station, before);
    return mode;
}

static void propose(taper_station_t *station, taper_mode_t mode, int32_t site_limit_W) {
    const taper_policy_t *policy = station->options.policy;
    if (mode != TAPER_MODE_PLAN) {
        taper_propose_edf(&station->snapshot, station->options.config->tick_ms, &station->proposal);
    } else if (policy != NULL) {
        policy->propose(policy->context, &station->snapshot, site_limit_W, &station->proposal);
    } else {
        taper_station_propose_plan(station);
    }
}

/** Currents for the proposal that hold every limit, once all connectors have followed. */
static void allocate(taper_station_t *station, uint32_t now_ms) {
    const taper_station_config_t *config = station->options.config;
    int32_t reserved_mA[TAPER_MAX_CONNECTORS];
    for (uint8_t i = 0; i < config->connector_count; i++) {
        const bool online = taper_session_is_online(&station->sessions, i, now_ms);
        reserved_mA[i] = online ? 0 : taper_ledger_may_mA(&station->ledger, i);
        station->setpoint_session[i] = taper_session_number(&station->sessions, i);
    }
    taper_allocate(&station->allocator, config, &station->snapshot, &station->proposal,
                   &station->limit_now.supply, reserved_mA, &station->target);
    if (station->rival_heard || station->stopped) {
        memset(&station->target, 0, sizeof station->target);
    }
}

/** What of the target is paid for by now. Nothing that the guards refuse gets out. */
static void grant(taper_station_t *station, taper_setpoints_t *granted) {
    const taper_station_config_t *config = station->options.config;
    const taper_supply_t *supply = &station->limit_now.supply;
    taper_ledger_grant(&station->ledger, config, &station->snapshot, station->proposal.rank, supply,
                       &station->target, granted);
    if (!taper_guard_passes(config, &station->snapshot, supply, granted) ||
        !taper_guard_hand_over_passes(&station->ledger, config, &station->snapshot, supply, granted)) {
        taper_station_count(station, TAPER_COUNTER_GUARD_VIOLATIONS);
        taper_event_note(&station->events, TAPER_EVENT_GUARD, 0, 0, 0);
        memset(granted, 0, sizeof *granted);
    }
}

bool taper_station_hands_over(const taper_station_t *station) {
    return memcmp(&station->target, &station->setpoints, sizeof station->target) != 0;
}

/** Grant again, between ticks. */
static void regrant(taper_station_t *station) {
    if (taper_station_hands_over(station)) {
        grant(station, &station->setpoints);
    }
}

static void watch_rival(taper_station_t *station, uint32_t now_ms) {
    if (station->rival_heard && taper_elapsed_ms(now_ms, station->rival_ms) >= RIVAL_GONE_ms) {
        station->rival_heard = false;
    }
    if (station->rival_heard) {
        taper_alarm_raise(station, TAPER_EVENT_TWO_CONTROLLERS, 0, 0, now_ms);
    }
}

/** What step and poll begin with: the time, the frames, the state of the buses. */
static void begin(taper_station_t *station, uint32_t now_ms) {
    const taper_station_config_t *config = station->options.config;
    station->events.now_ms = now_ms;
    station->events.unix_s = taper_session_unix_s(&station->sessions, now_ms);
    if (!station->started) {
        station->started = true;
        taper_ledger_init(&station->ledger, config, taper_station_validity_ms(&station->options),
                          station->options.time_scale, now_ms);
        taper_event_note(&station->events, TAPER_EVENT_STARTED, 0, 0,
                         taper_saturate_i32(station->record.starts));
    }
    taper_station_receive(station, now_ms);
    taper_ledger_update(&station->ledger, now_ms);
    taper_bus_guard_update(station, now_ms);
    watch_rival(station, now_ms);
}

static void copy_counters(taper_station_t *station) {
    uint32_t *count = station->counters.count;
    count[TAPER_COUNTER_CLOCK_JUMPS] = station->sessions.clock_jumps;
    count[TAPER_COUNTER_SOC_JUMPS] = station->sessions.soc_jumps;
    count[TAPER_COUNTER_PARAMETERS_REPAIRED] = station->sessions.repaired;
}

/** Who leaves takes his name along. */
static void forget_identifiers(taper_station_t *station) {
    for (uint8_t i = 0; i < station->options.config->connector_count; i++) {
        if (!station->sessions.session[i].vehicle_there) {
            taper_transfers_forget(&station->transfers, i);
        }
    }
}

static void decide(taper_station_t *station, uint32_t now_ms) {
    taper_session_snapshot(&station->sessions, now_ms, &station->snapshot);
    station->limit_now = taper_limits_now(&station->limits, now_ms);
    taper_station_plan(station, station->limit_now.supply.site_W);
    const taper_mode_t mode = decide_mode(station, now_ms);
    if (mode == TAPER_MODE_INIT) {
        station->limit_now.supply.site_W = 0;
    }
    propose(station, mode, station->limit_now.supply.site_W);
    allocate(station, now_ms);
    grant(station, &station->setpoints);
}

void taper_station_step(taper_station_t *station, uint32_t now_ms) {
    const taper_port_t *port = station->options.port;
    begin(station, now_ms);
    taper_session_update(&station->sessions, now_ms);
    taper_limits_update(&station->limits, now_ms);
    forget_identifiers(station);
    decide(station, now_ms);
    taper_station_send_setpoints(station, now_ms);
    copy_counters(station);
    taper_station_send_display(station, now_ms);
    taper_alarm_update(station, now_ms);
    taper_station_send_transfers(station, now_ms);
    memset(station->status_due, 1, sizeof station->status_due);
    taper_station_send_status(station, now_ms);
    taper_record_update(station, now_ms);
    if (port->kick_watchdog != NULL) {
        port->kick_watchdog(port->context);
    }
}

void taper_station_poll(taper_station_t *station, uint32_t now_ms) {
    begin(station, now_ms);
    regrant(station);
    taper_station_send_setpoints(station, now_ms);
    taper_alarm_update(station, now_ms);
    taper_station_send_transfers(station, now_ms);
    taper_station_send_status(station, now_ms);
}

void taper_station_stop(taper_station_t *station, uint32_t now_ms) {
    station->events.now_ms = now_ms;
    if (!station->stopped) {
        taper_event_note(&station->events, TAPER_EVENT_STOPPED, 0, 0, 0);
    }
    station->stopped = true;
    memset(&station->target, 0, sizeof station->target); /* the fallback current of every connector is 0 */
    memset(&station->setpoints, 0, sizeof station->setpoints);
    taper_station_forget_sent(station);
    taper_station_send_setpoints(station, now_ms);
}

taper_status_t taper_station_set_limit_curve(taper_station_t *station, const taper_limit_curve_t *curve) {
    return curve == NULL ? TAPER_ERR_ARGUMENT : taper_limits_set_curve(&station->limits, TAPER_CURVE_OF_FILE, curve);
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
