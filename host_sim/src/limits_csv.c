#define _GNU_SOURCE // program_invocation_short_name

#include "limits_csv.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "csv_table.h"
#include "memory.h"

enum { COLUMN_TIME, COLUMN_LIMIT, COLUMN_COUNT };

static const sim_column_t columns[COLUMN_COUNT] = {
    [COLUMN_TIME] = {"time_s", true},
    [COLUMN_LIMIT] = {"limit_kw", true},
};

static void allocate(sim_limits_t *limits, size_t count) {
    limits->time_s = sim_allocate(count, sizeof *limits->time_s);
    limits->limit_kw = sim_allocate(count, sizeof *limits->limit_kw);
    limits->count = count;
}

void sim_limits_constant(sim_limits_t *limits, double limit_kw) {
    allocate(limits, 1);
    limits->limit_kw[0] = limit_kw;
}

static bool read_point(const sim_table_t *table, size_t row, const size_t *index, sim_limits_t *limits) {
    double *time_s = &limits->time_s[row];
    double *limit_kw = &limits->limit_kw[row];
    if (!sim_table_number(table, row, index[COLUMN_TIME], time_s) ||
        !sim_table_number(table, row, index[COLUMN_LIMIT], limit_kw)) {
        return false;
    }
    if (row > 0 && *time_s <= limits->time_s[row - 1]) {
        return sim_table_error(table, row, index[COLUMN_TIME], "not after the time of the row before");
    }
    return *limit_kw >= 0.0 || sim_table_error(table, row, index[COLUMN_LIMIT], "below 0");
}

static bool read_points(const sim_table_t *table, sim_limits_t *limits) {
    size_t index[COLUMN_COUNT];
    if (!sim_table_columns(table, columns, COLUMN_COUNT, index)) {
        return false;
    }
    if (table->rows == 0) {
        return sim_table_error(table, SIM_HEADER_ROW, index[COLUMN_TIME], "no rows, at least one is needed");
    }
    allocate(limits, table->rows);
    for (size_t row = 0; row < table->rows; row++) {
        if (!read_point(table, row, index, limits)) {
            return false;
        }
    }
    sim_table_warn_unknown(table, columns, COLUMN_COUNT);
    return true;
}

bool sim_limits_load(sim_limits_t *limits, const char *file) {
    *limits = (sim_limits_t){0};
    sim_table_t table;
    if (!sim_table_read(&table, file)) {
        return false;
    }
    const bool good = read_points(&table, limits);
    sim_table_free(&table);
    if (!good) {
        sim_limits_free(limits);
    }
    return good;
}

bool sim_limits_cap(sim_limits_t *limits, double most_kw) {
    bool any = false;
    for (size_t i = 0; i < limits->count; i++) {
        any = any || limits->limit_kw[i] > most_kw;
        limits->limit_kw[i] = fmin(limits->limit_kw[i], most_kw);
    }
    return any;
}

size_t sim_limits_point(const sim_limits_t *limits, double time_s) {
    size_t low = 0;
    size_t high = limits->count;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (limits->time_s[middle] <= time_s) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

double sim_limits_least_kw(const sim_limits_t *limits, double from_s, double to_s) {
    size_t i = sim_limits_point(limits, from_s);
    double least = limits->limit_kw[i];
    for (i++; i < limits->count && limits->time_s[i] < to_s; i++) {
        least = fmin(least, limits->limit_kw[i]);
    }
    return least;
}

bool sim_limits_choose(sim_limits_t *limits, const char *file, double limit_kw, double station_kw) {
    if (file == NULL) {
        sim_limits_constant(limits, limit_kw >= 0.0 ? limit_kw : station_kw);
    } else if (!sim_limits_load(limits, file)) {
        return false;
    }
    if (sim_limits_cap(limits, station_kw)) {
        fprintf(stderr, "%s: note: the limit is above the station's own, %g kW, which holds\n",
                program_invocation_short_name, station_kw);
    }
    return true;
}

void sim_limits_free(sim_limits_t *limits) {
    free(limits->time_s);
    free(limits->limit_kw);
    *limits = (sim_limits_t){0};
}
