/** What a vehicle really takes over its state of charge (SOC): a polyline, as the column `curve` of a sessions file has it. */
#ifndef SIM_CHARGE_CURVE_H
#define SIM_CHARGE_CURVE_H

/** The longest of 113 real curves has 13 points (host_sim/data/README.md). */
#define SIM_CHARGE_POINTS 32

typedef struct {
    double soc;
    double kw;
} sim_charge_point_t;

/** Linear between its points; before the first and beyond the last it stays as there. No point: there is no curve. */
typedef struct {
    unsigned count;
    sim_charge_point_t point[SIM_CHARGE_POINTS]; /**< by ascending SOC */
} sim_charge_curve_t;

/**
 * Read "SOC:KW SOC:KW ...": at least two points, separated by blanks; SOC ascends within 0..1, 0 < kW <= `most_kw`.
 * @return NULL; or what is wrong, of the point with number `*at` (from 1; 0: of the whole), and `curve` has no point.
 */
const char *sim_charge_curve_read(sim_charge_curve_t *curve, const char *text, double most_kw, unsigned *at);

/** Power at `soc` [kW]. The curve has points. */
double sim_charge_curve_kw(const sim_charge_curve_t *curve, double soc);

/** Greatest power of all SOC [kW]. The curve has points. */
double sim_charge_curve_most_kw(const sim_charge_curve_t *curve);

#endif
