/*
 * Power goes at any moment: after every control tick of a scenario of 200, at several bytes of every write to the store, and
 * in the write of the start after it. It comes back after a while with the store as it was, and the field went on.
 *
 * The hub as described, with the planner, vehicles that take 5 s to follow, some that come and go, and a site limit that for
 * a time carries the least current of only some of them. Each cut runs in a process of its own, forked from the run without
 * a cut, which says afterwards what would have been. Of each cut it is asked that
 *
 * - no limit is exceeded at any moment, by what connectors may draw or by what they draw, and no guard finds anything;
 * - 10 s after power is back every session has current that, in the run without a cut, has it all along from 11 s before the
 *   cut (so late may the store be), and at least as many have it as have there since the cut;
 * - every session that was there for longer than the store may be late is resumed, with its stay and its energy, and every
 *   other one learned anew;
 * - the settings are those that were saved last, or before that; and
 * - the event log has nothing that does not belong there.
 */
#define _POSIX_C_SOURCE 200809L // fork

#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fault_bench.h"
#include "setup.h"
#include "taper/settings.h"
#include "unity.h"

#define TICKS      200u
#define SAVED_TICK 120u /* when somebody sets something else */
#define RESUMES_ms 10000u
#define AFTER_ms   13000u
#define LATE_ms    11100u /* what is older is in the store: 10 s from the write before, and a tick */
#define LONGEST_ms 12000u
#define LAST_TICK  (TICKS + (LONGEST_ms + AFTER_ms) / 1000u + 1u)
#define WRITES     64u
#define CHILDREN   2u
#define CONNECTORS 8u
/* After a fall of the limit that nobody hears: the last setpoint may be a tick and a validity old, and then vehicles take 5 s. */
#define GRACE_ms 9500u

/** What the run without a cut was like. */
typedef struct {
    uint32_t at_ms;
    uint32_t length;
} write_t;

typedef struct {
    uint8_t charging[LAST_TICK + 1u]; /**< bit i: connector i has current after this tick */
    write_t write[WRITES];
    unsigned writes;
} reference_t;

/** Power at the station's port. */
typedef struct {
    bool is_gone;
    bool goes; /**< in a write, after `spared` more */
    unsigned spared;
    uint32_t after_B;  /**< of it */
    taper_port_t port; /**< of the bus */
} power_t;

static reference_t reference;
static power_t power;
static taper_settings_t settings_before, settings_after;
static bool is_saved; /* settings_after were */
static uint32_t start_ms;
static unsigned children, failed;

void setUp(void) {}

void tearDown(void) {
    live_bench_end();
}

/* ---- The station's power */

/** Frames to a station that has no power reach nobody. */
static bool receive(void *context, taper_frame_t *frame) {
    bool taken = power.port.receive(context, frame);
    while (power.is_gone && taken) {
        taken = power.port.receive(context, frame);
    }
    return taken;
}

static bool send(void *context, const taper_frame_t *frame) {
    return !power.is_gone && power.port.send(context, frame);
}

static void note_write(uint32_t length) {
    TEST_ASSERT_LESS_THAN_UINT(WRITES, reference.writes);
    reference.write[reference.writes++] = (write_t){.at_ms = live.now_ms, .length = length};
}

static bool store_write(void *context, unsigned area, unsigned copy, const void *data, uint32_t length) {
    if (power.is_gone) {
        return false;
    }
    note_write(length);
    if (power.goes && power.spared-- == 0) {
        power.goes = false;
        power.is_gone = true;
        taper_membus_tear_next_write(&live.bus, power.after_B);
    }
    return power.port.store_write(context, area, copy, data, length);
}

static void give_power(void) {
    power = (power_t){.port = live.station_port};
    live.station_port.receive = receive;
    live.station_port.send = send;
    live.station_port.store_write = store_write;
}

/* ---- The scenario */

static sim_session_t vehicle(unsigned connector, double from_s, double to_s, double stay_h,
                             double wants_kwh) {
    sim_session_t session = live_vehicle(from_s);
    session.connector = connector;
    session.departure_s = LIVE_START_S + to_s;
    session.told_s = session.arrival_s + 3600.0 * stay_h;
    session.soc_target = session.soc_arrival + wants_kwh / session.battery_kwh;
    session.max_kw = connector % 2 == 0 ? 22.0 : 11.0;
    session.taper_kw = connector % 3 == 0 ? 8.0 : 0.0;
    return session;
}

static void start(void) {
    static double times_s[] = {0.0, LIVE_START_S + 55.0, LIVE_START_S + 100.0, LIVE_START_S + 150.0};
    static double limits_kw[] = {60.0, 26.0, 45.0, 38.0};
    static const sim_course_t limits = {.time_s = times_s, .value = limits_kw, .count = 4};
    const sim_session_t sessions[] = {
        vehicle(1, 0.0, 9000.0, 2.0, 30.0),  vehicle(2, 0.0, 9000.0, 6.0, 30.0),
        vehicle(3, 0.0, 70.0, 1.0, 20.0),    vehicle(4, 0.0, 9000.0, 3.0, 0.1),
        vehicle(5, 0.0, 9000.0, 9.0, 40.0),  vehicle(6, 12.0, 9000.0, 1.0, 20.0),
        vehicle(7, 30.0, 9000.0, 5.0, 15.0), vehicle(8, 44.0, 140.0, 4.0, 25.0),
        vehicle(3, 90.0, 9000.0, 2.5, 30.0), vehicle(8, 160.0, 9000.0, 1.5, 10.0),
    };
    live_options_t options = live_options(0.0);
    options.limits = &limits;
    options.as_described = true;
    options.vehicle_delay_ms = 5000;
    options.grace_ms = GRACE_ms;
    options.solver = taper_setup_solver(0);
    fault_open(&options, sessions, sizeof sessions / sizeof sessions[0]);
    settings_before = taper_settings_none();
    settings_before.limit_W = 100000;
    settings_after = settings_before;
    settings_after.limit_W = 90000;
    TEST_ASSERT_TRUE(taper_settings_save(&live.station_port, &settings_before));
    memset(&reference, 0, sizeof reference);
    give_power();
    start_ms = live.now_ms;
    is_saved = false;
}

static uint8_t charging(void) {
    unsigned bits = 0;
    for (unsigned i = 0; i < CONNECTORS; i++) {
        bits |= live.station.setpoints.current_mA[i] > 0 ? 1u << i : 0u;
    }
    return (uint8_t)bits;
}

static uint32_t passed_ms(void) {
    return live.now_ms - start_ms;
}

/** The next call of the station, and the world's. */
static void run_poll(void) {
    if (passed_ms() == SAVED_TICK * 1000u) {
        is_saved = taper_settings_save(&live.station_port, &settings_after);
    }
    live_bench_run_ms(LIVE_POLL_ms);
    if (power.is_gone) {
        live_bench_kill_station();
    }
}

static void run_reference(void) {
    start();
    while (passed_ms() < LAST_TICK * 1000u) {
        run_poll();
        reference.charging[passed_ms() / 1000u] = charging();
    }
    TEST_ASSERT_EQUAL_UINT32(0, live.field.tracker.may.times);
    TEST_ASSERT_EQUAL_UINT32(0, live.field.tracker.drawn.times);
    TEST_ASSERT_EQUAL(live.station_options.solver != NULL ? TAPER_MODE_PLAN : TAPER_MODE_FALLBACK,
                      taper_station_mode(&live.station));
    live_bench_end();
}

/* ---- One cut */

static char where[240];

static bool is_there(unsigned i) {
    return live.field.evse[i].vehicle != NULL;
}

static uint32_t stay_ms(unsigned i) {
    const double since_s = sim_field_world_s(&live.field) - live.field.evse[i].vehicle->arrival_s;
    return (uint32_t)(since_s * 1000.0);
}

/** In the run without a cut the connector has current at every tick. */
static bool has_current_all_along(unsigned i, uint32_t from_ms, uint32_t to_ms) {
    for (uint32_t tick = from_ms / 1000u; tick <= to_ms / 1000u; tick++) {
        if ((reference.charging[tick] >> i & 1) == 0) {
            return false;
        }
    }
    return true;
}

static unsigned events_of(taper_event_code_t code, unsigned i) {
    const taper_event_log_t *log = taper_station_events(&live.station);
    unsigned found = 0;
    for (uint32_t k = 0; k < log->count; k++) {
        found += log->event[k].code == code && log->event[k].node == i + 1 ? 1u : 0u;
    }
    return found;
}

static void assert_log_is_as_expected(bool torn) {
    static const taper_event_code_t expected[] = {
        TAPER_EVENT_STARTED,         TAPER_EVENT_MODE,
        TAPER_EVENT_CLOCK_SET,       TAPER_EVENT_CURVE_SET,
        TAPER_EVENT_SESSION_BEGUN,   TAPER_EVENT_SESSION_ENDED,
        TAPER_EVENT_SESSION_RESUMED, TAPER_EVENT_TRANSFER_REFUSED /* a curve that was on its way */};
    const taper_event_log_t *log = taper_station_events(&live.station);
    TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(TAPER_EVENTS, log->count, where);
    for (uint32_t k = 0; k < log->count; k++) {
        bool known = torn && log->event[k].code == TAPER_EVENT_STORE_OLD_COPY;
        for (unsigned e = 0; e < sizeof expected / sizeof expected[0]; e++) {
            known = known || log->event[k].code == expected[e];
        }
        TEST_ASSERT_EQUAL_UINT8_MESSAGE(known ? log->event[k].code : 0, log->event[k].code, where);
    }
    TEST_ASSERT_EQUAL_UINT_MESSAGE(1, fault_events(TAPER_EVENT_STARTED), where);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(1, fault_events(TAPER_EVENT_CLOCK_SET), where);
    TEST_ASSERT_TRUE_MESSAGE(fault_events(TAPER_EVENT_STORE_OLD_COPY) <= (torn ? 1u : 0u), where);
}

/** Each session is resumed with what the bus did not tell again, or learned anew. */
static void assert_sessions_are_back(uint32_t outage_ms) {
    for (unsigned i = 0; i < CONNECTORS; i++) {
        const taper_session_t *session = &live.station.sessions.session[i];
        const unsigned resumed = events_of(TAPER_EVENT_SESSION_RESUMED, i);
        if (!is_there(i) || stay_ms(i) < 4000) {
            continue;
        }
        TEST_ASSERT_TRUE_MESSAGE(session->in_session, where);
        TEST_ASSERT_EQUAL_UINT8_MESSAGE(live.field.evse[i].session, session->used.a.session, where);
        TEST_ASSERT_EQUAL_UINT_MESSAGE(1, resumed + events_of(TAPER_EVENT_SESSION_BEGUN, i), where);
        TEST_ASSERT_TRUE_MESSAGE(resumed == 1 || stay_ms(i) < 2 * outage_ms + AFTER_ms + LATE_ms, where);
        if (resumed == 1) {
            TEST_ASSERT_UINT32_WITHIN_MESSAGE(2500, stay_ms(i),
                                              taper_elapsed_ms(live.now_ms, session->plugged_in_ms), where);
            const double stored_Wh =
                1000.0 * sim_evse_soc(&live.field.evse[i]) * live.field.evse[i].vehicle->battery_kwh;
            TEST_ASSERT_INT32_WITHIN_MESSAGE(300, (int32_t)stored_Wh, session->stored_Wh, where);
        }
    }
}

static void assert_settings_are_there(bool saving) {
    taper_settings_t found;
    TEST_ASSERT_EQUAL_MESSAGE(TAPER_STORED_GOOD,
                              taper_settings_load(&live.station_port, &live.config, &found), where);
    const int32_t expected_W = (is_saved ? settings_after : settings_before).limit_W;
    TEST_ASSERT_TRUE_MESSAGE(
        found.limit_W == expected_W || (saving && found.limit_W == settings_after.limit_W), where);
}

static void assert_limits_held(void) {
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, live.field.tracker.may.times, where);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, live.field.tracker.drawn.times, where);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, fault_count(TAPER_COUNTER_GUARD_VIOLATIONS), where);
}

static unsigned count(uint8_t bits) {
    unsigned found = 0;
    for (; bits != 0; bits &= (uint8_t)(bits - 1u)) {
        found++;
    }
    return found;
}

/** In the run without a cut so many at least have current at every tick. */
static unsigned count_least(uint32_t from_ms, uint32_t to_ms) {
    unsigned least = CONNECTORS;
    for (uint32_t tick = from_ms / 1000u; tick <= to_ms / 1000u; tick++) {
        const unsigned now = count(reference.charging[tick]);
        least = now < least ? now : least;
    }
    return least;
}

/** All that had current when the store was written last, and would have had it ever since; and as many as would have it. */
static void assert_all_charge_again(uint32_t cut_ms) {
    const uint8_t has_current = charging();

    const uint32_t known_ms = cut_ms > LATE_ms ? cut_ms - LATE_ms : 0;
    for (unsigned i = 0; i < CONNECTORS; i++) {
        const bool expected = is_there(i) && has_current_all_along(i, known_ms, passed_ms());
        TEST_ASSERT_TRUE_MESSAGE(!expected || (has_current >> i & 1) != 0, where);
    }
    TEST_ASSERT_TRUE_MESSAGE(count(has_current) >= count_least(cut_ms, passed_ms()), where);
}

/** What a board does at power-on. */
static void start_again(void) {
    taper_settings_t found;
    power.is_gone = false;
    live.station_options.settings_found = taper_settings_load(&live.station_port, &live.config, &found);
    live_bench_revive_station();
}

/** Power comes back after `outage_ms`. `torn`: a write was cut short. */
static void come_back(uint32_t outage_ms, bool torn, bool saving) {
    const uint32_t cut_ms = passed_ms();
    live_bench_kill_station();
    live_bench_run_ms(outage_ms);
    start_again();
    if (power.is_gone) { /* the start wrote, and that was one too many */
        live_bench_kill_station();
        live_bench_run_ms(outage_ms);
        start_again();
    }
    live_bench_run_ms(RESUMES_ms);
    assert_all_charge_again(cut_ms);
    live_bench_run_ms(AFTER_ms - RESUMES_ms);
    assert_sessions_are_back(outage_ms);
    assert_log_is_as_expected(torn);
    assert_settings_are_there(saving);
    assert_limits_held();
}

/* ---- All of them */

static const uint32_t off_ms[] = {0, 20, 300, 1000, 2500, 4000, 6000, LONGEST_ms};

/** Wait until no more than `most` children run. */
static void wait_for_children(unsigned most) {
    while (children > most) {
        int status = 0;
        (void)wait(&status);
        children--;
        failed += WIFEXITED(status) && WEXITSTATUS(status) == 0 ? 0u : 1u;
    }
}

/** A process of its own, in which power goes; it does not return there. */
static bool is_child(void) {
    wait_for_children(CHILDREN - 1);
    (void)fflush(stdout);
    const pid_t pid = fork();
    TEST_ASSERT_TRUE_MESSAGE(pid >= 0, "fork");
    children += pid > 0 ? 1u : 0u;
    return pid == 0;
}

static _Noreturn void end_child(void) {
    if (Unity.CurrentTestFailed != 0) {
        (void)putchar(0x0A); // Unity ends the line later
    }
    (void)fflush(stdout);
    _exit(Unity.CurrentTestFailed == 0 ? 0 : 1);
}

static void cut_now(uint32_t outage_ms, bool at_start, uint32_t after_B) {
    if (!is_child()) {
        return;
    }
    if (TEST_PROTECT()) {
        (void)snprintf(where, sizeof where, "cut at %u ms for %u ms, %s", (unsigned)passed_ms(),
                       (unsigned)outage_ms, at_start ? "and in the write of the start" : "once");
        power.goes = at_start;
        power.after_B = after_B;
        come_back(outage_ms, at_start, passed_ms() == SAVED_TICK * 1000u);
    }
    end_child();
}

/** In the write that the next call makes. */
static void cut_in_write(const write_t *write, unsigned spared, uint32_t after_B, uint32_t outage_ms) {
    if (!is_child()) {
        return;
    }
    if (TEST_PROTECT()) {
        (void)snprintf(where, sizeof where, "cut in the write at %u ms after %u bytes of %u, for %u ms",
                       (unsigned)passed_ms(), (unsigned)after_B, (unsigned)write->length,
                       (unsigned)outage_ms);
        power.goes = true;
        power.spared = spared;
        power.after_B = after_B;
        run_poll();
        TEST_ASSERT_TRUE_MESSAGE(power.is_gone, where);
        come_back(outage_ms, true, write->at_ms - start_ms == SAVED_TICK * 1000u);
    }
    end_child();
}

static void test_row_30_whenever_power_goes_limits_hold_and_every_session_is_resumed(void) {
    run_reference();
    const reference_t known = reference;
    start();
    reference = known;
    unsigned next = 0;
    for (uint32_t poll = 0; passed_ms() <= TICKS * 1000u; poll++) {
        if (passed_ms() % 1000u == LIVE_POLL_ms) { /* the tick is over */
            const uint32_t tick = passed_ms() / 1000u;
            if (tick / 8u % TEST_SHARE == 0) { /* all eight outages, in an emulator too */
                cut_now(off_ms[tick % 8u], tick % 8u == 5u, tick);
            }
        }
        while (next < known.writes && known.write[next].at_ms == live.now_ms) {
            const unsigned spared = next > 0 && known.write[next - 1].at_ms == live.now_ms ? 1 : 0;
            const uint32_t length = known.write[next].length;
            const uint32_t bytes[] = {0, 1, length / 2, length - 1, length};
            for (unsigned k = 0; k < 5 && next % TEST_SHARE == 0; k++) {
                cut_in_write(&known.write[next], spared, bytes[k], off_ms[(next + k) % 8u]);
            }
            next++;
        }
        run_poll();
    }
    wait_for_children(0);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, failed, "cuts that went wrong: see above");
    TEST_ASSERT_GREATER_THAN_UINT(10, next);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_30_whenever_power_goes_limits_hold_and_every_session_is_resumed);
    return UNITY_END();
}
