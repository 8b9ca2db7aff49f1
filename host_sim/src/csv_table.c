#include "csv_table.h"

#include <csv.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "memory.h"

/** What the parser's callbacks share. */
typedef struct {
    sim_table_t *table;
    size_t text_size, text_room;
    size_t cells, cell_room;
    size_t ended_rows, line_room;
    size_t fields; /**< of the row being read */
    size_t line;   /**< being read */
    bool failed;   /**< an error was printed; the rest is skipped */
} reader_t;

static void print_error(const char *file, size_t line, const char *column, const char *format,
                        va_list arguments) {
    fprintf(stderr, "%s:%zu: %s: ", file, line, column);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
}

__attribute__((format(printf, 4, 5))) static bool fail(const char *file, size_t line, const char *column,
                                                       const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    print_error(file, line, column, format, arguments);
    va_end(arguments);
    return false;
}

/** libcsv has a field. */
static void on_field(void *field, size_t length, void *context) {
    reader_t *reader = context;
    sim_table_t *table = reader->table;
    reader->fields++;
    if (reader->failed) {
        return;
    }
    if (length != 0 && memchr(field, '\0', length) != NULL) {
        reader->failed = !fail(table->file, reader->line, "row", "a zero byte; this is not a text file");
        return;
    }
    table->text = sim_grow(table->text, &reader->text_room, reader->text_size + length + 1, 1);
    table->cell = sim_grow(table->cell, &reader->cell_room, reader->cells + 1, sizeof *table->cell);
    table->cell[reader->cells++] = reader->text_size;
    if (length != 0) {
        memcpy(table->text + reader->text_size, field, length);
    }
    reader->text_size += length;
    table->text[reader->text_size++] = '\0';
}

/** libcsv has a whole row. The first one is the header and says how many fields the others have. */
static void on_row(int terminator, void *context) {
    (void)terminator;
    reader_t *reader = context;
    sim_table_t *table = reader->table;
    const size_t fields = reader->fields;
    reader->fields = 0;
    if (reader->failed) {
        return;
    }
    if (reader->ended_rows == 0) {
        table->columns = fields;
    } else if (fields != table->columns) {
        reader->failed = !fail(table->file, reader->line, "row", "%zu fields, but the header has %zu", fields,
                               table->columns);
        return;
    }
    table->line = sim_grow(table->line, &reader->line_room, reader->ended_rows + 1, sizeof *table->line);
    table->line[reader->ended_rows++] = reader->line;
}

/** Length of the first line of `text`, with its end: LF, CRLF or CR. */
static size_t line_length(const char *text, size_t size) {
    for (size_t i = 0; i < size; i++) {
        if (text[i] == '\n') {
            return i + 1;
        }
        if (text[i] == '\r') {
            return i + 1 < size && text[i + 1] == '\n' ? i + 2 : i + 1;
        }
    }
    return size;
}

/** Feed the parser line by line, so that the callbacks know where they are. */
static bool parse_text(reader_t *reader, const char *text, size_t size) {
    struct csv_parser parser;
    if (csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI) != 0) {
        return fail(reader->table->file, 1, "row", "out of memory");
    }
    bool good = true;
    size_t line = 0;
    for (size_t at = 0; good && !reader->failed && at < size;) {
        const size_t length = line_length(text + at, size - at);
        reader->line = ++line;
        good = csv_parse(&parser, text + at, length, on_field, on_row, reader) == length;
        at += length;
    }
    good = good && (reader->failed || csv_fini(&parser, on_field, on_row, reader) == 0);
    if (!good && !reader->failed) {
        reader->failed = !fail(reader->table->file, reader->line, "row",
                               "a double quote where none may stand, or one missing");
    }
    csv_free(&parser);
    return !reader->failed;
}

/** Read all of a stream. @return false: `errno` says why; `*text` is to be freed all the same. */
static bool read_stream(FILE *stream, char **text, size_t *size) {
    size_t room = 0;
    for (;;) {
        *text = sim_grow(*text, &room, *size + BUFSIZ, 1);
        const size_t got = fread(*text + *size, 1, BUFSIZ, stream);
        *size += got;
        if (got < BUFSIZ) {
            return ferror(stream) == 0;
        }
    }
}

/** Read all of a file into memory of its own. @return NULL, after a message, if that fails. */
static char *read_file(const char *file, size_t *size) {
    char *text = NULL;
    *size = 0;
    FILE *stream = fopen(file, "rb");
    const bool good = stream != NULL && read_stream(stream, &text, size);
    if (!good) {
        fprintf(stderr, "%s: cannot be read: %s\n", file, strerror(errno));
        free(text);
        text = NULL;
    }
    if (stream != NULL) {
        fclose(stream);
    }
    return text;
}

bool sim_table_read(sim_table_t *table, const char *file) {
    *table = (sim_table_t){.file = file};
    size_t size = 0;
    char *text = read_file(file, &size);
    if (text == NULL) {
        return false;
    }
    const size_t mark = size >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    reader_t reader = {.table = table, .line = 1};
    bool good = parse_text(&reader, text + mark, size - mark);
    free(text);
    if (good && reader.ended_rows == 0) {
        good = fail(file, 1, "header", "missing: the file is empty");
    }
    if (!good) {
        sim_table_free(table);
        return false;
    }
    table->rows = reader.ended_rows - 1;
    return true;
}

void sim_table_free(sim_table_t *table) {
    free(table->text);
    free(table->cell);
    free(table->line);
    *table = (sim_table_t){.file = table->file};
}

static const char *header(const sim_table_t *table, size_t column) {
    return table->text + table->cell[column];
}

bool sim_table_columns(const sim_table_t *table, const sim_column_t *column, size_t count, size_t *index) {
    for (size_t i = 0; i < count; i++) {
        index[i] = SIM_NO_COLUMN;
        for (size_t k = 0; k < table->columns; k++) {
            if (strcmp(header(table, k), column[i].name) != 0) {
                continue;
            }
            if (index[i] != SIM_NO_COLUMN) {
                return fail(table->file, table->line[0], column[i].name, "column given twice");
            }
            index[i] = k;
        }
        if (index[i] == SIM_NO_COLUMN && column[i].required) {
            return fail(table->file, table->line[0], column[i].name, "column missing");
        }
    }
    return true;
}

void sim_table_warn_unknown(const sim_table_t *table, const sim_column_t *column, size_t count) {
    for (size_t k = 0; k < table->columns; k++) {
        bool known = false;
        for (size_t i = 0; i < count && !known; i++) {
            known = strcmp(header(table, k), column[i].name) == 0;
        }
        if (!known) {
            (void)fail(table->file, table->line[0], header(table, k), "warning: unknown column, ignored");
        }
    }
}

const char *sim_table_cell(const sim_table_t *table, size_t row, size_t column) {
    return table->text + table->cell[(row + 1) * table->columns + column];
}

bool sim_table_number(const sim_table_t *table, size_t row, size_t column, double *value) {
    const char *cell = sim_table_cell(table, row, column);
    if (cell[0] == '\0') {
        return sim_table_error(table, row, column, "empty, a number is needed");
    }
    if (!sim_parse_number(cell, value)) {
        return sim_table_error(table, row, column, "not a number: '%s'", cell);
    }
    return true;
}

bool sim_table_error(const sim_table_t *table, size_t row, size_t column, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const size_t line = row == SIM_HEADER_ROW ? table->line[0] : table->line[row + 1];
    print_error(table->file, line, header(table, column), format, arguments);
    va_end(arguments);
    return false;
}

bool sim_parse_number(const char *text, double *value) {
    // strtod() alone would take "inf", "nan", "0x10" and leading blanks.
    if (text[0] == '\0' || text[strspn(text, "+-.0123456789eE")] != '\0') {
        return false;
    }
    char *end = NULL;
    *value = strtod(text, &end);
    return *end == '\0' && end != text && isfinite(*value) != 0;
}
