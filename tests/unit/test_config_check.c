/* The check of a description at boot: from a good one, every single contradiction is refused, and every edge passes. */
#include "taper/config_check.h"

#include "taper/stations.h"
#include "unity.h"

enum { THREE, PAIR, DIRECT, ONE, CONNECTORS };
enum { SITE, FEEDER, POD, GROUPS };

static taper_station_config_t config;
/* More than this image has room for, each sound by itself. */
static taper_group_config_t groups[TAPER_MAX_GROUPS + GROUPS];
static taper_connector_config_t connectors[TAPER_MAX_CONNECTORS + CONNECTORS];

static taper_connector_config_t socket(unsigned index) {
    return (taper_connector_config_t){.min_mA = 6000,
                                      .max_mA = 32000,
                                      .fallback_mA = 6000,
                                      .voltage_mV = 120000,
                                      .reaction_ms = 5000,
                                      .efficiency_permille = 1000,
                                      .phases = 1,
                                      .rotation = TAPER_ROTATION_231,
                                      .group = POD,
                                      .bus = (uint8_t)(index / TAPER_NODES_PER_BUS),
                                      .node = (uint8_t)(index % TAPER_NODES_PER_BUS + 1)};
}

/** Every kind of connector, below every kind of limit. */
static void make_good(void) {
    for (unsigned i = 0; i < sizeof connectors / sizeof connectors[0]; i++) {
        connectors[i] = socket(i);
    }
    connectors[THREE].phases = 3;
    connectors[THREE].rotation = TAPER_ROTATION_321;
    connectors[PAIR].line_to_line = true;
    connectors[PAIR].voltage_mV = 208000;
    connectors[DIRECT].is_dc = true;
    connectors[DIRECT].min_mA = 1000;
    connectors[DIRECT].voltage_mV = 400000;
    connectors[DIRECT].efficiency_permille = 950;
    groups[SITE] = (taper_group_config_t){.limit_W = 150000, .limit_mA = 400000, .parent = TAPER_NO_GROUP};
    groups[FEEDER] = (taper_group_config_t){
        .limit_W = 100000, .limit_mA = 250000, .delta_mA = 700000, .imbalance_mA = 20000, .parent = SITE};
    for (unsigned k = POD; k < sizeof groups / sizeof groups[0]; k++) {
        groups[k] = (taper_group_config_t){.limit_mA = 80000, .parent = FEEDER};
    }
    config = (taper_station_config_t){.name = "good",
                                      .connectors = connectors,
                                      .groups = groups,
                                      .failsafe_W = 10000,
                                      .other_load_W = 30000,
                                      .other_load_mA = 100000,
                                      .site_voltage_mV = 120000,
                                      .tick_ms = 1000,
                                      .min_on_ms = 300000,
                                      .min_off_ms = 300000,
                                      .turn_ms = 900000,
                                      .change_ms = 5000,
                                      .ramp_mA_per_s = 2000,
                                      .deadband_mA = 500,
                                      .price_weight_permille = 500,
                                      .line_to_line = true,
                                      .step_s = 900,
                                      .steps = 24,
                                      .connector_count = CONNECTORS,
                                      .group_count = GROUPS};
}

void setUp(void) {
    make_good();
}
void tearDown(void) {}

/** What the check says of the good description with `changes`. */
#define EXPECT(status, changes)                                                       \
    do {                                                                              \
        make_good();                                                                  \
        changes;                                                                      \
        TEST_ASSERT_EQUAL_MESSAGE((status), taper_config_check(&config), (#changes)); \
    } while (0)
#define REFUSED(changes)  EXPECT(TAPER_ERR_CONFIG, changes)
#define ACCEPTED(changes) EXPECT(TAPER_OK, changes)

static void test_a_good_description_passes(void) {
    TEST_ASSERT_EQUAL(TAPER_OK, taper_config_check(&config));
}

static void test_every_station_of_this_image_passes(void) {
    for (unsigned k = 0; k < taper_station_count; k++) {
        TEST_ASSERT_EQUAL_MESSAGE(TAPER_OK, taper_config_check(taper_stations[k]), taper_stations[k]->name);
    }
}

static void test_one_that_is_larger_than_the_image_is_refused(void) {
    REFUSED(config.connector_count = 0; config.line_to_line = false);
    REFUSED(config.connector_count = TAPER_MAX_CONNECTORS + 1);
    REFUSED(config.group_count = 0);
    REFUSED(config.group_count = TAPER_MAX_GROUPS + 1);
    REFUSED(config.steps = 1);
    REFUSED(config.steps = TAPER_MAX_STEPS + 1);
    REFUSED(config.planning.taper_lines = TAPER_MAX_TAPER_LINES + 1);
    ACCEPTED(config.planning.taper_lines = TAPER_MAX_TAPER_LINES);
    ACCEPTED(config.steps = TAPER_MAX_STEPS);
    ACCEPTED(config.steps = 2);
}

static void test_times_out_of_range_are_refused(void) {
    REFUSED(config.step_s = 59);
    REFUSED(config.step_s = 3601);
    REFUSED(config.tick_ms = 0);
    REFUSED(config.tick_ms = 3600001);
    REFUSED(config.min_off_ms = 86400001);
    REFUSED(config.turn_ms = 86400001);
    REFUSED(config.change_ms = 600001);
    ACCEPTED(config.tick_ms = 1);
    ACCEPTED(config.step_s = 60);
    ACCEPTED(config.step_s = 3600);
    ACCEPTED(config.tick_ms = 3600000);
    ACCEPTED(config.min_off_ms = 86400000);
    ACCEPTED(config.turn_ms = 86400000);
    ACCEPTED(config.change_ms = 600000);
}

static void test_a_turn_shorter_than_the_least_time_on_is_refused(void) {
    REFUSED(config.turn_ms = config.min_on_ms - 1);
    ACCEPTED(config.turn_ms = config.min_on_ms);
    ACCEPTED(config.turn_ms = config.min_on_ms = 0);
}

static void test_movement_and_price_out_of_range_are_refused(void) {
    REFUSED(config.ramp_mA_per_s = -1);
    REFUSED(config.ramp_mA_per_s = 409401);
    REFUSED(config.deadband_mA = -1);
    REFUSED(config.deadband_mA = 409401);
    REFUSED(config.price_weight_permille = -1);
    REFUSED(config.price_weight_permille = 1001);
    ACCEPTED(config.ramp_mA_per_s = config.deadband_mA = config.price_weight_permille = 0);
    ACCEPTED(config.price_weight_permille = 1000);
}

static void test_what_is_no_tree_is_refused(void) {
    REFUSED(groups[SITE].parent = SITE);
    REFUSED(groups[SITE].parent = FEEDER);
    REFUSED(groups[FEEDER].parent = TAPER_NO_GROUP);
    REFUSED(groups[FEEDER].parent = FEEDER);
    REFUSED(groups[FEEDER].parent = POD); /* not before its child */
    REFUSED(groups[POD].parent = GROUPS);
    ACCEPTED(groups[POD].parent = SITE);
}

static void test_a_group_without_a_limit_is_refused(void) {
    REFUSED(groups[SITE].limit_W = 0; config.failsafe_W = 0); /* which has one in mA */
    REFUSED(groups[POD].limit_mA = 0);
    REFUSED(groups[FEEDER].limit_W = groups[FEEDER].limit_mA =
                0); /* a delta side or a difference bounds no sum */
    ACCEPTED(groups[FEEDER].limit_W = 0);
    ACCEPTED(groups[FEEDER].limit_mA = 0);
    ACCEPTED(groups[SITE].limit_mA = 0);
}

static void test_limits_out_of_range_are_refused(void) {
    REFUSED(groups[FEEDER].limit_W = -1);
    REFUSED(groups[FEEDER].limit_W = 3276701);
    REFUSED(groups[FEEDER].limit_mA = -1);
    REFUSED(groups[FEEDER].limit_mA = 20000001);
    REFUSED(groups[FEEDER].delta_mA = -1);
    REFUSED(groups[FEEDER].delta_mA = 20000001);
    REFUSED(groups[FEEDER].imbalance_mA = -1);
    REFUSED(groups[FEEDER].imbalance_mA = 20000001);
    ACCEPTED(groups[FEEDER].limit_W = 3276700);
    ACCEPTED(groups[FEEDER].limit_mA = 20000000);
    ACCEPTED(groups[FEEDER].delta_mA = groups[FEEDER].imbalance_mA = 0);
}

static void test_a_site_that_contradicts_itself_is_refused(void) {
    REFUSED(config.failsafe_W = -1);
    REFUSED(config.failsafe_W = groups[SITE].limit_W + 1);
    REFUSED(config.site_voltage_mV = 0);
    REFUSED(config.site_voltage_mV = 49999);
    REFUSED(config.site_voltage_mV = 2000001);
    ACCEPTED(config.failsafe_W = groups[SITE].limit_W);
    ACCEPTED(config.failsafe_W = 0);
    ACCEPTED(config.site_voltage_mV = 50000);
    ACCEPTED(config.site_voltage_mV = 2000000);
}

static void test_other_load_whose_part_of_a_limit_is_not_known_is_refused(void) {
    REFUSED(config.other_load_W = -1);
    REFUSED(config.other_load_W = 3276701);
    REFUSED(config.other_load_mA = -1);
    REFUSED(config.other_load_mA = 20000001);
    REFUSED(config.other_load_mA = 0);
    REFUSED(groups[SITE].delta_mA = 700000);
    ACCEPTED(config.other_load_mA = 0; groups[SITE].limit_mA = 0);
    ACCEPTED(config.other_load_W = config.other_load_mA = 0);
    ACCEPTED(config.other_load_W = config.other_load_mA = 0; groups[SITE].delta_mA = 700000);
}

static void test_currents_that_cannot_be_offered_are_refused(void) {
    REFUSED(connectors[THREE].min_mA = -100);
    REFUSED(connectors[THREE].min_mA = 32100);
    REFUSED(connectors[THREE].min_mA = 5900); /* nothing on AC is below 6 A */
    REFUSED(connectors[DIRECT].min_mA = 1050);
    REFUSED(connectors[THREE].max_mA = 409500);
    REFUSED(connectors[THREE].max_mA = 32050);
    REFUSED(connectors[DIRECT].max_mA = connectors[DIRECT].min_mA = connectors[DIRECT].fallback_mA = 0);
    ACCEPTED(connectors[THREE].min_mA = 0);
    ACCEPTED(connectors[THREE].min_mA = connectors[THREE].fallback_mA = 6100);
    ACCEPTED(connectors[DIRECT].min_mA = 5900);
    ACCEPTED(connectors[THREE].max_mA = 409400);
    ACCEPTED(connectors[THREE].max_mA = 6000);
}

static void test_a_fallback_current_that_is_neither_nothing_nor_offered_is_refused(void) {
    REFUSED(connectors[PAIR].fallback_mA = -100);
    REFUSED(connectors[PAIR].fallback_mA = 5900);
    REFUSED(connectors[PAIR].fallback_mA = 32100);
    REFUSED(connectors[PAIR].fallback_mA = 6050);
    ACCEPTED(connectors[PAIR].fallback_mA = 0);
    ACCEPTED(connectors[PAIR].fallback_mA = 32000);
}

static void test_wiring_that_cannot_be_is_refused(void) {
    REFUSED(connectors[THREE].phases = 0);
    REFUSED(connectors[THREE].phases = 2);
    REFUSED(connectors[THREE].phases = 4);
    REFUSED(connectors[DIRECT].phases = 3);
    REFUSED(connectors[THREE].line_to_line = true);
    REFUSED(connectors[DIRECT].line_to_line = true);
    REFUSED(connectors[ONE].rotation = TAPER_ROTATION_UNKNOWN);
    REFUSED(connectors[DIRECT].rotation = TAPER_ROTATION_UNKNOWN);
    REFUSED(connectors[THREE].rotation = TAPER_ROTATION_321 + 1);
    REFUSED(connectors[THREE].voltage_mV = 0);
    REFUSED(connectors[THREE].voltage_mV = 2000001);
    ACCEPTED(connectors[THREE].rotation = TAPER_ROTATION_123);
    ACCEPTED(connectors[THREE].voltage_mV = 2000000);
}

static void test_line_to_line_is_said_of_the_station_too(void) {
    REFUSED(config.line_to_line = false);
    REFUSED(connectors[PAIR].line_to_line = false);
    ACCEPTED(connectors[PAIR].line_to_line = config.line_to_line = false);
    ACCEPTED(connectors[ONE].line_to_line = true);
}

static void test_an_efficiency_that_cannot_be_is_refused(void) {
    REFUSED(connectors[DIRECT].efficiency_permille = 0);
    REFUSED(connectors[DIRECT].efficiency_permille = 1001);
    REFUSED(connectors[DIRECT].efficiency_permille = 1); /* 1 A would count 1111 A of each phase */
    REFUSED(connectors[THREE].efficiency_permille = 999);
    REFUSED(connectors[THREE].efficiency_permille = 0);
    ACCEPTED(connectors[DIRECT].efficiency_permille = 1000);
    /* 36 kW, which 120 V have in 100 A on each phase; and a watt more */
    ACCEPTED(connectors[DIRECT].voltage_mV = 36000; connectors[DIRECT].efficiency_permille = 1);
    REFUSED(connectors[DIRECT].voltage_mV = 36001; connectors[DIRECT].efficiency_permille = 1);
}

static void test_a_reaction_that_takes_longer_than_a_minute_is_refused(void) {
    REFUSED(connectors[ONE].reaction_ms = 60001);
    ACCEPTED(connectors[ONE].reaction_ms = 60000);
    ACCEPTED(connectors[ONE].reaction_ms = 0);
}

static void test_a_place_that_is_not_there_or_taken_twice_is_refused(void) {
    REFUSED(connectors[ONE].group = GROUPS);
    REFUSED(connectors[ONE].group = TAPER_NO_GROUP);
    REFUSED(connectors[ONE].bus = TAPER_MAX_BUSES);
    REFUSED(connectors[ONE].node = 0);
    REFUSED(connectors[ONE].node = TAPER_NODES_PER_BUS + 1);
    REFUSED(connectors[ONE].node = connectors[THREE].node);
    ACCEPTED(connectors[ONE].node = TAPER_NODES_PER_BUS);
}

static void test_limits_lowered_below_the_least_current_pass(void) {
    ACCEPTED(groups[SITE].limit_W = 1; config.failsafe_W = 0);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_good_description_passes);
    RUN_TEST(test_every_station_of_this_image_passes);
    RUN_TEST(test_one_that_is_larger_than_the_image_is_refused);
    RUN_TEST(test_times_out_of_range_are_refused);
    RUN_TEST(test_a_turn_shorter_than_the_least_time_on_is_refused);
    RUN_TEST(test_movement_and_price_out_of_range_are_refused);
    RUN_TEST(test_what_is_no_tree_is_refused);
    RUN_TEST(test_a_group_without_a_limit_is_refused);
    RUN_TEST(test_limits_out_of_range_are_refused);
    RUN_TEST(test_a_site_that_contradicts_itself_is_refused);
    RUN_TEST(test_other_load_whose_part_of_a_limit_is_not_known_is_refused);
    RUN_TEST(test_currents_that_cannot_be_offered_are_refused);
    RUN_TEST(test_a_fallback_current_that_is_neither_nothing_nor_offered_is_refused);
    RUN_TEST(test_wiring_that_cannot_be_is_refused);
    RUN_TEST(test_line_to_line_is_said_of_the_station_too);
    RUN_TEST(test_an_efficiency_that_cannot_be_is_refused);
    RUN_TEST(test_a_reaction_that_takes_longer_than_a_minute_is_refused);
    RUN_TEST(test_a_place_that_is_not_there_or_taken_twice_is_refused);
    RUN_TEST(test_limits_lowered_below_the_least_current_pass);
    return UNITY_END();
}
