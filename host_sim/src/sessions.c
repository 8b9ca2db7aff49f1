#include "sessions.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "csv_table.h"
#include "memory.h"

enum {
    COLUMN_ID,
    COLUMN_CONNECTOR,
    COLUMN_ARRIVAL,
    COLUMN_DEPARTURE,
    COLUMN_BATTERY,
    COLUMN_SOC_ARRIVAL,
    COLUMN_SOC_TARGET,
    COLUMN_MAX_POWER,
    COLUMN_TAPER,
    COLUMN_TOLD,
    COLUMN_PHASES,
    COLUMN_SECOND_MAX,
    COLUMN_SECOND_TAPER,
    COLUMN_CURVE,
    COLUMN_COUNT
};

static const sim_column_t columns[COLUMN_COUNT] = {
    [COLUMN_ID] = {"session_id", true},
    [COLUMN_CONNECTOR] = {"connector", true},
    [COLUMN_ARRIVAL] = {"arrival_s", true},
    [COLUMN_DEPARTURE] = {"departure_s", true},
    [COLUMN_BATTERY] = {"battery_kwh", true},
    [COLUMN_SOC_ARRIVAL] = {"soc_arrival", true},
    [COLUMN_SOC_TARGET] = {"soc_target", true},
    [COLUMN_MAX_POWER] = {"max_kw", true},
    [COLUMN_TAPER] = {"taper_kw", true},
    [COLUMN_TOLD] = {"expected_departure_s", false},
    [COLUMN_PHASES] = {"phases", false},
    [COLUMN_SECOND_MAX] = {"second_max_kw", false},
    [COLUMN_SECOND_TAPER] = {"second_taper_kw", false},
    [COLUMN_CURVE] = {"curve", false},
};

/** Times are carried in TIME_SYNC as 32-bit seconds; a time from 1970 on fits. */
#define LATEST_S 4294967295.0
/** The bus counts a session's energy in 16 bits of 10 Wh, and a vehicle's power in 16 bits of 10 W. */
#define MOST_ON_THE_BUS 655.34

/** The row being read. */
typedef struct {
    const sim_table_t *table;
    size_t row;
    size_t index[COLUMN_COUNT];
    unsigned connectors;
} row_t;

static bool read_range(const row_t *row, int column, double low, double high, double *value) {
    if (!sim_table_number(row->table, row->row, row->index[column], value)) {
        return false;
    }
    if (*value < low || *value > high) {
        return sim_table_error(row->table, row->row, row->index[column], "%s is outside %.10g..%.10g",
                               sim_table_cell(row->table, row->row, row->index[column]), low, high);
    }
    return true;
}

static bool read_positive(const row_t *row, int column, double high, double *value) {
    if (!sim_table_number(row->table, row->row, row->index[column], value)) {
        return false;
    }
    if (*value <= 0.0) {
        return sim_table_error(row->table, row->row, row->index[column], "must be above 0");
    }
    if (*value > high) {
        return sim_table_error(row->table, row->row, row->index[column],
                               "must not be above %.10g, the most that the bus carries", high);
    }
    return true;
}

/** Read digits, and nothing after them but `.0`: pandas writes whole numbers so where a column has empty fields. */
static bool parse_whole(const char *text, unsigned *value) {
    const size_t digits = strspn(text, "0123456789");
    const char *rest = text + digits;
    const bool whole =
        rest[0] == '\0' || (rest[0] == '.' && rest[1] == '0' && rest[1 + strspn(rest + 1, "0")] == '\0');
    // Six digits cannot overflow, and no station has as many connectors.
    if (digits < 1 || digits > 6 || !whole) {
        return false;
    }
    *value = (unsigned)strtoul(text, NULL, 10);
    return true;
}

static bool read_connector(const row_t *row, unsigned *connector) {
    const size_t column = row->index[COLUMN_CONNECTOR];
    const char *cell = sim_table_cell(row->table, row->row, column);
    *connector = 0;
    if (cell[0] == '\0') {
        return true;
    }
    if (!parse_whole(cell, connector)) {
        return sim_table_error(row->table, row->row, column, "unknown connector '%s', the station has 1..%u",
                               cell, row->connectors);
    }
    if (*connector < 1 || *connector > row->connectors) {
        return sim_table_error(row->table, row->row, column, "unknown connector %s, the station has 1..%u",
                               cell, row->connectors);
    }
    return true;
}

static bool read_times(const row_t *row, sim_session_t *session) {
    if (!read_range(row, COLUMN_ARRIVAL, 0.0, LATEST_S, &session->arrival_s) ||
        !read_range(row, COLUMN_DEPARTURE, 0.0, LATEST_S, &session->departure_s)) {
        return false;
    }
    if (session->departure_s <= session->arrival_s) {
        return sim_table_error(row->table, row->row, row->index[COLUMN_DEPARTURE], "not after arrival_s");
    }
    session->told_s = session->departure_s;
    const size_t told = row->index[COLUMN_TOLD];
    if (told == SIM_NO_COLUMN || sim_table_cell(row->table, row->row, told)[0] == '\0') {
        return true;
    }
    if (!read_range(row, COLUMN_TOLD, 0.0, LATEST_S, &session->told_s)) {
        return false;
    }
    return session->told_s >= session->arrival_s ||
           sim_table_error(row->table, row->row, told, "before arrival_s");
}

/** Text of an optional column; empty if there is none. */
static const char *optional_cell(const row_t *row, int column) {
    const size_t index = row->index[column];
    return index == SIM_NO_COLUMN ? "" : sim_table_cell(row->table, row->row, index);
}

/** A line of the taper: power at SOC 0, and its fall until SOC 1. */
static bool read_line(const row_t *row, int max_column, int taper_column, double *max_kw, double *taper_kw) {
    const size_t taper = row->index[taper_column];
    if (!read_positive(row, max_column, MOST_ON_THE_BUS, max_kw) ||
        !sim_table_number(row->table, row->row, taper, taper_kw)) {
        return false;
    }
    if (*taper_kw < 0.0) {
        return sim_table_error(row->table, row->row, taper, "below 0");
    }
    return *taper_kw <= *max_kw ||
           sim_table_error(row->table, row->row, taper, "above %s", columns[max_column].name);
}

/** Both columns of the second line, or neither. */
static bool read_second_line(const row_t *row, sim_session_t *session) {
    const bool has_max = optional_cell(row, COLUMN_SECOND_MAX)[0] != '\0';
    const bool has_taper = optional_cell(row, COLUMN_SECOND_TAPER)[0] != '\0';
    if (has_max != has_taper) {
        const int given = has_max ? COLUMN_SECOND_MAX : COLUMN_SECOND_TAPER;
        const int missing = has_max ? COLUMN_SECOND_TAPER : COLUMN_SECOND_MAX;
        return sim_table_error(row->table, row->row, row->index[given], "given without %s",
                               columns[missing].name);
    }
    return !has_max || read_line(row, COLUMN_SECOND_MAX, COLUMN_SECOND_TAPER, &session->second_max_kw,
                                 &session->second_taper_kw);
}

static bool read_curve(const row_t *row, sim_charge_curve_t *curve) {
    const char *cell = optional_cell(row, COLUMN_CURVE);
    unsigned at = 0;
    const char *reason = cell[0] == '\0' ? NULL : sim_charge_curve_read(curve, cell, MOST_ON_THE_BUS, &at);
    if (reason == NULL) {
        return true;
    }
    const size_t column = row->index[COLUMN_CURVE];
    return at == 0 ? sim_table_error(row->table, row->row, column, "%s", reason)
                   : sim_table_error(row->table, row->row, column, "point %u: %s", at, reason);
}

static bool read_vehicle(const row_t *row, sim_session_t *session) {
    if (!read_positive(row, COLUMN_BATTERY, MOST_ON_THE_BUS, &session->battery_kwh) ||
        !read_range(row, COLUMN_SOC_ARRIVAL, 0.0, 1.0, &session->soc_arrival) ||
        !read_range(row, COLUMN_SOC_TARGET, 0.0, 1.0, &session->soc_target)) {
        return false;
    }
    if (session->soc_target < session->soc_arrival) {
        return sim_table_error(row->table, row->row, row->index[COLUMN_SOC_TARGET], "below soc_arrival");
    }
    return read_line(row, COLUMN_MAX_POWER, COLUMN_TAPER, &session->max_kw, &session->taper_kw) &&
           read_second_line(row, session) && read_curve(row, &session->curve);
}

static bool read_phases(const row_t *row, uint8_t *phases) {
    const size_t column = row->index[COLUMN_PHASES];
    const char *cell = optional_cell(row, COLUMN_PHASES);
    unsigned count = 0;
    *phases = 0;
    if (cell[0] == '\0') {
        return true;
    }
    if (!parse_whole(cell, &count) || (count != 1 && count != 3)) {
        return sim_table_error(row->table, row->row, column, "neither 1 nor 3: '%s'", cell);
    }
    *phases = (uint8_t)count;
    return true;
}

static bool read_session(const row_t *row, sim_session_t *session) {
    const char *id = sim_table_cell(row->table, row->row, row->index[COLUMN_ID]);
    if (id[0] == '\0') {
        return sim_table_error(row->table, row->row, row->index[COLUMN_ID], "empty");
    }
    if (!read_connector(row, &session->connector) || !read_times(row, session) ||
        !read_vehicle(row, session) || !read_phases(row, &session->phases)) {
        return false;
    }
    session->id = sim_copy(id);
    return true;
}

/** A session's id and its place in the file. */
typedef struct {
    const char *id;
    size_t row;
} name_t;

static int compare_name(const void *a, const void *b) {
    const name_t *left = a;
    const name_t *right = b;
    const int order = strcmp(left->id, right->id);
    return order != 0 ? order : (left->row > right->row) - (left->row < right->row);
}

/** No two sessions have the same id; else the first row that repeats one is reported. */
static bool ids_differ(const row_t *row, const sim_sessions_t *sessions) {
    name_t *names = sim_allocate(sessions->count, sizeof *names);
    for (size_t i = 0; i < sessions->count; i++) {
        names[i] = (name_t){.id = sessions->session[i].id, .row = i};
    }
    qsort(names, sessions->count, sizeof *names, compare_name);
    size_t repeats = SIZE_MAX;
    for (size_t i = 1; i < sessions->count; i++) {
        if (names[i].row < repeats && strcmp(names[i - 1].id, names[i].id) == 0) {
            repeats = names[i].row;
        }
    }
    free(names);
    return repeats == SIZE_MAX || sim_table_error(row->table, repeats, row->index[COLUMN_ID],
                                                  "'%s' was given before", sessions->session[repeats].id);
}

static bool read_rows(row_t *row, sim_sessions_t *sessions) {
    sessions->session = sim_allocate(row->table->rows, sizeof *sessions->session);
    for (row->row = 0; row->row < row->table->rows; row->row++) {
        if (!read_session(row, &sessions->session[row->row])) {
            return false;
        }
        sessions->count++;
    }
    return ids_differ(row, sessions);
}

/** What the lines that it tells allow. */
static double told_kw(const sim_session_t *session, double soc) {
    double power_kw = session->max_kw - session->taper_kw * soc;
    if (session->second_max_kw > 0.0) {
        power_kw = fmin(power_kw, session->second_max_kw - session->second_taper_kw * soc);
    }
    return fmax(power_kw, 0.0);
}

double sim_session_takes_kw(const sim_session_t *session, double soc) {
    return session->curve.count > 0 ? sim_charge_curve_kw(&session->curve, soc) : told_kw(session, soc);
}

double sim_session_most_kw(const sim_session_t *session) {
    return session->curve.count > 0 ? sim_charge_curve_most_kw(&session->curve) : told_kw(session, 0.0);
}

bool sim_sessions_load(sim_sessions_t *sessions, const char *file, unsigned connectors) {
    *sessions = (sim_sessions_t){0};
    sim_table_t table;
    if (!sim_table_read(&table, file)) {
        return false;
    }
    row_t row = {.table = &table, .connectors = connectors};
    const bool good =
        sim_table_columns(&table, columns, COLUMN_COUNT, row.index) && read_rows(&row, sessions);
    if (good) {
        sim_table_warn_unknown(&table, columns, COLUMN_COUNT);
    } else {
        sim_sessions_free(sessions);
    }
    sim_table_free(&table);
    return good;
}

void sim_sessions_free(sim_sessions_t *sessions) {
    for (size_t i = 0; i < sessions->count; i++) {
        free(sessions->session[i].id);
    }
    free(sessions->session);
    *sessions = (sim_sessions_t){0};
}
