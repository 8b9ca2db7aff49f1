/** The text of taper-sim's help, and what can only be checked when all of its options are known. Private. */
#ifndef SIM_OPTIONS_CHECK_H
#define SIM_OPTIONS_CHECK_H

#include <argp.h>
#include <stdbool.h>

#include "options.h"

/** What argp prints around the list of options; the part after '\v' comes last. */
extern const char sim_options_help[];

/** The names of the policies, separated by commas; for help and errors. To be freed. */
char *sim_policy_names(bool with_help);

/** Refuse what makes no sense together, and hand over to a replay what is of both. Ends the program with an error. */
void sim_options_check(sim_options_t *chosen, struct argp_state *state);

#endif
