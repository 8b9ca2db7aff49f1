/* Vehicles that have no place, or ask for what cannot be: faults 31 to 34 of docs/protocol.md. */
#include <string.h>

#include "fault_bench.h"
#include "unity.h"

#define LIMIT_KW      30.0
#define PLAN_ROUND_ms 9000u
#define FIRST_NODE    9u /* beyond the hub's */

void setUp(void) {}

void tearDown(void) {
    live_bench_end();
}

/** A connector that the station does not know, with a vehicle. */
typedef struct {
    taper_connector_config_t config;
    sim_session_t session;
    sim_evse_t evse;
    bool there;
    bool paused; /**< it accepted a pause */
} stranger_t;

static stranger_t stranger[TAPER_STRANGERS + 1];

static uint8_t node_of(unsigned k) {
    return (uint8_t)(FIRST_NODE + k);
}

static void come(unsigned k) {
    stranger[k] = (stranger_t){.config = live.config.connectors[0], .session = live_vehicle(0.0)};
    stranger[k].config.node = node_of(k);
    stranger[k].there = true;
    sim_evse_init(&stranger[k].evse, &stranger[k].config, 0);
    sim_evse_plug(&stranger[k].evse, &stranger[k].session);
}

static void speak(const stranger_t *one) {
    for (unsigned frame = SIM_EVSE_STATUS; frame <= SIM_EV_PARAM_C; frame++) {
        const taper_message_t message = sim_evse_message(&one->evse, (sim_evse_frame_t)frame);
        fault_say(&message);
    }
}

static void listen(stranger_t *one) {
    const fault_frames_t *told = &fault.told[taper_can_id(TAPER_MESSAGE_SETPOINT, one->config.node)];
    taper_message_t message;
    if (told->count == 0 || !sim_evse_hear(&one->evse, &told->frame)) {
        return; /* nothing, or nothing new */
    }
    TEST_ASSERT_TRUE(fault_read(&told->frame, &message));
    one->paused = message.as.setpoint.command == TAPER_COMMAND_PAUSE;
    sim_evse_obey(&one->evse);
    TEST_ASSERT_EQUAL_INT32(0, one->evse.setpoint_mA);
}

static void run_with_strangers_ms(uint32_t ms) {
    for (uint32_t passed_ms = 0; passed_ms < ms; passed_ms += TAPER_EVSE_STATUS_CYCLE_ms) {
        for (unsigned k = 0; k <= TAPER_STRANGERS; k++) {
            if (stranger[k].there) {
                speak(&stranger[k]);
            }
        }
        live_bench_run_ms(TAPER_EVSE_STATUS_CYCLE_ms);
        for (unsigned k = 0; k <= TAPER_STRANGERS; k++) {
            if (stranger[k].there) {
                listen(&stranger[k]);
            }
        }
    }
}

static void assert_queued(unsigned k, uint8_t place, uint8_t of) {
    const taper_outlook_t outlook = fault_outlook(node_of(k));
    TEST_ASSERT_EQUAL(TAPER_REASON_QUEUED, outlook.reason);
    TEST_ASSERT_EQUAL_UINT8(place, outlook.waiting_place);
    TEST_ASSERT_EQUAL_UINT8(of, outlook.waiting_of);
    TEST_ASSERT_TRUE(stranger[k].paused);
}

/** Two vehicles that the station has a place for, and what they have. */
static void start_with_strangers(taper_setpoint_t others[2]) {
    memset(stranger, 0, sizeof stranger);
    fault_start(2, 20.0);
    others[0] = fault_setpoint(1);
    others[1] = fault_setpoint(2);
    TEST_ASSERT_GREATER_THAN_INT32(6000, others[1].current_mA);
}

static void assert_others_did_not_notice(const taper_setpoint_t others[2]) {
    for (uint8_t node = 1; node <= 2; node++) {
        const taper_setpoint_t now = fault_setpoint(node);
        TEST_ASSERT_EQUAL_MEMORY(&others[node - 1], &now, sizeof now);
    }
    fault_assert_limits_held();
}

static void test_row_31_vehicles_without_a_place_are_paused_and_queued_by_arrival(void) {
    taper_setpoint_t others[2];
    start_with_strangers(others);
    come(4);
    run_with_strangers_ms(2000);
    assert_queued(4, 1, 1);
    come(0); /* a lower node, but later */
    run_with_strangers_ms(5000);
    assert_queued(4, 1, 2);
    assert_queued(0, 2, 2);
    TEST_ASSERT_EQUAL_UINT(2, fault_events(TAPER_EVENT_QUEUED));
    TEST_ASSERT_EQUAL_UINT8(node_of(0), fault_last_event(TAPER_EVENT_QUEUED)->node);
    TEST_ASSERT_EQUAL_INT32(2, fault_last_event(TAPER_EVENT_QUEUED)->data);
    TEST_ASSERT_EQUAL_UINT32(2, fault_count(TAPER_COUNTER_STRANGERS));
    stranger[4].there = false;
    run_with_strangers_ms(3000);
    assert_queued(0, 1, 1);
    assert_others_did_not_notice(others);
}

static void test_row_31_more_than_can_be_noted_get_nothing_and_the_next_one_moves_up(void) {
    taper_setpoint_t others[2];
    start_with_strangers(others);
    for (unsigned k = 0; k <= TAPER_STRANGERS; k++) {
        come(k);
        run_with_strangers_ms(1000);
    }
    run_with_strangers_ms(2000);
    for (unsigned k = 0; k < TAPER_STRANGERS; k++) {
        assert_queued(k, (uint8_t)(k + 1), TAPER_STRANGERS);
    }
    TEST_ASSERT_FALSE(stranger[TAPER_STRANGERS].evse.in_force);
    stranger[0].there = false;
    run_with_strangers_ms(3000);
    assert_queued(TAPER_STRANGERS, TAPER_STRANGERS, TAPER_STRANGERS);
    assert_others_did_not_notice(others);
}

static void test_row_31_nobody_is_told_anything_once_the_vehicle_is_gone(void) {
    taper_setpoint_t others[2];
    const fault_frames_t *told = &fault.told[taper_can_id(TAPER_MESSAGE_SETPOINT, node_of(0))];
    start_with_strangers(others);
    come(0);
    run_with_strangers_ms(3000);
    sim_evse_unplug(&stranger[0].evse);
    stranger[0].there = false;
    for (unsigned k = 0; k < 10; k++) { /* the connector goes on, without a vehicle */
        const taper_message_t message = sim_evse_message(&stranger[0].evse, SIM_EVSE_STATUS);
        fault_say(&message);
        live_bench_run_ms(TAPER_EVSE_STATUS_CYCLE_ms);
    }
    const uint32_t count = told->count;
    TEST_ASSERT_GREATER_THAN_UINT32(0, count);
    live_bench_run_ms(5000);
    TEST_ASSERT_EQUAL_UINT32(count, told->count);
    assert_others_did_not_notice(others);
}

static void test_row_32_with_a_departure_in_the_past_it_charges_as_soon_as_possible(void) {
    const live_options_t options = live_options(16.0); /* for one, and the least for another */
    sim_session_t sessions[2] = {live_vehicle(0.0), live_vehicle(0.0)};
    sessions[1].told_s = sessions[1].arrival_s - 3600.0;
    fault_open(&options, sessions, 2);
    live_bench_run_ms(20000);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 11.0, fault_drawn_kw(2));
    TEST_ASSERT_DOUBLE_WITHIN(0.8, 4.5, fault_drawn_kw(1));
    TEST_ASSERT_TRUE(fault_outlook(2).departure_passed);
    TEST_ASSERT_EQUAL(TAPER_REASON_DEPARTURE, fault_outlook(2).because);
    TEST_ASSERT_GREATER_THAN_INT32(55000, fault_outlook(2).short_Wh);
    TEST_ASSERT_FALSE(fault_outlook(1).departure_passed);
    fault_assert_limits_held();
}

/** What vehicle 1 says of itself in the next test. */
static taper_ev_param_a_t says_a;
static int32_t says_target_Wh;

static void say_another_target(taper_frame_t *frame) {
    taper_message_t message;
    if (!fault_read(frame, &message) || message.node != 1) {
        return;
    }
    if (message.kind == TAPER_MESSAGE_EV_PARAM_A) {
        message.as.ev_param_a.soc_target_permille = says_a.soc_target_permille;
        fault_rewrite(frame, &message);
    } else if (message.kind == TAPER_MESSAGE_EV_PARAM_C) {
        message.as.ev_param_c.target_Wh = says_target_Wh;
        fault_rewrite(frame, &message);
    }
}

/** Vehicle 1 is at 20 % of 80 kWh, and would go on drawing: only its target says that it has enough. */
static void start_with_a_target(int32_t soc_permille, int32_t target_Wh) {
    const live_options_t options = live_options(LIMIT_KW);
    sim_session_t sessions[4];
    for (unsigned i = 0; i < 4; i++) {
        sessions[i] = live_vehicle(0.0);
    }
    says_a.soc_target_permille = soc_permille;
    says_target_Wh = target_Wh;
    fault_open(&options, sessions, 4);
    fault.alter = say_another_target;
    live_bench_run_ms(20000);
}

static void assert_complete_and_the_rest_is_for_others(void) {
    TEST_ASSERT_EQUAL(TAPER_REASON_COMPLETE, fault_reason(1));
    TEST_ASSERT_EQUAL(TAPER_COMMAND_PAUSE, fault_setpoint(1).command);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, fault_drawn_kw(1));
    TEST_ASSERT_DOUBLE_WITHIN(1.0, LIMIT_KW, live.field.tracker.drawn_kw);
    TEST_ASSERT_EQUAL_UINT8(3, fault_status().active);
    fault_assert_limits_held();
}

static void test_row_33_a_target_that_it_has_already_is_complete(void) {
    static const struct {
        int32_t soc_permille, target_Wh;
    } targets[] = {{100, TAPER_ABSENT}, {200, TAPER_ABSENT}, {TAPER_ABSENT, 0}, {900, -20000}};
    for (unsigned k = 0; k < sizeof targets / sizeof targets[0]; k++) {
        start_with_a_target(targets[k].soc_permille, targets[k].target_Wh);
        assert_complete_and_the_rest_is_for_others();
    }
}

static void test_row_33_a_target_that_is_reached_on_the_way_is_complete_and_a_higher_one_goes_on(void) {
    start_with_a_target(TAPER_ABSENT, 60); /* 20 s of 11 kW */
    live_bench_run_ms(20000);
    assert_complete_and_the_rest_is_for_others();
    says_target_Wh = 20000;
    live.field.evse[0].revision = (uint8_t)((live.field.evse[0].revision + 1) % 16);
    live.config.min_off_ms = 0;
    live_bench_run_ms(5000);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 11.0, fault_drawn_kw(1));
    fault_assert_limits_held();
}

/** Capacity as it stands in EV_PARAM_A, in 0.1 kWh. */
static uint16_t says_capacity;

static void say_another_capacity(taper_frame_t *frame) {
    if (frame->id == taper_can_id(TAPER_MESSAGE_EV_PARAM_A, 1)) {
        frame->data[3] = (uint8_t)says_capacity;
        frame->data[4] = (uint8_t)(says_capacity >> 8);
        fault_protect(frame);
    }
}

static void test_row_34_without_a_capacity_that_can_be_it_charges_by_energy(void) {
    static const uint16_t capacities[] = {0, 1, 9, 20001, 65534, 65535};
    const live_options_t options = live_options(LIMIT_KW);
    const sim_session_t sessions[2] = {live_vehicle(0.0), live_vehicle(0.0)};
    for (unsigned k = 0; k < sizeof capacities / sizeof capacities[0]; k++) {
        says_capacity = capacities[k];
        fault_open(&options, sessions, 2);
        fault.alter = say_another_capacity;
        live_bench_run_ms(20000);
        const taper_outlook_t outlook = fault_outlook(1);
        TEST_ASSERT_TRUE(outlook.by_energy);
        TEST_ASSERT_EQUAL_INT32(TAPER_ABSENT, outlook.soc_at_departure_permille);
        TEST_ASSERT_FALSE(fault_outlook(2).by_energy);
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 11.0, fault_drawn_kw(1));
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 11.0, fault_drawn_kw(2));
        TEST_ASSERT_INT32_WITHIN(100, 56000, live.station.snapshot.demand[0].need_Wh); /* what it asked for */
        fault_assert_limits_held();
    }
}

static void test_row_34_the_smallest_and_largest_capacity_that_can_be_are_believed(void) {
    static const uint16_t capacities[] = {10, 20000};
    const live_options_t options = live_options(LIMIT_KW);
    const sim_session_t session = live_vehicle(0.0);
    for (unsigned k = 0; k < 2; k++) {
        says_capacity = capacities[k];
        fault_open(&options, &session, 1);
        fault.alter = say_another_capacity;
        live_bench_run_ms(20000);
        TEST_ASSERT_FALSE(fault_outlook(1).by_energy);
        TEST_ASSERT_EQUAL_INT32(capacities[k] * 100, live.station.snapshot.demand[0].capacity_Wh);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_row_31_vehicles_without_a_place_are_paused_and_queued_by_arrival);
    RUN_TEST(test_row_31_more_than_can_be_noted_get_nothing_and_the_next_one_moves_up);
    RUN_TEST(test_row_31_nobody_is_told_anything_once_the_vehicle_is_gone);
    RUN_TEST(test_row_32_with_a_departure_in_the_past_it_charges_as_soon_as_possible);
    RUN_TEST(test_row_33_a_target_that_it_has_already_is_complete);
    RUN_TEST(test_row_33_a_target_that_is_reached_on_the_way_is_complete_and_a_higher_one_goes_on);
    RUN_TEST(test_row_34_without_a_capacity_that_can_be_it_charges_by_energy);
    RUN_TEST(test_row_34_the_smallest_and_largest_capacity_that_can_be_are_believed);
    return UNITY_END();
}
