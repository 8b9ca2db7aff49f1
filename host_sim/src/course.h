/** A step function of time from a CSV file: each value holds until the next point, the first one before its time too. */
#ifndef SIM_COURSE_H
#define SIM_COURSE_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    double *time_s; /**< [count], strictly ascending */
    double *value;
    size_t count; /**< at least 1 */
} sim_course_t;

/** One value always. Free with sim_course_free(). */
void sim_course_constant(sim_course_t *course, double value);

/**
 * Read a file with the columns `time_s` and `name`, times strictly ascending, no value outside [low, high].
 * @return false, after one line on stderr, at the first row that is not right. Else free with sim_course_free().
 */
bool sim_course_load(sim_course_t *course, const char *file, const char *name, double low, double high);

/** The point in force at a time. Cost: O(log count). */
size_t sim_course_point(const sim_course_t *course, double time_s);

/** The least value in [from_s, to_s). */
double sim_course_least(const sim_course_t *course, double from_s, double to_s);

/** The mean value in [from_s, to_s), for from_s < to_s; else the value at from_s. */
double sim_course_mean(const sim_course_t *course, double from_s, double to_s);

void sim_course_free(sim_course_t *course);

#endif
