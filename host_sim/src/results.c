#define _POSIX_C_SOURCE 200809L

#include "results.h"

#include <cjson/cJSON.h>
#include <csv.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "memory.h"
#include "output.h"
#include "words.h"

/** A session that leaves with this much less than its target is satisfied still. */
#define SOC_TOLERANCE 0.01
/** What rounding of sums of doubles may leave at that edge. */
#define SOC_HAIR 1e-9

/** Totals over all sessions. */
typedef struct {
    double requested_kwh, delivered_kwh;
    size_t satisfied, queued, never_plugged_in;
} totals_t;

static void open_text(sim_text_t *text) {
    text->stream = open_memstream(&text->text, &text->size);
    if (text->stream == NULL) {
        sim_out_of_memory();
    }
}

static void free_text(sim_text_t *text) {
    if (text->stream != NULL) {
        fclose(text->stream);
        free(text->text);
    }
    *text = (sim_text_t){0};
}

void sim_results_init(sim_results_t *results, const sim_sessions_t *sessions, bool records) {
    *results = (sim_results_t){.sessions = sessions, .min_current_A = -1.0, .price_weight = -1.0};
    results->outcome = sim_allocate(sessions->count, sizeof *results->outcome);
    if (records) {
        open_text(&results->steps);
        open_text(&results->connectors);
        fputs("time_s,limit_kw,power_kw,active,mode\n", results->steps.stream);
        fputs("time_s,connector,session_id,setpoint_a,current_a,soc,reason,waiting_place,waiting_of,"
              "soc_estimated,expected_soc,short_kwh,because\n",
              results->connectors.stream);
    }
}

void sim_results_free(sim_results_t *results) {
    free(results->outcome);
    free_text(&results->steps);
    free_text(&results->connectors);
    sim_samples_free(&results->iterations);
    sim_samples_free(&results->solve_ms);
    sim_work_free(&results->work);
    *results = (sim_results_t){0};
}

void sim_results_step(sim_results_t *results, int64_t time_s, double limit_kw, double power_kw,
                      unsigned active, taper_mode_t mode) {
    results->peak_kw = fmax(results->peak_kw, power_kw);
    if (results->steps.stream != NULL) {
        fprintf(results->steps.stream, "%" PRId64 ",%.4f,%.4f,%u,%s\n", time_s, limit_kw, power_kw, active,
                sim_mode_word(mode));
    }
}

/** Write a text as a CSV field, quoted only if it has to be. */
static void put_field(FILE *stream, const char *text) {
    if (strpbrk(text, ",\"\r\n") == NULL) {
        fputs(text, stream);
    } else {
        csv_fwrite(stream, text, strlen(text));
    }
}

/** Whether the station expects the vehicle to leave with less than it wants. */
static bool leaves_short(const taper_outlook_t *outlook) {
    return outlook->short_Wh != TAPER_ABSENT && outlook->short_Wh > 0;
}

static void put_outlook(FILE *stream, const taper_outlook_t *outlook) {
    fprintf(stream, ",%s,%u,%u,%d,", sim_reason_word(outlook->reason), outlook->waiting_place,
            outlook->waiting_of, outlook->soc_estimated ? 1 : 0);
    if (outlook->soc_at_departure_permille != TAPER_ABSENT) {
        fprintf(stream, "%.3f", outlook->soc_at_departure_permille / 1000.0);
    }
    fputc(',', stream);
    if (outlook->short_Wh != TAPER_ABSENT) {
        fprintf(stream, "%.3f", outlook->short_Wh / 1000.0);
    }
    fprintf(stream, ",%s\n", leaves_short(outlook) ? sim_reason_word(outlook->because) : "");
}

/** The last outlook of a session is its verdict. */
static void keep_verdict(sim_results_t *results, const sim_connector_row_t *row) {
    const size_t session = (size_t)(row->evse->vehicle - results->sessions->session);
    sim_outcome_t *outcome = &results->outcome[session];
    outcome->told = true;
    outcome->reason = row->outlook->reason;
    outcome->because = row->outlook->because;
    outcome->leaves_short = leaves_short(row->outlook);
}

void sim_results_connector(sim_results_t *results, const sim_connector_row_t *row) {
    FILE *stream = results->connectors.stream;
    if (row->outlook != NULL) {
        keep_verdict(results, row);
    }
    if (stream == NULL) {
        return;
    }
    fprintf(stream, "%" PRId64 ",%u,", row->time_s, row->connector + 1);
    put_field(stream, row->evse->vehicle->id);
    fprintf(stream, ",%.3f,%.3f,%.5f", row->evse->setpoint_mA / 1000.0, row->current_A, row->soc);
    if (row->outlook != NULL) {
        put_outlook(stream, row->outlook);
    } else {
        fputs(",,,,,,,\n", stream);
    }
}

static double soc_departure(const sim_session_t *session, const sim_outcome_t *outcome) {
    return session->soc_arrival + outcome->energy_kwh / session->battery_kwh;
}

static bool satisfied(const sim_session_t *session, const sim_outcome_t *outcome) {
    return soc_departure(session, outcome) >= session->soc_target - SOC_TOLERANCE - SOC_HAIR;
}

static totals_t sum_up(const sim_results_t *results) {
    totals_t totals = {0};
    for (size_t i = 0; i < results->sessions->count; i++) {
        const sim_session_t *session = &results->sessions->session[i];
        const sim_outcome_t *outcome = &results->outcome[i];
        totals.requested_kwh += sim_session_request_kwh(session);
        totals.delivered_kwh += outcome->energy_kwh;
        totals.satisfied += satisfied(session, outcome) ? 1 : 0;
        totals.queued += outcome->queued_s > 0.0 ? 1 : 0;
        totals.never_plugged_in += outcome->connector == 0 ? 1 : 0;
    }
    return totals;
}

/** The text of sessions.csv. */
static void put_sessions(const sim_results_t *results, FILE *stream) {
    fputs("session_id,connector,energy_kwh,soc_departure,satisfied,short_kwh,queued_s,reason,because\n",
          stream);
    for (size_t i = 0; i < results->sessions->count; i++) {
        const sim_session_t *session = &results->sessions->session[i];
        const sim_outcome_t *outcome = &results->outcome[i];
        put_field(stream, session->id);
        if (outcome->connector != 0) {
            fprintf(stream, ",%u", outcome->connector);
        } else {
            fputc(',', stream);
        }
        const double short_kwh = fmax(sim_session_request_kwh(session) - outcome->energy_kwh, 0.0);
        fprintf(stream, ",%.4f,%.5f,%d,%.4f,%.3f,%s,%s\n", outcome->energy_kwh,
                soc_departure(session, outcome), satisfied(session, outcome) ? 1 : 0, short_kwh,
                outcome->queued_s, outcome->told ? sim_reason_word(outcome->reason) : "",
                outcome->leaves_short ? sim_reason_word(outcome->because) : "");
    }
}

/** Add a number with a fixed count of decimals. */
static void add_fixed(cJSON *object, const char *name, double value, int decimals) {
    char text[64];
    snprintf(text, sizeof text, "%.*f", decimals, value);
    cJSON_AddRawToObject(object, name, text);
}

/** The same, or null. */
static void add_given(cJSON *object, const char *name, bool given, double value, int decimals) {
    if (given) {
        add_fixed(object, name, value, decimals);
    } else {
        cJSON_AddNullToObject(object, name);
    }
}

static void add_count(cJSON *object, const char *name, uint64_t value) {
    char text[32];
    snprintf(text, sizeof text, "%" PRIu64, value);
    cJSON_AddRawToObject(object, name, text);
}

static void add_spread(cJSON *object, const char *name, sim_samples_t *samples, int decimals) {
    const sim_spread_t spread = sim_samples_spread(samples);
    cJSON *inner = cJSON_AddObjectToObject(object, name);
    add_fixed(inner, "p50", spread.p50, decimals);
    add_fixed(inner, "p99", spread.p99, decimals);
    add_fixed(inner, "max", spread.max, decimals);
}

static void add_known_count(cJSON *object, const char *name, bool known, uint32_t value) {
    if (known) {
        add_count(object, name, value);
    } else {
        cJSON_AddNullToObject(object, name);
    }
}

/** What was measured on the board. */
static void add_board(cJSON *object, sim_results_t *results) {
    sim_work_t *work = &results->work;
    const sim_hardware_t *hardware = &results->hardware;
    const bool counted = work->ticks.count > 0;
    const bool has_stack = hardware->stack_size_B > 0;
    cJSON *board = cJSON_AddObjectToObject(object, "board");
    cJSON *per_tick = cJSON_AddObjectToObject(board, "instructions_per_tick");
    add_known_count(per_tick, "p50", counted, (uint32_t)sim_samples_spread(&work->ticks).p50);
    add_known_count(per_tick, "max", counted, work->worst);
    add_known_count(per_tick, "max_without_slice", counted, work->worst_without_slice);
    add_known_count(board, "max_instructions_per_poll", counted, work->worst_poll);
    add_known_count(board, "mean_instructions_per_frame", hardware->frame_mean > 0, hardware->frame_mean);
    add_known_count(board, "max_instructions_for_frames_of_tick", hardware->frames_worst > 0,
                    hardware->frames_worst);
    add_known_count(board, "stack_used_b", has_stack, hardware->stack_used_B);
    add_known_count(board, "stack_size_b", has_stack, hardware->stack_size_B);
}

/** What the station was not told, or told wrong. */
static void add_errors(cJSON *object, const sim_results_t *results) {
    const sim_errors_t *errors = results->errors;
    cJSON *inner = cJSON_AddObjectToObject(object, "errors");
    cJSON_AddStringToObject(inner, "soc", errors->soc_absent ? "absent" : "exact");
    add_fixed(inner, "soc_error", errors->soc, 4);
    add_fixed(inner, "taper_error", errors->taper, 4);
    add_fixed(inner, "meter_noise", errors->meter_noise, 4);
    cJSON_AddBoolToObject(inner, "limit_unannounced", results->unannounced);
}

/** The text of summary.json; NULL without memory. To be freed with cJSON_free(). */
static char *summary_json(sim_results_t *results) {
    const totals_t totals = sum_up(results);
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "policy", results->policy);
    cJSON_AddStringToObject(object, "station", results->station);
    add_count(object, "sessions", results->sessions->count);
    add_fixed(object, "requested_kwh", totals.requested_kwh, 4);
    add_fixed(object, "delivered_kwh", totals.delivered_kwh, 4);
    add_count(object, "satisfied", totals.satisfied);
    add_count(object, "limit_violations", results->violation_ticks);
    add_count(object, "fallback_ticks", results->fallback_ticks);
    add_count(object, "solves", results->solves);
    add_spread(object, "iterations", &results->iterations, 0);
    if (results->hardware.known) {
        cJSON_AddNullToObject(object, "solve_ms");
    } else {
        add_spread(object, "solve_ms", &results->solve_ms, 3);
    }
    add_fixed(object, "peak_kw", results->peak_kw, 4);
    add_count(object, "tick_s", (uint64_t)results->tick_s);
    add_given(object, "min_current_a", results->min_current_A >= 0.0, results->min_current_A, 3);
    add_count(object, "seed", results->seed);
    add_count(object, "queued", totals.queued);
    add_count(object, "never_plugged_in", totals.never_plugged_in);
    add_count(object, "guard_violations", results->guard_violations);
    const bool per_kwh = results->priced && totals.delivered_kwh > 0.0;
    add_given(object, "energy_cost", results->priced, results->cost, 4);
    add_given(object, "cost_per_kwh", per_kwh, per_kwh ? results->cost / totals.delivered_kwh : 0.0, 5);
    add_given(object, "price_weight", results->price_weight >= 0.0, results->price_weight, 3);
    if (results->learns) {
        cJSON_AddTrueToObject(object, "learns_taper");
    }
    if (results->errors != NULL) {
        add_errors(object, results);
    }
    if (results->hardware.known) {
        add_board(object, results);
    }
    char *text = cJSON_Print(object);
    cJSON_Delete(object);
    return text;
}

bool sim_results_write(sim_results_t *results, const char *directory) {
    sim_text_t sessions = {0};
    open_text(&sessions);
    put_sessions(results, sessions.stream);
    char *summary = summary_json(results);
    // After a flush the text and size of a memory stream are up to date; a failed one means that memory ran out.
    const bool good = summary != NULL && fflush(sessions.stream) == 0 && fflush(results->steps.stream) == 0 &&
                      fflush(results->connectors.stream) == 0;
    bool written = false;
    if (good) {
        const sim_output_t files[] = {{"sessions.csv", sessions.text, sessions.size},
                                      {"steps.csv", results->steps.text, results->steps.size},
                                      {"connectors.csv", results->connectors.text, results->connectors.size},
                                      {"summary.json", summary, strlen(summary)}};
        written = sim_output_write(directory, files, sizeof files / sizeof files[0]);
    } else {
        sim_out_of_memory();
    }
    cJSON_free(summary);
    free_text(&sessions);
    return written;
}

static void print_solves(sim_results_t *results, FILE *stream) {
    const sim_spread_t iterations = sim_samples_spread(&results->iterations);
    const sim_spread_t solve_ms = sim_samples_spread(&results->solve_ms);
    if (results->solves == 0) {
        return;
    }
    fprintf(stream, "%" PRIu32 " solves: iterations p50 %.0f, p99 %.0f, max %.0f", results->solves,
            iterations.p50, iterations.p99, iterations.max);
    if (!results->hardware.known) {
        fprintf(stream, "; ms p50 %.2f, p99 %.2f, max %.2f", solve_ms.p50, solve_ms.p99, solve_ms.max);
    }
    fputc('\n', stream);
}

static void print_board(sim_results_t *results, FILE *stream) {
    sim_work_t *work = &results->work;
    if (work->ticks.count > 0) {
        fprintf(stream,
                "board: instructions per tick p50 %.0f, max %" PRIu32 ", max without a solver slice %" PRIu32
                "; per poll max %" PRIu32 "\n",
                sim_samples_spread(&work->ticks).p50, work->worst, work->worst_without_slice,
                work->worst_poll);
    }
    if (results->hardware.frame_mean > 0) {
        fprintf(stream, "board: instructions per frame mean %" PRIu32 ", for all of a tick max %" PRIu32 "\n",
                results->hardware.frame_mean, results->hardware.frames_worst);
    }
    if (results->hardware.stack_size_B > 0) {
        fprintf(stream, "board: stack %" PRIu32 " of %" PRIu32 " bytes used\n",
                results->hardware.stack_used_B, results->hardware.stack_size_B);
    }
}

void sim_results_print(sim_results_t *results, FILE *stream) {
    const totals_t totals = sum_up(results);
    const double share =
        totals.requested_kwh > 0.0 ? 100.0 * totals.delivered_kwh / totals.requested_kwh : 100.0;
    fprintf(stream,
            "%s, station %s: %.1f of %.1f kWh (%.2f %%), %zu of %zu sessions satisfied, peak %.1f kW\n",
            results->policy, results->station, totals.delivered_kwh, totals.requested_kwh, share,
            totals.satisfied, results->sessions->count, results->peak_kw);
    fprintf(stream,
            "%zu queued, %zu never plugged in; %" PRIu32 " fallback ticks, %" PRIu32 " limit violations\n",
            totals.queued, totals.never_plugged_in, results->fallback_ticks, results->violation_ticks);
    if (results->priced) {
        fprintf(stream, "the energy cost %.2f, %.4f per kWh delivered\n", results->cost,
                totals.delivered_kwh > 0.0 ? results->cost / totals.delivered_kwh : 0.0);
    }
    print_solves(results, stream);
    print_board(results, stream);
}
