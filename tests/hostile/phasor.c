#include "phasor.h"

#include <math.h>

#define SQRT3 1.7320508075688772

/** Supply phase of a conductor: the names of the rotations say it. */
static unsigned supply_phase(unsigned rotation, unsigned conductor) {
    static const char *const names[7] = {"123", "123", "231", "312", "132", "213", "321"};
    return (unsigned)(names[rotation][conductor] - '1');
}

static void add_pair(load_t *load, const taper_connector_config_t *connector, double mA) {
    const unsigned one = supply_phase(connector->rotation, 0);
    const unsigned other = supply_phase(connector->rotation, 1);
    const unsigned first = other == (one + 1u) % 3u ? one : other;
    load->pair_mA[first] += mA;
    load->power_W += mA / 1000.0 * connector->voltage_mV / 1000.0;
}

/** A converter draws its power and its losses from all phases alike. */
static void add_converter(load_t *load, const taper_station_config_t *config,
                          const taper_connector_config_t *connector, double mA) {
    const double power_W = mA / 1000.0 * connector->voltage_mV / connector->efficiency_permille;
    load->power_W += power_W;
    for (unsigned phase = 0; phase < 3; phase++) {
        load->neutral_mA[phase] += power_W * 1e6 / (3.0 * config->site_voltage_mV);
    }
}

void load_add(load_t *load, const taper_station_config_t *config, unsigned connector, unsigned conductors,
              const double mA[3]) {
    const taper_connector_config_t *its = &config->connectors[connector];
    if (its->is_dc) {
        add_converter(load, config, its, mA[0]);
    } else if (its->line_to_line) {
        add_pair(load, its, mA[0]);
    } else {
        for (unsigned k = 0; k < conductors; k++) {
            load->neutral_mA[supply_phase(its->rotation, k)] += mA[k];
            load->power_W += mA[k] * its->voltage_mV / 1e6;
        }
    }
}

double load_line_mA(const load_t *load, unsigned line) {
    const double leaving = load->pair_mA[line];            /* 30 degrees ahead */
    const double coming = load->pair_mA[(line + 2u) % 3u]; /* 30 degrees behind */
    if (leaving + coming <= 0.0) {
        return load->neutral_mA[line];
    }
    const double along = load->neutral_mA[line] + SQRT3 / 2.0 * (leaving + coming);
    return hypot(along, (leaving - coming) / 2.0);
}

typedef struct {
    double x, y;
} phasor_t;

static phasor_t phase_unit(unsigned phase) {
    static const phasor_t units[3] = {{1.0, 0.0}, {-0.5, -SQRT3 / 2.0}, {-0.5, SQRT3 / 2.0}};
    return units[phase % 3u];
}

/** Direction of the current of pair `pair`, L1-L2 first, in line `line`; nothing if it is not between. */
static phasor_t pair_in_line(unsigned pair, unsigned line) {
    const phasor_t from = phase_unit(pair);
    const phasor_t to = phase_unit(pair + 1u);
    const double sign = line == pair ? 1.0 : line == (pair + 1u) % 3u ? -1.0 : 0.0;
    return (phasor_t){sign * (from.x - to.x) / SQRT3, sign * (from.y - to.y) / SQRT3};
}

/** What parts 0..2 (phases) and 3..5 (pairs) carry in the delta line: the difference of two lines of the wye side. */
static phasor_t part_in_delta(const load_t *load, unsigned part, unsigned line) {
    const unsigned other = (line + 2u) % 3u;
    if (part < 3u) {
        const phasor_t unit = phase_unit(part);
        const double sign = part == line ? 1.0 : part == other ? -1.0 : 0.0;
        const double mA = sign * load->neutral_mA[part];
        return (phasor_t){mA * unit.x, mA * unit.y};
    }
    const phasor_t here = pair_in_line(part - 3u, line);
    const phasor_t there = pair_in_line(part - 3u, other);
    const double mA = load->pair_mA[part - 3u];
    return (phasor_t){mA * (here.x - there.x), mA * (here.y - there.y)};
}

double load_delta_mA(const load_t *load, unsigned line) {
    phasor_t part[6];
    double worst = 0.0;
    for (unsigned k = 0; k < 6; k++) {
        part[k] = part_in_delta(load, k, line);
    }
    for (unsigned on = 0; on < 64; on++) {
        phasor_t sum = {0.0, 0.0};
        for (unsigned k = 0; k < 6; k++) {
            sum.x += (on >> k & 1u) != 0u ? part[k].x : 0.0;
            sum.y += (on >> k & 1u) != 0u ? part[k].y : 0.0;
        }
        worst = fmax(worst, sum.x * sum.x + sum.y * sum.y);
    }
    return sqrt(worst);
}
