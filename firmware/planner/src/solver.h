/** A generated solver as the planner sees it. Private: the only headers that know OSQP are this one and its users. */
#ifndef TAPER_SOLVER_H
#define TAPER_SOLVER_H

#include "osqp.h"
#include "taper/planner.h"

struct taper_solver {
    OSQPSolver *osqp;
    OSQPFloat *a_values; /**< values of the constraint matrix, column by column, rows ascending [a_count] */
    OSQPInt a_count;
    OSQPFloat *p_values; /**< values of the upper triangle of the Hessian, likewise [p_count] */
    OSQPInt p_count;
    OSQPInt variables, rows;
    uint8_t connectors, steps;
    uint16_t sums; /**< rows of limits in each step */
};

#endif
