/* Prints the generated tables, one line for each station, group and connector, for test_generated_tables.py.
   Fails if the firmware would refuse one of them at boot. */
#include <stdio.h>

#include "taper/config_check.h"
#include "taper/stations.h"

static void print_connector(const taper_connector_config_t *c) {
    printf("connector %ld %ld %ld %ld %lu", (long)c->min_mA, (long)c->max_mA, (long)c->fallback_mA,
           (long)c->voltage_mV, (unsigned long)c->reaction_ms);
    printf(" %d %d %d %d %d %d %d %d\n", c->efficiency_permille, c->phases, c->rotation, c->line_to_line,
           c->group, c->bus, c->node, c->is_dc);
}

static void print_group(const taper_group_config_t *g) {
    printf("group %ld %ld %ld %ld %d\n", (long)g->limit_W, (long)g->limit_mA, (long)g->delta_mA,
           (long)g->imbalance_mA, g->parent);
}

static void print_station(const taper_station_config_t *s) {
    printf("%s %ld %ld %ld %ld", s->name, (long)s->failsafe_W, (long)s->other_load_W, (long)s->other_load_mA,
           (long)s->site_voltage_mV);
    printf(" %lu %lu %lu %lu %lu", (unsigned long)s->tick_ms, (unsigned long)s->min_on_ms,
           (unsigned long)s->min_off_ms, (unsigned long)s->turn_ms, (unsigned long)s->change_ms);
    printf(" %ld %ld %ld %d %d %d\n", (long)s->ramp_mA_per_s, (long)s->deadband_mA,
           (long)s->price_weight_permille, s->line_to_line, s->step_s, s->steps);
    printf("planning %d %d %d %d %d %d %ld\n", s->planning.objective, s->planning.horizon_steps,
           s->planning.outer_iterations, s->planning.taper_lines, s->planning.on_events,
           s->planning.learns_taper, (long)s->planning.lambda_milli_per_kWh2);
    for (unsigned k = 0; k < s->group_count; k++) {
        print_group(&s->groups[k]);
    }
    for (unsigned k = 0; k < s->connector_count; k++) {
        print_connector(&s->connectors[k]);
    }
}

int main(void) {
    bool sound = true;
    for (unsigned k = 0; k < taper_station_count; k++) {
        print_station(taper_stations[k]);
        sound = sound && taper_config_check(taper_stations[k]) == TAPER_OK;
    }
    return sound ? 0 : 1;
}
