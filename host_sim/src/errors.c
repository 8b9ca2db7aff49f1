#include "errors.h"

#include <math.h>

#define TWO_PI 6.283185307179586

/** The splitmix64 generator. */
static uint64_t next(uint64_t *state) {
    *state += UINT64_C(0x9E3779B97F4A7C15);
    uint64_t z = *state;
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

/** Uniform in (0, 1). */
static double uniform(uint64_t *state) {
    return ((double)(next(state) >> 11) + 0.5) / 9007199254740992.0;
}

/** Uniform within `most` on both sides of 0. */
static double within(uint64_t *state, double most) {
    return most * (2.0 * uniform(state) - 1.0);
}

sim_vehicle_errors_t sim_errors_of(const sim_errors_t *errors, const char *session_id) {
    uint64_t state = errors->seed ^ UINT64_C(0xCBF29CE484222325); // FNV-1a of the id, from there on
    for (const char *c = session_id; *c != '\0'; c++) {
        state = (state ^ (uint8_t)*c) * UINT64_C(0x100000001B3);
    }
    sim_vehicle_errors_t vehicle;
    vehicle.soc = within(&state, errors->soc);
    vehicle.taper = 1.0 + within(&state, errors->taper);
    vehicle.metered = 1.0;
    vehicle.noise = state;
    return vehicle;
}

void sim_errors_measure(const sim_errors_t *errors, sim_vehicle_errors_t *vehicle) {
    if (errors->meter_noise > 0.0) {
        const double radius = sqrt(-2.0 * log(uniform(&vehicle->noise))); // Box and Muller
        const double normal = radius * cos(TWO_PI * uniform(&vehicle->noise));
        vehicle->metered = fmax(1.0 + errors->meter_noise * normal, 0.0);
    }
}
