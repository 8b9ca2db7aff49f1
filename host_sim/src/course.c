#include "course.h"

#include <math.h>
#include <stdlib.h>

#include "csv_table.h"
#include "memory.h"

enum { COLUMN_TIME, COLUMN_VALUE, COLUMN_COUNT };

/** A file being read. */
typedef struct {
    const sim_table_t *table;
    size_t index[COLUMN_COUNT];
    double low, high;
} reader_t;

static void allocate(sim_course_t *course, size_t count) {
    course->time_s = sim_allocate(count, sizeof *course->time_s);
    course->value = sim_allocate(count, sizeof *course->value);
    course->count = count;
}

void sim_course_constant(sim_course_t *course, double value) {
    allocate(course, 1);
    course->value[0] = value;
}

static bool read_value(const reader_t *reader, size_t row, double value) {
    const size_t column = reader->index[COLUMN_VALUE];
    if (value < reader->low) {
        return sim_table_error(reader->table, row, column, "below %.10g", reader->low);
    }
    return value <= reader->high || sim_table_error(reader->table, row, column, "above %.10g", reader->high);
}

static bool read_point(const reader_t *reader, size_t row, sim_course_t *course) {
    double *time_s = &course->time_s[row];
    double *value = &course->value[row];
    if (!sim_table_number(reader->table, row, reader->index[COLUMN_TIME], time_s) ||
        !sim_table_number(reader->table, row, reader->index[COLUMN_VALUE], value)) {
        return false;
    }
    if (row > 0 && *time_s <= course->time_s[row - 1]) {
        return sim_table_error(reader->table, row, reader->index[COLUMN_TIME],
                               "not after the time of the row before");
    }
    return read_value(reader, row, *value);
}

static bool read_points(reader_t *reader, const char *name, sim_course_t *course) {
    const sim_column_t columns[COLUMN_COUNT] = {[COLUMN_TIME] = {"time_s", true},
                                                [COLUMN_VALUE] = {name, true}};
    if (!sim_table_columns(reader->table, columns, COLUMN_COUNT, reader->index)) {
        return false;
    }
    if (reader->table->rows == 0) {
        return sim_table_error(reader->table, SIM_HEADER_ROW, reader->index[COLUMN_TIME],
                               "no rows, at least one is needed");
    }
    allocate(course, reader->table->rows);
    for (size_t row = 0; row < reader->table->rows; row++) {
        if (!read_point(reader, row, course)) {
            return false;
        }
    }
    sim_table_warn_unknown(reader->table, columns, COLUMN_COUNT);
    return true;
}

bool sim_course_load(sim_course_t *course, const char *file, const char *name, double low, double high) {
    *course = (sim_course_t){0};
    sim_table_t table;
    if (!sim_table_read(&table, file)) {
        return false;
    }
    reader_t reader = {.table = &table, .low = low, .high = high};
    const bool good = read_points(&reader, name, course);
    sim_table_free(&table);
    if (!good) {
        sim_course_free(course);
    }
    return good;
}

size_t sim_course_point(const sim_course_t *course, double time_s) {
    size_t low = 0;
    size_t high = course->count;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (course->time_s[middle] <= time_s) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

double sim_course_least(const sim_course_t *course, double from_s, double to_s) {
    size_t i = sim_course_point(course, from_s);
    double least = course->value[i];
    for (i++; i < course->count && course->time_s[i] < to_s; i++) {
        least = fmin(least, course->value[i]);
    }
    return least;
}

double sim_course_mean(const sim_course_t *course, double from_s, double to_s) {
    size_t i = sim_course_point(course, from_s);
    double sum = 0.0;
    double at_s = from_s;
    while (i + 1 < course->count && course->time_s[i + 1] < to_s) {
        sum += course->value[i] * (course->time_s[i + 1] - at_s);
        at_s = course->time_s[++i];
    }
    sum += course->value[i] * (to_s - at_s);
    return from_s < to_s ? sum / (to_s - from_s) : course->value[i];
}

void sim_course_free(sim_course_t *course) {
    free(course->time_s);
    free(course->value);
    *course = (sim_course_t){0};
}
