#include "sites.h"

#define COUNT(array) ((uint8_t)(sizeof(array) / sizeof(array)[0]))
#define NO_PARENT    TAPER_NO_GROUP

#define AC(place, wiring, wires, least, most, falls, below) \
    {.min_mA = (least),                                     \
     .max_mA = (most),                                      \
     .fallback_mA = (falls),                                \
     .voltage_mV = 230000,                                  \
     .reaction_ms = 5000,                                   \
     .efficiency_permille = 1000,                           \
     .phases = (wires),                                     \
     .rotation = (wiring),                                  \
     .group = (below),                                      \
     .node = (place)}
#define DC(place, volts, loss, most, follows, below) \
    {.min_mA = 0,                                    \
     .max_mA = (most),                               \
     .voltage_mV = (volts) * 1000,                   \
     .reaction_ms = (follows),                       \
     .efficiency_permille = (loss),                  \
     .phases = 1,                                    \
     .rotation = 1,                                  \
     .group = (below),                               \
     .node = (place),                                \
     .is_dc = true}
#define PAIR(place, wiring, most, below) \
    {.min_mA = 6000,                     \
     .max_mA = (most),                   \
     .fallback_mA = 6000,                \
     .voltage_mV = 208000,               \
     .reaction_ms = 5000,                \
     .efficiency_permille = 1000,        \
     .phases = 1,                        \
     .rotation = (wiring),               \
     .line_to_line = true,               \
     .group = (below),                   \
     .node = (place)}

/* Six three-phase sockets on two feeders, limited in W and in A per phase. */
static const taper_connector_config_t hub_connectors[] = {
    AC(1, 1, 3, 6000, 32000, 6000, 1), AC(2, 2, 3, 6000, 32000, 6000, 1), AC(3, 3, 3, 6000, 32000, 0, 1),
    AC(4, 1, 3, 6000, 32000, 6000, 2), AC(5, 6, 3, 6000, 16000, 6000, 2), AC(6, 4, 3, 6000, 32000, 0, 2)};
static const taper_group_config_t hub_groups[] = {{.limit_W = 66000, .limit_mA = 100000, .parent = NO_PARENT},
                                                  {.limit_W = 41400, .limit_mA = 63000, .parent = 0},
                                                  {.limit_W = 33000, .limit_mA = 50000, .parent = 0}};

/* One-phase sockets spread over the phases, and a three-phase one; the phases must not differ by much. */
static const taper_connector_config_t socket_connectors[] = {
    AC(1, 1, 1, 6000, 32000, 6000, 1), AC(2, 2, 1, 6000, 32000, 6000, 1), AC(3, 3, 1, 6000, 32000, 6000, 1),
    AC(4, 1, 1, 6000, 32000, 0, 1),    AC(5, 2, 1, 6000, 32000, 6000, 0), AC(6, 3, 1, 6000, 16000, 6000, 0),
    AC(7, 5, 3, 6000, 32000, 6000, 0)};
static const taper_group_config_t socket_groups[] = {
    {.limit_W = 43000, .limit_mA = 63000, .imbalance_mA = 20000, .parent = NO_PARENT},
    {.limit_W = 23000, .limit_mA = 40000, .imbalance_mA = 16000, .parent = 0}};

/* Converters with losses beside sockets. */
static const taper_connector_config_t mixed_connectors[] = {
    DC(1, 400, 940, 125000, 1000, 1),  DC(2, 800, 955, 60000, 1000, 1),   DC(3, 500, 910, 50000, 2000, 0),
    AC(4, 1, 3, 6000, 32000, 6000, 2), AC(5, 2, 1, 6000, 32000, 6000, 2), AC(6, 3, 3, 6000, 63000, 8000, 0)};
static const taper_group_config_t mixed_groups[] = {
    {.limit_W = 110000, .limit_mA = 160000, .parent = NO_PARENT},
    {.limit_W = 80000, .limit_mA = 125000, .parent = 0},
    {.limit_W = 30000, .limit_mA = 40000, .parent = 0}};

/* North America: sockets between two lines behind a delta-wye transformer, and one three-phase. */
static const taper_connector_config_t line_connectors[] = {PAIR(1, 1, 32000, 1),
                                                           PAIR(2, 2, 32000, 1),
                                                           PAIR(3, 3, 32000, 1),
                                                           PAIR(4, 1, 40000, 1),
                                                           PAIR(5, 2, 40000, 1),
                                                           PAIR(6, 3, 16000, 1),
                                                           {.min_mA = 6000,
                                                            .max_mA = 32000,
                                                            .fallback_mA = 6000,
                                                            .voltage_mV = 120000,
                                                            .reaction_ms = 5000,
                                                            .efficiency_permille = 1000,
                                                            .phases = 3,
                                                            .rotation = 1,
                                                            .group = 0,
                                                            .node = 7}};
static const taper_group_config_t line_groups[] = {
    {.limit_W = 40000, .limit_mA = 125000, .delta_mA = 150000, .parent = NO_PARENT},
    {.limit_W = 25000, .limit_mA = 80000, .delta_mA = 110000, .parent = 0}};

/* Twelve groups, up to six one below the other. */
static const taper_connector_config_t tree_connectors[] = {
    AC(1, 1, 3, 6000, 32000, 6000, 11), AC(2, 2, 3, 6000, 32000, 6000, 11),
    AC(3, 1, 1, 6000, 32000, 6000, 10), AC(4, 3, 1, 6000, 32000, 0, 9),
    AC(5, 1, 3, 6000, 32000, 6000, 8),  AC(6, 2, 1, 6000, 16000, 6000, 7),
    AC(7, 4, 3, 6000, 32000, 6000, 6),  AC(8, 1, 3, 8000, 63000, 8000, 3)};
static const taper_group_config_t tree_groups[] = {{.limit_W = 60000, .limit_mA = 90000, .parent = NO_PARENT},
                                                   {.limit_W = 50000, .parent = 0},
                                                   {.limit_W = 30000, .limit_mA = 50000, .parent = 0},
                                                   {.limit_W = 45000, .limit_mA = 70000, .parent = 1},
                                                   {.limit_W = 28000, .parent = 2},
                                                   {.limit_W = 33000, .limit_mA = 50000, .parent = 3},
                                                   {.limit_W = 17000, .limit_mA = 25000, .parent = 4},
                                                   {.limit_W = 12000, .limit_mA = 32000, .parent = 4},
                                                   {.limit_W = 25000, .limit_mA = 36000, .parent = 5},
                                                   {.limit_W = 20000, .limit_mA = 32000, .parent = 8},
                                                   {.limit_W = 15000, .limit_mA = 30000, .parent = 5},
                                                   {.limit_W = 18000, .limit_mA = 26000, .parent = 9}};

#define CONTROL(volts_mV)                                                                    \
    .site_voltage_mV = (volts_mV), .tick_ms = 1000, .min_on_ms = 20000, .min_off_ms = 15000, \
    .turn_ms = 60000, .change_ms = 5000, .step_s = 900, .steps = 4
#define SITE(its)                                                                                       \
    .connectors = its##_connectors, .connector_count = COUNT(its##_connectors), .groups = its##_groups, \
    .group_count = COUNT(its##_groups)

const taper_station_config_t sites[SITES] = {
    {.name = "hub",
     SITE(hub),
     CONTROL(230000),
     .failsafe_W = 11000,
     .other_load_W = 9000,
     .other_load_mA = 20000},
    {.name = "sockets",
     SITE(socket),
     CONTROL(230000),
     .failsafe_W = 8000,
     .ramp_mA_per_s = 2000,
     .deadband_mA = 500},
    {.name = "mixed",
     SITE(mixed),
     CONTROL(230000),
     .failsafe_W = 15000,
     .other_load_W = 12000,
     .other_load_mA = 25000},
    {.name = "lines", SITE(line), CONTROL(120000), .failsafe_W = 6000, .line_to_line = true},
    {.name = "tree",
     SITE(tree),
     CONTROL(230000),
     .failsafe_W = 9000,
     .other_load_W = 5000,
     .other_load_mA = 15000,
     .ramp_mA_per_s = 5000}};
