#include "tapers.h"

#include <math.h>

#include "taper/learn.h"

static const double shares[] = {0.1, 0.25, 0.5};
#define SHARES (sizeof shares / sizeof shares[0])

void sim_tapers_init(sim_tapers_t *tapers, FILE *stream) {
    *tapers = (sim_tapers_t){.stream = stream};
    if (stream != NULL) {
        fputs("session_id,share,learned,sure,limit_kw,true_kw,limit_end_kw,true_end_kw,error\n", stream);
    }
}

/** The vehicle's own limit at an energy charged [kW]. */
static double true_kw(const sim_session_t *vehicle, double energy_kwh) {
    const double soc = vehicle->soc_arrival + energy_kwh / vehicle->battery_kwh;
    return fmax(vehicle->max_kw - vehicle->taper_kw * soc, 0.0);
}

/** And by the station [kW]. */
static double learned_kw(const taper_learn_t *line, double energy_kwh) {
    return taper_learn_limit_W(line, (int32_t)lround(energy_kwh * 1000.0)) / 1000.0;
}

static bool is_sure(const taper_learn_t *line, const sim_evse_t *evse) {
    const double missing_Wh = sim_evse_missing_kwh(evse) * 1000.0;
    return taper_learn_is_sure(line, (int32_t)lround(evse->energy_kwh * 1000.0), (int32_t)lround(missing_Wh));
}

static void put_row(FILE *stream, const sim_evse_t *evse, double share, const taper_learn_t *line) {
    const sim_session_t *vehicle = evse->vehicle;
    const double now_kwh = evse->energy_kwh;
    const double end_kwh = sim_session_request_kwh(vehicle);
    const double limit_kw = learned_kw(line, now_kwh);
    const double limit_end_kw = learned_kw(line, end_kwh);
    const double off_kw =
        fmax(fabs(limit_kw - true_kw(vehicle, now_kwh)), fabs(limit_end_kw - true_kw(vehicle, end_kwh)));
    fprintf(stream, "%s,%.2f,%d,%d,%.4f,%.4f,%.4f,%.4f,%.5f\n", vehicle->id, share,
            taper_learn_knows(line) ? 1 : 0, is_sure(line, evse) ? 1 : 0, limit_kw, true_kw(vehicle, now_kwh),
            limit_end_kw, true_kw(vehicle, end_kwh), off_kw / vehicle->max_kw);
}

static void note(sim_tapers_t *tapers, unsigned i, const sim_evse_t *evse, const taper_learn_t *line) {
    if (tapers->vehicle[i] != evse->vehicle) {
        tapers->vehicle[i] = evse->vehicle;
        tapers->next[i] = 0;
    }
    const double request_kwh = evse->vehicle == NULL ? 0.0 : sim_session_request_kwh(evse->vehicle);
    while (request_kwh > 0.0 && tapers->next[i] < SHARES &&
           evse->energy_kwh >= shares[tapers->next[i]] * request_kwh) {
        put_row(tapers->stream, evse, shares[tapers->next[i]], line);
        tapers->next[i]++;
    }
}

void sim_tapers_note(sim_tapers_t *tapers, const sim_fleet_t *fleet, const taper_station_t *station) {
    if (tapers->stream == NULL) {
        return;
    }
    for (unsigned i = 0; i < fleet->station->connector_count; i++) {
        note(tapers, i, &fleet->evse[i], &station->learning[i].line);
    }
}
