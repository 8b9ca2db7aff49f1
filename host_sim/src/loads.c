#include "loads.h"

#include <math.h>
#include <stdio.h>

/** Less above a limit than this is rounding of doubles [kW, A]. */
#define TOLERANCE  1e-6
#define HALF_SQRT3 0.86602540378443864676

/** Voltage of a phase to neutral, as a number of length 1. */
static double complex star(unsigned phase) {
    static const double sine[] = {0.0, -HALF_SQRT3, HALF_SQRT3};
    return CMPLX(phase == 0 ? 1.0 : -0.5, sine[phase]);
}

/** Voltage from a phase to the next one. */
static double complex delta(unsigned phase) {
    static const double cosine[] = {HALF_SQRT3, 0.0, -HALF_SQRT3};
    return CMPLX(cosine[phase], phase == 1 ? -1.0 : 0.5);
}

/** Supply phase (0..2) of a connector's conductor. */
static unsigned phase_of(const taper_connector_config_t *connector, unsigned conductor) {
    static const char *const order[] = {"123", "123", "231", "312", "132", "213", "321"};
    return (unsigned)(order[connector->rotation][conductor] - '1');
}

/** Current between two phases: it comes in by one line and goes back by the other. */
static void add_pair(sim_load_t *load, unsigned one, unsigned other, double current_A) {
    const unsigned from = (one + 1) % 3 == other ? one : other; // as L1-L2, L2-L3 or L3-L1
    const double complex between_A = current_A * delta(from);
    load->line_A[from] += between_A;
    load->line_A[(from + 1) % 3] -= between_A;
}

static void add_phase(sim_load_t *load, unsigned phase, double current_A) {
    load->line_A[phase] += current_A * star(phase);
}

sim_load_t sim_load_of(const taper_station_config_t *station, unsigned i, unsigned conductors,
                       double current_A) {
    const taper_connector_config_t *connector = &station->connectors[i];
    const double kw_per_A = (double)connector->voltage_mV / 1e6;
    sim_load_t load = {0};
    if (current_A == 0.0) { // most connectors, most of the time
        return load;
    }
    if (connector->is_dc) {
        load.kw = current_A * kw_per_A * 1000.0 / (double)connector->efficiency_permille;
        for (unsigned phase = 0; phase < 3; phase++) {
            add_phase(&load, phase, load.kw * 1e6 / (3.0 * (double)station->site_voltage_mV));
        }
    } else if (connector->line_to_line) {
        load.kw = current_A * kw_per_A;
        add_pair(&load, phase_of(connector, 0), phase_of(connector, 1), current_A);
    } else {
        load.kw = current_A * kw_per_A * (double)conductors;
        for (unsigned k = 0; k < conductors; k++) {
            add_phase(&load, phase_of(connector, k), current_A);
        }
    }
    return load;
}

sim_breach_t sim_breach_worse(sim_breach_t one, sim_breach_t other) {
    return other.by_kw > one.by_kw ? other : one;
}

static sim_breach_t above(sim_breach_t found, double value, double limit, double kw_per_unit) {
    found.by = value - limit;
    found.by_kw = found.by * kw_per_unit;
    return found.by > TOLERANCE ? found : (sim_breach_t){.kind = SIM_WITHIN};
}

/** Hold amperes of three lines against one limit; 0 is none. */
static sim_breach_t check_lines(const taper_station_config_t *station, sim_limit_kind_t kind, unsigned group,
                                const double *line_A, int32_t limit_mA) {
    sim_breach_t worst = {.kind = SIM_WITHIN};
    for (unsigned line = 0; line < 3 && limit_mA > 0; line++) {
        const sim_breach_t found = {.kind = kind, .group = group, .line = line};
        worst = sim_breach_worse(worst, above(found, line_A[line], (double)limit_mA / 1000.0,
                                              (double)station->site_voltage_mV / 1e6));
    }
    return worst;
}

static sim_breach_t check_currents(const taper_station_config_t *station, unsigned g, const sim_load_t *sum) {
    const taper_group_config_t *limits = &station->groups[g];
    double line_A[3];
    double delta_A[3];
    for (unsigned line = 0; line < 3; line++) {
        line_A[line] = cabs(sum->line_A[line]);
        delta_A[line] = cabs(sum->line_A[line] - sum->line_A[(line + 2) % 3]);
    }
    return sim_breach_worse(check_lines(station, SIM_PHASE, g, line_A, limits->limit_mA),
                            check_lines(station, SIM_DELTA, g, delta_A, limits->delta_mA));
}

static sim_breach_t check_group(const taper_station_config_t *station, unsigned g, const sim_load_t *sum,
                                double told_kw) {
    const taper_group_config_t *limits = &station->groups[g];
    const double own_kw = limits->limit_W > 0 ? (double)limits->limit_W / 1000.0 : (double)INFINITY;
    const sim_breach_t power = {.kind = SIM_POWER, .group = g};
    const sim_breach_t worst = above(power, sum->kw, fmin(own_kw, told_kw), 1.0);
    if (limits->limit_mA == 0 && limits->delta_mA == 0) { // no square roots for nothing
        return worst;
    }
    return sim_breach_worse(worst, check_currents(station, g, sum));
}

static void add(sim_load_t *sum, const sim_load_t *load) {
    sum->kw += load->kw;
    for (unsigned line = 0; line < 3; line++) {
        sum->line_A[line] += load->line_A[line];
    }
}

sim_breach_t sim_loads_check(const taper_station_config_t *station, const sim_load_t *load, double limit_kw,
                             sim_load_t *group) {
    for (unsigned g = 0; g < station->group_count; g++) {
        group[g] = (sim_load_t){0};
    }
    for (unsigned i = 0; i < station->connector_count; i++) {
        add(&group[station->connectors[i].group], &load[i]);
    }
    sim_breach_t worst = {.kind = SIM_WITHIN};
    for (unsigned g = station->group_count; g-- > 0;) { // a parent stands before its children
        if (g > 0) {
            add(&group[station->groups[g].parent], &group[g]);
        }
        const double told_kw = g == 0 ? limit_kw : (double)INFINITY;
        worst = sim_breach_worse(worst, check_group(station, g, &group[g], told_kw));
    }
    return worst;
}

static void add_setpoint(const taper_connector_config_t *connector, double setpoint_A, unsigned conductors,
                         double *line_A) {
    const unsigned wires = connector->line_to_line ? 2 : connector->is_dc ? 0 : conductors;
    for (unsigned k = 0; k < wires; k++) {
        line_A[phase_of(connector, k)] += setpoint_A;
    }
}

sim_breach_t sim_loads_check_imbalance(const taper_station_config_t *station, const double *setpoint_A,
                                       const uint8_t *conductors) {
    double line_A[TAPER_MAX_GROUPS][3] = {{0}};
    sim_breach_t worst = {.kind = SIM_WITHIN};
    for (unsigned i = 0; i < station->connector_count; i++) {
        const taper_connector_config_t *connector = &station->connectors[i];
        add_setpoint(connector, setpoint_A[i], conductors[i], line_A[connector->group]);
    }
    for (unsigned g = station->group_count; g-- > 0;) {
        double apart_A[3];
        for (unsigned line = 0; line < 3; line++) {
            apart_A[line] = fabs(line_A[g][line] - line_A[g][(line + 1) % 3]);
            if (g > 0) {
                line_A[station->groups[g].parent][line] += line_A[g][line];
            }
        }
        worst = sim_breach_worse(
            worst, check_lines(station, SIM_IMBALANCE, g, apart_A, station->groups[g].imbalance_mA));
    }
    return worst;
}

void sim_breach_text(const sim_breach_t *breach, char *text, size_t size) {
    static const char *const words[] = {"nothing", "power", "L", "delta side L", "imbalance from L"};
    char line[8] = "";
    if (breach->kind != SIM_POWER && breach->kind != SIM_WITHIN) {
        snprintf(line, sizeof line, "%u", breach->line + 1);
    }
    snprintf(text, size, "group %u: %s%s by %.3f %s", breach->group, words[breach->kind], line, breach->by,
             breach->kind == SIM_POWER ? "kW" : "A");
}
