#include "charge_curve.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "csv_table.h"

/** Longest text of a number. */
#define NUMBER_LENGTH 40

/** The first `length` characters as a number. */
static bool read_number(const char *text, size_t length, double *value) {
    char number[NUMBER_LENGTH];
    if (length >= sizeof number) {
        return false;
    }
    memcpy(number, text, length);
    number[length] = '\0';
    return sim_parse_number(number, value);
}

/** One word "SOC:KW". */
static bool read_pair(const char *word, size_t length, sim_charge_point_t *point) {
    const char *colon = memchr(word, ':', length);
    if (colon == NULL) {
        return false;
    }
    const size_t before = (size_t)(colon - word);
    return read_number(word, before, &point->soc) && read_number(colon + 1, length - before - 1, &point->kw);
}

/** What is wrong with a point that follows those of the curve. */
static const char *reason_against(const sim_charge_curve_t *curve, const sim_charge_point_t *point,
                                  double most_kw) {
    if (point->soc < 0.0 || point->soc > 1.0) {
        return "SOC is outside 0..1";
    }
    if (curve->count > 0 && point->soc <= curve->point[curve->count - 1].soc) {
        return "SOC does not ascend";
    }
    if (point->kw <= 0.0) {
        return "power must be above 0";
    }
    return point->kw > most_kw ? "power is above what the bus carries" : NULL;
}

/** Read the word and append its point. */
static const char *append(sim_charge_curve_t *curve, const char *word, size_t length, double most_kw) {
    sim_charge_point_t point;
    if (curve->count == SIM_CHARGE_POINTS) {
        return "more points than a curve can have";
    }
    if (!read_pair(word, length, &point)) {
        return "not SOC:KW";
    }
    const char *reason = reason_against(curve, &point, most_kw);
    if (reason == NULL) {
        curve->point[curve->count++] = point;
    }
    return reason;
}

const char *sim_charge_curve_read(sim_charge_curve_t *curve, const char *text, double most_kw, unsigned *at) {
    static const char blanks[] = " \t";
    const char *reason = NULL;
    curve->count = 0;
    *at = 0;
    for (const char *word = text + strspn(text, blanks); *word != '\0' && reason == NULL;) {
        const size_t length = strcspn(word, blanks);
        reason = append(curve, word, length, most_kw);
        *at += 1;
        word += length;
        word += strspn(word, blanks);
    }
    if (reason == NULL) {
        *at = 0;
        reason = curve->count < 2 ? "fewer than two points" : NULL;
    }
    curve->count = reason == NULL ? curve->count : 0;
    return reason;
}

double sim_charge_curve_kw(const sim_charge_curve_t *curve, double soc) {
    const sim_charge_point_t *point = curve->point;
    unsigned next = 0;
    while (next < curve->count && point[next].soc < soc) {
        next++;
    }
    if (next == 0 || next == curve->count) {
        return point[next == 0 ? 0 : next - 1].kw;
    }
    const sim_charge_point_t *before = &point[next - 1];
    const double part = (soc - before->soc) / (point[next].soc - before->soc);
    return before->kw + part * (point[next].kw - before->kw);
}

double sim_charge_curve_most_kw(const sim_charge_curve_t *curve) {
    double most_kw = 0.0;
    for (unsigned k = 0; k < curve->count; k++) {
        most_kw = fmax(most_kw, curve->point[k].kw);
    }
    return most_kw;
}
