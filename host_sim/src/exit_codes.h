/** Exit codes of the programs. */
#ifndef SIM_EXIT_CODES_H
#define SIM_EXIT_CODES_H

enum {
    SIM_EXIT_OK = 0,
    SIM_EXIT_INPUT = 1,     /**< a file that cannot be read or written, or says something wrong */
    SIM_EXIT_USAGE = 2,     /**< a command line that makes no sense */
    SIM_EXIT_VIOLATION = 3, /**< the run went through, but a limit was exceeded */
    SIM_EXIT_DIFFERENT = 4, /**< a replay differs from its recording */
};

#endif
