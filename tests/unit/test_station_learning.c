/* The taper of a vehicle, learned through frames: what it draws, what it is offered for that, and what the planner sees. */
#include <math.h>

#include "scene.h"
#include "station_bench.h"
#include "taper/battery.h"
#include "taper/stations.h"
#include "unity.h"

#define W_PER_A  690.0
#define LEAST_A  6.0
#define TOLD_W   8000 /* 11 kW less half of 6 kW */
#define MINUTE   60u
#define AMPLE_W  50000
#define SCARCE_W 5600

/** The vehicle of connector 1, and what it really takes. */
static struct {
    uint8_t session;
    double limit_W, fall_per_h;
    double energy_Wh, drawn_A;
    bool pauses;
} vehicle;
static taper_station_config_t config;

void setUp(void) {}
void tearDown(void) {}

static void start(bool learns) {
    taper_station_options_t options = bench_options();
    config = *options.config;
    config.planning.learns_taper = learns;
    options.config = &config;
    bench_start(&options);
    vehicle.session = 0;
}

static double takes_W(void) {
    return vehicle.pauses ? 0.0 : fmax(vehicle.limit_W - vehicle.fall_per_h * vehicle.energy_Wh, 0.0);
}

static void send_status(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_STATUS, .node = 1};
    const int32_t drawn_mA = (int32_t)(vehicle.drawn_A * 1000.0);
    message.as.evse_status = (taper_evse_status_t){.pilot = TAPER_PILOT_C,
                                                   .ev_present = true,
                                                   .phases = 3,
                                                   .current_mA = {drawn_mA, drawn_mA, drawn_mA},
                                                   .fallback_active = !bench.heard[1],
                                                   .setpoint_echo = bench.echo[1]};
    bench_send(&message);
}

static void send_meter(void) {
    taper_message_t message = {.kind = TAPER_MESSAGE_EVSE_ELEC, .node = 1};
    message.as.evse_elec = (taper_evse_elec_t){.voltage_mV = 230000,
                                               .power_W = (int32_t)(vehicle.drawn_A * W_PER_A),
                                               .energy_Wh = (int32_t)vehicle.energy_Wh};
    bench_send(&message);
}

/** Another vehicle, with a limit that falls with the energy charged, tells 11 kW less 6 kW to SOC 1, and is at 50 %. */
static void plug(double limit_W, double fall_per_h) {
    const uint8_t session = (uint8_t)(vehicle.session + 1);
    vehicle.session = session;
    vehicle.limit_W = limit_W;
    vehicle.fall_per_h = fall_per_h;
    vehicle.energy_Wh = 0.0;
    vehicle.drawn_A = 0.0;
    vehicle.pauses = false;
    bench_send_status(1, false);
    bench_step();
    bench_send_status(1, true);
    bench_send_vehicle(1, session, 500);
}

static void obey(void) {
    const double offered_A = bench.heard[1] ? bench_setpoint_for(1).current_mA / 1000.0 : 0.0;
    vehicle.drawn_A = offered_A < LEAST_A ? 0.0 : fmin(offered_A, takes_W() / W_PER_A);
    vehicle.energy_Wh += vehicle.drawn_A * W_PER_A / 3600.0;
}

static void pass(unsigned seconds, int32_t site_W) {
    for (unsigned k = 0; k < seconds; k++) {
        bench_send_clock();
        bench_send_limit(site_W);
        for (uint8_t node = 2; node <= config.connector_count; node++) {
            bench_send_status(node, false);
        }
        send_status();
        send_meter();
        bench_step();
        obey();
    }
}

static const taper_demand_t *demand(void) {
    return &bench.station.snapshot.demand[0];
}

static void test_a_station_that_does_not_learn_keeps_what_is_told(void) {
    start(false);
    plug(6500, 0.1);
    pass(20 * MINUTE, AMPLE_W);
    TEST_ASSERT_EQUAL_INT32(11000, demand()->peak_W);
    TEST_ASSERT_EQUAL_INT32(6000, demand()->taper_W);
}

static void test_what_a_vehicle_takes_replaces_what_it_told(void) {
    start(true);
    plug(7000, 0.2);
    pass(18 * MINUTE, AMPLE_W); /* a tenth of 20 kWh */
    TEST_ASSERT_INT32_WITHIN(100, (int32_t)takes_W(), taper_battery_limit_W(demand()));
    taper_demand_t full = *demand();
    full.stored_Wh += full.need_Wh;
    TEST_ASSERT_INT32_WITHIN(350, 7000 - 4000, taper_battery_limit_W(&full));
}

static void test_a_vehicle_that_told_too_little_gets_all_that_it_takes(void) {
    start(true);
    plug(10800, 0.0);
    pass(10 * MINUTE, AMPLE_W);
    TEST_ASSERT_TRUE(vehicle.drawn_A * W_PER_A >= 10500.0);
}

static void test_a_limit_that_was_low_for_a_while_does_not_confirm_itself(void) {
    start(true);
    plug(5000, 0.0);
    pass(20 * MINUTE, AMPLE_W);
    TEST_ASSERT_INT32_WITHIN(100, 5000, taper_battery_limit_W(demand()));
    vehicle.limit_W = 10000; /* it was cold */
    pass(20 * MINUTE, AMPLE_W);
    TEST_ASSERT_TRUE(vehicle.drawn_A * W_PER_A >= 9500.0);
}

static void test_a_line_that_is_too_high_follows_the_vehicle_down(void) {
    start(true);
    plug(10000, 0.0);
    pass(10 * MINUTE, AMPLE_W);
    vehicle.limit_W = 6000; /* it is hot */
    pass(5 * MINUTE, AMPLE_W);
    TEST_ASSERT_INT32_WITHIN(300, 6000, taper_battery_limit_W(demand()));
}

static void test_a_site_that_has_little_to_give_teaches_nothing(void) {
    start(true);
    plug(9000, 0.0);
    pass(20 * MINUTE, SCARCE_W);
    TEST_ASSERT_FALSE(taper_learn_knows(&bench.station.learning[0].line));
    TEST_ASSERT_EQUAL_INT32(11000, demand()->peak_W);
}

static void test_a_pause_of_the_vehicle_is_no_limit(void) {
    start(true);
    plug(9000, 0.0);
    pass(10 * MINUTE, AMPLE_W);
    vehicle.pauses = true;
    pass(5 * MINUTE, AMPLE_W);
    TEST_ASSERT_INT32_WITHIN(200, 9000, taper_battery_limit_W(demand()));
}

static void test_the_next_vehicle_begins_with_what_it_tells_and_what_was_seen(void) {
    start(true);
    plug(6000, 0.0);
    pass(20 * MINUTE, AMPLE_W);
    TEST_ASSERT_INT32_WITHIN(100, 6000, taper_battery_limit_W(demand()));
    plug(10800, 0.0);
    pass(5, SCARCE_W);
    const int32_t limit_W = taper_battery_limit_W(demand());
    TEST_ASSERT_INT32_WITHIN(500, 7000, limit_W); /* one is no proof */
}

static void test_among_vehicles_that_tell_the_same_wrong_thing_the_fifth_is_known(void) {
    start(true);
    for (unsigned k = 0; k < 4; k++) {
        plug(6000, 0.1);
        pass(20 * MINUTE, AMPLE_W);
    }
    plug(6000, 0.1);
    pass(5, SCARCE_W);
    TEST_ASSERT_INT32_WITHIN(300, 6000, taper_battery_limit_W(demand()));
    TEST_ASSERT_FALSE(bench.station.learning[0].counted);
}

static void test_a_current_belongs_to_the_energy_at_which_it_began(void) {
    start(true);
    plug(6000, 0.1);
    pass(10 * MINUTE, AMPLE_W);
    const int32_t before_Wh = (int32_t)vehicle.energy_Wh;
    const int32_t limit_W = taper_learn_limit_W(&bench.station.learning[0].line, before_Wh);
    vehicle.energy_Wh += 1000.0; /* as if that tick had been a long one */
    pass(1, AMPLE_W);
    TEST_ASSERT_INT32_WITHIN(30, limit_W, taper_learn_limit_W(&bench.station.learning[0].line, before_Wh));
}

static void test_where_all_is_wanted_a_line_that_is_known_is_seldom_exceeded(void) {
    start(true);
    plug(6000, 0.0);
    pass(20 * MINUTE, AMPLE_W);
    unsigned above = 0;
    for (unsigned k = 0; k < 20 * MINUTE; k++) {
        pass(1, 6000);
        above += bench.station.proposal.wish_W[0] > taper_battery_limit_W(demand()) ? 1 : 0;
    }
    TEST_ASSERT_TRUE(above > 0);
    TEST_ASSERT_TRUE(above < 4 * MINUTE); /* to rise and to show takes a minute, then it rests for ten */
}

static void test_the_planner_hears_of_a_line_that_moved_but_not_all_the_time(void) {
    start(true);
    plug(6000, 0.1);
    pass(5, AMPLE_W);
    const uint32_t before = bench.station.sessions.revision;
    pass(20 * MINUTE, AMPLE_W);
    const uint32_t told = bench.station.sessions.revision - before;
    TEST_ASSERT_TRUE(told >= 1);
    TEST_ASSERT_TRUE(told <= 10); /* once in two minutes; caps of draw.h count as well */
}

static void test_a_line_below_the_minimum_that_may_be_wrong_is_put_to_the_proof_before_others(void) {
    start(true);
    plug(8000, 2.0); /* its battery is a tenth of what it tells */
    pass(30 * MINUTE, AMPLE_W);
    TEST_ASSERT_TRUE(bench.station.learning[0].counted);
    plug(9000, 0.0);
    bench_send_vehicle(1, ++vehicle.session, 750); /* there the line of such a battery is at 0 */
    pass(1, SCARCE_W);
    TEST_ASSERT_EQUAL_INT32(0, taper_battery_limit_W(demand()));
    int32_t most_W = 0;
    for (unsigned k = 0; k < 3 * MINUTE; k++) {
        pass(1, 1); /* others leave nothing */
        most_W = taper_max_i32(most_W, bench.station.proposal.wish_W[0]);
    }
    TEST_ASSERT_TRUE(most_W >=
                     (int32_t)(LEAST_A * W_PER_A)); /* with less it draws nothing, and shows nothing */
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_station_that_does_not_learn_keeps_what_is_told);
    RUN_TEST(test_what_a_vehicle_takes_replaces_what_it_told);
    RUN_TEST(test_a_vehicle_that_told_too_little_gets_all_that_it_takes);
    RUN_TEST(test_a_limit_that_was_low_for_a_while_does_not_confirm_itself);
    RUN_TEST(test_a_line_that_is_too_high_follows_the_vehicle_down);
    RUN_TEST(test_a_site_that_has_little_to_give_teaches_nothing);
    RUN_TEST(test_a_pause_of_the_vehicle_is_no_limit);
    RUN_TEST(test_the_next_vehicle_begins_with_what_it_tells_and_what_was_seen);
    RUN_TEST(test_among_vehicles_that_tell_the_same_wrong_thing_the_fifth_is_known);
    RUN_TEST(test_a_current_belongs_to_the_energy_at_which_it_began);
    RUN_TEST(test_where_all_is_wanted_a_line_that_is_known_is_seldom_exceeded);
    RUN_TEST(test_the_planner_hears_of_a_line_that_moved_but_not_all_the_time);
    RUN_TEST(test_a_line_below_the_minimum_that_may_be_wrong_is_put_to_the_proof_before_others);
    return UNITY_END();
}
