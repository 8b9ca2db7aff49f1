/**
 * A CSV file in memory, with typed reading of its cells and errors that name file, line and column.
 *
 * The dialect is RFC 4180: a header, comma, double quotes where needed; LF or CRLF, with or without a UTF-8 byte order
 * mark; blanks around a field and blank lines do not count. Every function that can fail prints one line
 * `FILE:LINE: COLUMN: reason` on stderr and returns false.
 */
#ifndef SIM_CSV_TABLE_H
#define SIM_CSV_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    const char *file; /**< as the user gave it; borrowed */
    size_t columns;
    size_t rows;  /**< without the header */
    char *text;   /**< all cells, each ended by a NUL */
    size_t *cell; /**< [(rows + 1) * columns] start of each cell in `text`, header first */
    size_t *line; /**< [rows + 1] line on which each row ends, from 1 */
} sim_table_t;

/** A column that the program understands. */
typedef struct {
    const char *name;
    bool required;
} sim_column_t;

/** `index` of an optional column that the file does not have. */
#define SIM_NO_COLUMN SIZE_MAX
/** `row` of the header, for sim_table_error(). */
#define SIM_HEADER_ROW SIZE_MAX

/** Read a whole file. On success the caller frees the table with sim_table_free(). */
bool sim_table_read(sim_table_t *table, const char *file);

void sim_table_free(sim_table_t *table);

/** Find each of `count` columns by its name. `index[count]` receives their places or SIM_NO_COLUMN. */
bool sim_table_columns(const sim_table_t *table, const sim_column_t *column, size_t count, size_t *index);

/** Name, on stderr, the columns of the file that are none of `column[count]`: they are ignored. Never fails. */
void sim_table_warn_unknown(const sim_table_t *table, const sim_column_t *column, size_t count);

/** Text of a cell; `row` from 0. */
const char *sim_table_cell(const sim_table_t *table, size_t row, size_t column);

/** Read a cell as a finite decimal number; nothing else may stand in it. */
bool sim_table_number(const sim_table_t *table, size_t row, size_t column, double *value);

/** Report a cell. @return false, always, so that a check can end in it. */
bool sim_table_error(const sim_table_t *table, size_t row, size_t column, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/** Read `text` as a finite decimal number. @return false, silently, if it is anything else. */
bool sim_parse_number(const char *text, double *value);

#endif
