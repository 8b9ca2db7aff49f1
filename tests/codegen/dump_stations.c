/* Prints the generated tables, one line for each station, group and connector, for test_generated_tables.py. */
#include <stdio.h>

#include "taper/stations.h"

static void print_connector(const taper_connector_config_t *c) {
    printf("connector %ld %ld %ld %d %d %d %d %d\n", (long)c->min_mA, (long)c->max_mA, (long)c->voltage_mV,
           c->phases, c->group, c->bus, c->node, c->is_dc);
}

static void print_station(const taper_station_config_t *s) {
    printf("%s %ld %lu %lu %lu %d %d\n", s->name, (long)s->failsafe_W, (unsigned long)s->tick_ms,
           (unsigned long)s->min_on_ms, (unsigned long)s->min_off_ms, s->step_s, s->steps);
    for (unsigned k = 0; k < s->group_count; k++) {
        printf("group %ld %d\n", (long)s->groups[k].limit_W, s->groups[k].parent);
    }
    for (unsigned k = 0; k < s->connector_count; k++) {
        print_connector(&s->connectors[k]);
    }
}

int main(void) {
    for (unsigned k = 0; k < taper_station_count; k++) {
        print_station(taper_stations[k]);
    }
    return 0;
}
