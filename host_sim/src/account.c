#define _GNU_SOURCE // program_invocation_short_name

#include "account.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>

static unsigned connectors(const sim_account_t *account) {
    return account->fleet->station->connector_count;
}

/** Hold what is drawn now against every limit. */
static void check(sim_account_t *account) {
    const taper_station_config_t *station = account->fleet->station;
    sim_load_t load[TAPER_MAX_CONNECTORS];
    sim_load_t group[TAPER_MAX_GROUPS];
    double setpoint_A[TAPER_MAX_CONNECTORS];
    for (unsigned i = 0; i < connectors(account); i++) {
        const sim_evse_t *evse = &account->fleet->evse[i];
        load[i] = sim_load_of(station, i, sim_evse_conductors(evse), evse->current_A);
        setpoint_A[i] = (double)evse->setpoint_mA / 1000.0;
    }
    const sim_breach_t drawn = sim_loads_check(station, load, account->limit_kw, group);
    const sim_breach_t told = sim_loads_check_imbalance(station, setpoint_A, account->told);
    account->worst = sim_breach_worse(account->worst, sim_breach_worse(drawn, told));
    account->results->peak_kw = fmax(account->results->peak_kw, group[0].kw);
}

void sim_account_begin(sim_account_t *account, int64_t now_s, double limit_kw) {
    account->begin_s = now_s;
    account->at_s = (double)now_s;
    account->limit_kw = limit_kw;
    account->active = 0;
    account->site_kwh = 0.0;
    account->worst = (sim_breach_t){.kind = SIM_WITHIN};
    for (unsigned i = 0; i < connectors(account); i++) {
        const sim_evse_t *evse = &account->fleet->evse[i];
        account->active += sim_evse_wants(evse) ? 1 : 0;
        account->soc[i] = evse->vehicle == NULL ? 0.0 : sim_evse_soc(evse);
        account->A_s[i] = 0.0;
        account->told[i] = sim_evse_told_conductors(evse);
    }
    sim_account_obey(account);
}

void sim_account_obey(sim_account_t *account) {
    bool changed = false;
    for (unsigned i = 0; i < connectors(account); i++) {
        changed = sim_fleet_draw(account->fleet, i, account->at_s) || changed;
    }
    if (changed) {
        check(account);
    }
}

void sim_account_pass(sim_account_t *account, double now_s) {
    const taper_station_config_t *station = account->fleet->station;
    const double passed_s = now_s - account->at_s;
    double grid_kwh = 0.0;
    for (unsigned i = 0; i < connectors(account); i++) {
        const sim_evse_t *evse = &account->fleet->evse[i];
        const double grid_kw = sim_load_of(station, i, sim_evse_conductors(evse), evse->current_A).kw;
        const double charged_kwh = sim_fleet_charge(account->fleet, i, account->at_s, now_s);
        account->A_s[i] += evse->current_A * passed_s;
        account->site_kwh += grid_kw * passed_s / 3600.0;
        grid_kwh += evse->power_kw > 0.0 ? charged_kwh * grid_kw / evse->power_kw : 0.0;
    }
    if (account->prices != NULL) {
        account->results->cost += grid_kwh * sim_course_mean(account->prices, account->at_s, now_s);
    }
    account->at_s = now_s;
}

static void write_connectors(const sim_account_t *account, const taper_outlook_t *outlook) {
    for (unsigned i = 0; i < connectors(account); i++) {
        const sim_evse_t *evse = &account->fleet->evse[i];
        if (evse->vehicle != NULL) {
            const sim_connector_row_t row = {.time_s = account->begin_s,
                                             .connector = i,
                                             .evse = evse,
                                             .soc = account->soc[i],
                                             .current_A = account->A_s[i] / account->fleet->tick_s,
                                             .outlook = outlook == NULL ? NULL : &outlook[i]};
            sim_results_connector(account->results, &row);
        }
    }
}

/** The first tick above a limit is worth a line; the others are counted. */
static void note_breach(const sim_account_t *account) {
    if (account->worst.kind == SIM_WITHIN) {
        return;
    }
    if (account->results->violation_ticks == 0) {
        char text[100];
        sim_breach_text(&account->worst, text, sizeof text);
        fprintf(stderr, "%s: above a limit at %lld s, %s\n", program_invocation_short_name,
                (long long)account->begin_s, text);
    }
    account->results->violation_ticks++;
}

void sim_account_end(sim_account_t *account, taper_mode_t mode, const taper_outlook_t *outlook) {
    const double tick_s = account->fleet->tick_s;
    sim_account_pass(account, (double)account->begin_s + tick_s);
    note_breach(account);
    sim_results_step(account->results, account->begin_s, account->limit_kw,
                     account->site_kwh * 3600.0 / tick_s, account->active, mode);
    write_connectors(account, outlook);
}
