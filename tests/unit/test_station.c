/* The whole pipeline: frames in at one end of an in-memory bus, setpoint frames out at the other. */
#include <string.h>

#include "scene.h"
#include "taper/codec.h"
#include "taper/membus.h"
#include "taper/station.h"
#include "taper/stations.h"
#include "unity.h"
#if TAPER_TEST_WITH_PLANNER
#    include <math.h>

#    include "solver.h"
#    include "taper/solvers.h"
#endif

static taper_station_t station;
static taper_membus_t bus;
static taper_port_t port;
static uint8_t counters[2048]; /* of every id that the test sends */
static uint32_t now_ms;

/** The hub, and its place among the generated stations. */
static unsigned hub_index(void) {
    for (unsigned k = 0; k < taper_station_count; k++) {
        if (strcmp(taper_stations[k]->name, "hub") == 0) {
            return k;
        }
    }
    TEST_FAIL_MESSAGE("no station hub");
    return 0;
}

static taper_station_options_t options(void) {
    taper_station_options_t with = {
        .config = taper_stations[hub_index()], .port = &port, .iterations_per_tick = 500};
#if TAPER_TEST_WITH_PLANNER
    with.solver = taper_solvers[hub_index()];
#endif
    return with;
}

void setUp(void) {
    memset(counters, 0, sizeof counters);
    now_ms = 1000;
    taper_membus_init(&bus);
    port = taper_membus_station_port(&bus);
    const taper_station_options_t with = options();
    TEST_ASSERT_EQUAL(TAPER_OK, taper_station_init(&station, &with));
}
void tearDown(void) {}

static void send(const taper_message_t *message) {
    taper_frame_t frame;
    TEST_ASSERT_TRUE(taper_encode(message, &frame));
    taper_e2e_protect(&frame, counters[frame.id]);
    counters[frame.id] = (uint8_t)((counters[frame.id] + 1) & 0x0F);
    TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &frame));
}

static void send_limit(int32_t limit_W) {
    taper_message_t message = {.kind = TAPER_MESSAGE_SITE_LIMIT, .node = TAPER_NODE_GATEWAY};
    message.as.site_limit = (taper_site_limit_t){
        .active = true, .limit_W = limit_W, .failsafe_W = TAPER_ABSENT, .validity_s = TAPER_ABSENT};
    send(&message);
}

static void send_clock(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_TIME_SYNC, .node = TAPER_NODE_GATEWAY};
    message.as.time_sync = (taper_time_sync_t){.unix_s = 600000 + now_ms / 1000, .quality = 1};
    send(&message);
}

static void send_status(uint8_t node, bool present) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_STATUS, .node = node};
    message.as.evse_status = (taper_evse_status_t){
        .pilot = present ? TAPER_PILOT_C : TAPER_PILOT_A, .ev_present = present, .phases = 3};
    send(&message);
}

/** A vehicle of 60 kWh at `soc_permille`, 11 kW at SOC 0 falling by 6 kW, that wants 20 kWh within two hours. */
static void send_vehicle(uint8_t node, uint8_t session, int32_t soc_permille) {
    taper_message_t message = {.node = node};
    message.kind = TAPER_MESSAGE_EV_PARAM_A;
    message.as.ev_param_a = (taper_ev_param_a_t){.revision = session,
                                                 .session = session,
                                                 .capacity_Wh = 60000,
                                                 .soc_target_permille = 800,
                                                 .soc_minimum_permille = TAPER_ABSENT,
                                                 .soc_plug_in_permille = soc_permille};
    send(&message);
    message.kind = TAPER_MESSAGE_EV_PARAM_B;
    message.as.ev_param_b = (taper_ev_param_b_t){.revision = session,
                                                 .session = session,
                                                 .departure_min = 10000 + 120,
                                                 .peak_W = 11000,
                                                 .min_mA = TAPER_ABSENT};
    send(&message);
    message.kind = TAPER_MESSAGE_EV_PARAM_C;
    message.as.ev_param_c = (taper_ev_param_c_t){
        .revision = session, .target_Wh = 20000, .maximum_Wh = TAPER_ABSENT, .minimum_Wh = TAPER_ABSENT};
    send(&message);
    message.kind = TAPER_MESSAGE_EV_PARAM_D;
    message.as.ev_param_d = (taper_ev_param_d_t){.revision = session, .session = session, .taper_W = 6000};
    send(&message);
    message.kind = TAPER_MESSAGE_EV_STATUS;
    message.as.ev_status =
        (taper_ev_status_t){.soc_permille = soc_permille, .soc_age_s = 0, .max_mA = 16000, .ready = true};
    send(&message);
    message.kind = TAPER_MESSAGE_EVSE_ELEC;
    message.as.evse_elec = (taper_evse_elec_t){.voltage_mV = 230000, .power_W = 0, .energy_Wh = 0};
    send(&message);
}

static void send_all(uint8_t vehicles, int32_t limit_W) {
    send_clock();
    send_limit(limit_W);
    for (uint8_t node = 1; node <= 8; node++) {
        send_status(node, node <= vehicles);
        if (node <= vehicles) {
            send_vehicle(node, 7, 500);
        }
    }
}

static void step(void) {
    taper_station_step(&station, now_ms);
    now_ms += 1000;
}

/** The SETPOINT for `node` among the frames of the last step; all other frames are thrown away. */
static taper_setpoint_t setpoint_for(uint8_t node) {
    taper_frame_t frame;
    taper_setpoint_t setpoint;
    bool found = false;
    memset(&setpoint, 0, sizeof setpoint);
    while (taper_membus_world_receive(&bus, &frame)) {
        taper_message_t message;
        bool bad_field = false;
        if (frame.id != taper_can_id(TAPER_MESSAGE_SETPOINT, node)) {
            continue;
        }
        taper_e2e_receiver_t receiver = {0};
        TEST_ASSERT_EQUAL(TAPER_E2E_OK, taper_e2e_check(&receiver, &frame));
        TEST_ASSERT_TRUE(taper_decode(&frame, &message, &bad_field));
        setpoint = message.as.setpoint;
        found = true;
    }
    TEST_ASSERT_TRUE_MESSAGE(found, "no setpoint frame");
    return setpoint;
}

static void test_a_soc_frame_in_gives_a_setpoint_frame_out_through_every_hop(void) {
    send_all(1, 50000);
    step();

    const taper_session_t *session = &station.sessions.session[0];
    TEST_ASSERT_TRUE(session->in_session);
    TEST_ASSERT_EQUAL_INT32(500, session->ev.soc_permille);

    const taper_demand_t *demand = &station.snapshot.demand[0];
    TEST_ASSERT_TRUE(demand->active);
    TEST_ASSERT_EQUAL_INT32(30000, demand->stored_Wh);
    TEST_ASSERT_EQUAL_INT32(60000, demand->capacity_Wh);
    TEST_ASSERT_EQUAL_INT32(20000, demand->need_Wh);
    TEST_ASSERT_EQUAL_INT32(11000, demand->peak_W);
    TEST_ASSERT_EQUAL_INT32(6000, demand->taper_W);
    TEST_ASSERT_EQUAL_INT32(16000, demand->max_mA);
    TEST_ASSERT_EQUAL_INT32(690, demand->W_per_A);
    TEST_ASSERT_EQUAL_INT32(7199, demand->departs_in_s);
    TEST_ASSERT_EQUAL_INT32(50000, taper_station_site_limit_W(&station));

#if TAPER_TEST_WITH_PLANNER
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVED, station.planner.verdict);
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&station));
    TEST_ASSERT_INT32_WITHIN(80, 8000,
                             station.plan_W[0]); /* 11 kW - half of 6 kW, within the solver's tolerance */
#else
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&station));
#endif
    TEST_ASSERT_EQUAL_INT32(8000, station.proposal.ceiling_W[0]);
    TEST_ASSERT_EQUAL_INT32(11600,
                            station.setpoints.current_mA[0]); /* 8000 W / 690 V = 11.594 A, up to the step */

    const taper_setpoint_t setpoint = setpoint_for(1);
    TEST_ASSERT_EQUAL(TAPER_COMMAND_CHARGE, setpoint.command);
    TEST_ASSERT_EQUAL_INT32(11600, setpoint.current_mA);
    TEST_ASSERT_EQUAL_UINT8(7, setpoint.session);
    TEST_ASSERT_EQUAL_UINT8(7, setpoint.phase_mask);
    TEST_ASSERT_EQUAL_UINT32(0, station.counters.guard_violations);
}

static void test_nothing_charges_before_a_limit_was_heard(void) {
    send_clock();
    send_status(1, true);
    send_vehicle(1, 7, 500);
    step();
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, taper_station_mode(&station));
    TEST_ASSERT_TRUE(station.snapshot.demand[0].active);
    TEST_ASSERT_EQUAL_INT32(0, setpoint_for(1).current_mA);
}

static void test_a_lower_limit_acts_in_the_same_tick(void) {
    send_all(8, 50000);
    step();
    send_all(8, 6000);
    step();
    int32_t sum_W = 0;
    for (uint8_t i = 0; i < 8; i++) {
        sum_W += station.setpoints.current_mA[i] * 690 / 1000;
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT32(6000, sum_W);
    TEST_ASSERT_GREATER_THAN_INT32(4000, sum_W);
}

static void test_a_silent_gateway_ends_in_failsafe(void) {
    send_all(8, 50000);
    step();
    for (int tick = 0; tick < 6; tick++) {
        for (uint8_t node = 1; node <= 8; node++) {
            send_status(node, true);
            send_vehicle(node, 7, 500);
        }
        step();
    }
    TEST_ASSERT_EQUAL(TAPER_MODE_FAILSAFE, taper_station_mode(&station));
    TEST_ASSERT_EQUAL_INT32(11000, taper_station_site_limit_W(&station));
    TEST_ASSERT_GREATER_THAN_UINT32(0, station.counters.fallback_ticks);
}

static void test_a_silent_connector_loses_its_current_and_the_others_go_on(void) {
    send_all(2, 50000);
    step();
    send_clock();
    send_limit(50000);
    now_ms += 1000;
    send_status(2, true);
    send_vehicle(2, 7, 500);
    step();
    TEST_ASSERT_EQUAL_INT32(0, station.setpoints.current_mA[0]);
    TEST_ASSERT_GREATER_THAN_INT32(0, station.setpoints.current_mA[1]);
}

static void test_a_corrupt_frame_is_dropped_and_counted(void) {
    taper_frame_t frame = {.id = taper_can_id(TAPER_MESSAGE_SITE_LIMIT, TAPER_NODE_GATEWAY), .length = 8};
    TEST_ASSERT_TRUE(taper_membus_world_send(&bus, &frame));
    step();
    TEST_ASSERT_EQUAL_UINT32(1, station.counters.crc_errors);
    TEST_ASSERT_EQUAL(TAPER_MODE_INIT, taper_station_mode(&station));
}

static void test_a_full_send_queue_is_counted_and_nothing_breaks(void) {
    send_all(1, 50000);
    for (int tick = 0; tick < 300; tick++) { /* nobody reads the bus: 9 frames a tick */
        send_status(1, true);
        send_limit(50000);
        step();
    }
    TEST_ASSERT_GREATER_THAN_UINT32(0, station.counters.send_refused);
    TEST_ASSERT_EQUAL_UINT32(0, station.counters.guard_violations);
}

static void test_refused_setpoints_leave_no_gap_in_the_counter(void) {
    taper_frame_t frame;
    send_all(1, 50000);
    while (station.counters.send_refused < 20) { /* nobody reads the bus until it is full, and longer */
        step();
    }
    while (taper_membus_world_receive(&bus, &frame)) {
    }
    const uint8_t next = station.setpoint_counter[0];
    step();
    bool found = false;
    while (taper_membus_world_receive(&bus, &frame)) {
        if (frame.id == taper_can_id(TAPER_MESSAGE_SETPOINT, 1)) {
            TEST_ASSERT_EQUAL_UINT8(next, frame.data[1] & 0x0F);
            found = true;
        }
    }
    TEST_ASSERT_TRUE(found);
}

static void test_options_that_make_no_sense_are_refused(void) {
    taper_station_options_t with = options();
    with.port = NULL;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_station_init(&station, &with));
    with = options();
    with.iterations_per_tick = TAPER_MIN_SLICE - 1;
    TEST_ASSERT_EQUAL(TAPER_ERR_ARGUMENT, taper_station_init(&station, &with));
    taper_station_config_t config = *options().config;
    config.connector_count = 0;
    with = options();
    with.config = &config;
    TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_station_init(&station, &with));
}

static void test_a_description_out_of_range_is_refused_at_boot(void) {
    taper_connector_config_t connectors[8];
    const taper_station_config_t good = *options().config;
    memcpy(connectors, good.connectors, sizeof connectors);
    taper_station_config_t bad[6] = {good, good, good, good, good, good};
    bad[0].tick_ms = 0;
    bad[1].tick_ms = 3600001;
    bad[2].step_s = 59;
    bad[3].step_s = 3601;
    bad[4].failsafe_W = good.groups[0].limit_W + 1;
    bad[5].connectors = connectors;
    connectors[7].bus = TAPER_MAX_BUSES;
    for (size_t k = 0; k < sizeof bad / sizeof bad[0]; k++) {
        taper_station_options_t with = options();
        with.config = &bad[k];
        TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_station_init(&station, &with));
    }
}

static void test_a_feeder_tree_that_is_none_is_refused_at_boot(void) {
    taper_group_config_t groups[3];
    taper_station_config_t config = *options().config;
    memcpy(groups, config.groups, sizeof groups);
    groups[1].parent = 2; /* not before its child */
    config.groups = groups;
    taper_station_options_t with = options();
    with.config = &config;
    TEST_ASSERT_EQUAL(TAPER_ERR_CONFIG, taper_station_init(&station, &with));
}

#if TAPER_TEST_WITH_PLANNER
static void test_sliced_planning_charges_by_fallback_until_the_plan_is_there(void) {
    taper_station_options_t with = options();
    with.iterations_per_tick = 10;
    TEST_ASSERT_EQUAL(TAPER_OK, taper_station_init(&station, &with));
    send_all(8, 30000);
    step();
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&station));
    TEST_ASSERT_GREATER_THAN_INT32(0, station.setpoints.current_mA[0]);
    for (int tick = 0; tick < 50 && taper_station_mode(&station) != TAPER_MODE_PLAN; tick++) {
        send_all(8, 30000);
        step();
    }
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&station));
    TEST_ASSERT_EQUAL_UINT32(1, station.counters.plans);
}

/** A NaN in the solver's memory, as a bit flip would leave it. */
static void poison_solver(void) {
    static OSQPFloat poisoned[TAPER_MAX_VARIABLES];
    for (unsigned v = 0; v < TAPER_MAX_VARIABLES; v++) {
        poisoned[v] = (OSQPFloat)NAN;
    }
    TEST_ASSERT_EQUAL(0, osqp_update_data_vec(station.options.solver->osqp, poisoned, NULL, NULL));
}

/** Bring the station to PLAN, then into a solve that is not finished. */
static void leave_a_solve_unfinished(void) {
    send_all(8, 30000);
    step();
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&station));
    station.options.iterations_per_tick = TAPER_MIN_SLICE;
    send_all(8, 9000); /* an event, far enough from the last problem for many slices */
    step();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_SOLVING, station.planner.verdict);
}

static void test_while_a_renewal_is_in_work_the_plan_is_followed(void) {
    leave_a_solve_unfinished();
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&station));
    TEST_ASSERT_EQUAL_UINT32(1, station.counters.plans);
}

static void test_a_poisoned_solver_means_fallback_in_the_same_tick_and_a_new_try_after_a_minute(void) {
    leave_a_solve_unfinished();
    poison_solver();
    send_all(8, 9000);
    step();
    TEST_ASSERT_EQUAL(TAPER_VERDICT_NOT_FINITE, station.planner.verdict);
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&station));
    TEST_ASSERT_EQUAL_UINT32(1, station.counters.plans_rejected);
    TEST_ASSERT_GREATER_THAN_INT32(0, station.setpoints.current_mA[0]);

    station.options.iterations_per_tick = TAPER_MAX_ITERATIONS;
    send_all(8, 9000);
    step(); /* nothing has changed: no new try yet */
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&station));
    now_ms += 60000;
    send_all(8, 9000);
    step();
    TEST_ASSERT_EQUAL(TAPER_MODE_PLAN, taper_station_mode(&station));
    TEST_ASSERT_EQUAL_UINT32(1, station.counters.plans_rejected);
    TEST_ASSERT_EQUAL_UINT32(0, station.counters.guard_violations);
}

static void test_a_plan_ends_after_two_steps_without_a_renewal(void) {
    leave_a_solve_unfinished();
    now_ms += 2 * 900000; /* the solve was never given a tick to go on */
    send_all(8, 9000);
    step();
    TEST_ASSERT_EQUAL(TAPER_MODE_FALLBACK, taper_station_mode(&station));
}
#endif

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_soc_frame_in_gives_a_setpoint_frame_out_through_every_hop);
    RUN_TEST(test_nothing_charges_before_a_limit_was_heard);
    RUN_TEST(test_a_lower_limit_acts_in_the_same_tick);
    RUN_TEST(test_a_silent_gateway_ends_in_failsafe);
    RUN_TEST(test_a_silent_connector_loses_its_current_and_the_others_go_on);
    RUN_TEST(test_a_corrupt_frame_is_dropped_and_counted);
    RUN_TEST(test_a_full_send_queue_is_counted_and_nothing_breaks);
    RUN_TEST(test_refused_setpoints_leave_no_gap_in_the_counter);
    RUN_TEST(test_options_that_make_no_sense_are_refused);
    RUN_TEST(test_a_description_out_of_range_is_refused_at_boot);
    RUN_TEST(test_a_feeder_tree_that_is_none_is_refused_at_boot);
#if TAPER_TEST_WITH_PLANNER
    RUN_TEST(test_sliced_planning_charges_by_fallback_until_the_plan_is_there);
    RUN_TEST(test_while_a_renewal_is_in_work_the_plan_is_followed);
    RUN_TEST(test_a_poisoned_solver_means_fallback_in_the_same_tick_and_a_new_try_after_a_minute);
    RUN_TEST(test_a_plan_ends_after_two_steps_without_a_renewal);
#endif
    return UNITY_END();
}
