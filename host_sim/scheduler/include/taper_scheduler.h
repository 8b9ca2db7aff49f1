/**
 * Taper as a scheduling algorithm for other simulators: a shared library with a plain C interface.
 *
 * A simulator opens one of the built-in stations (`taper_scheduler_station_name()` lists them), says in every period which
 * vehicle stands at which connector and what is known of it, and asks for the currents of the period. They come from the
 * firmware's own layers, one after the other:
 *
 *     vehicles -> snapshot -> planner (OSQP) or EDF -> proposal -> allocator -> [rates, fill] -> guard -> currents
 *
 * What is left out is all that lives within seconds, of which such a simulator knows nothing: CAN frames, the ledger of what
 * each connector may still draw, ramps and reaction times, the mode machine. `taper-sim` has them. Two steps are added,
 * for what other simulators have and the firmware has not:
 *
 *   rates   An EVSE that knows only some currents gets the next lower one of them, then the nearest to what was wished if there
 *           is room. Of two ways to charge what is left, it takes the one that leaves no rest below its least current.
 *   fill    What rounding leaves over, and what the allocator's rows (linear, they bound the length of a sum of phasors from
 *           above, by up to 15 %) do not use, goes to the most urgent first: each current rises as far as the guard lets
 *           it pass, which adds phasors exactly. A rise has to hold the limits however little of its current any pair of lines
 *           really draws: on the delta side of a transformer, less on one pair can be more on a line.
 *
 * The guard passes every answer, or it is lowered until the guard does, at worst to nothing.
 *
 * Units stand in the names. A connector or group is an index from 0, in the order of the station's description
 * (`codegen/stations/NAME.toml`); group 0 is the site. Times are seconds of the simulator's clock, on any origin.
 *
 * One instance of a station per process: the generated solver's memory is a global. Different stations can be open at the same
 * time. No pointer may be NULL unless its call says so. Calls are not safe from more than one thread at once. The same calls
 * give the same currents, to the bit.
 */
#ifndef TAPER_SCHEDULER_H
#define TAPER_SCHEDULER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(TAPER_SCHEDULER_EXPORTS)
#    define TAPER_SCHEDULER_API __attribute__((visibility("default")))
#else
#    define TAPER_SCHEDULER_API
#endif

/** Raised by every change after which programs have to be compiled, or bindings written, anew. */
#define TAPER_SCHEDULER_VERSION 1

/** What a call answers: 0, or why nothing was changed. */
typedef enum {
    TAPER_SCHEDULER_OK = 0,
    TAPER_SCHEDULER_ERR_ARGUMENT = -1,   /**< an argument outside its documented range, NaN included */
    TAPER_SCHEDULER_ERR_STATION = -2,    /**< no station of that name in this library */
    TAPER_SCHEDULER_ERR_OPEN = -3,       /**< the station is open already */
    TAPER_SCHEDULER_ERR_NO_PLANNER = -4, /**< built without planner: only TAPER_SCHEDULER_EDF_SOC */
    TAPER_SCHEDULER_ERR_MEMORY = -5,
} taper_scheduler_status_t;

typedef enum {
    TAPER_SCHEDULER_SOC_MPC = 0, /**< the planner, which knows the taper */
    TAPER_SCHEDULER_EDF_SOC =
        1, /**< earliest deadline first, clamped to the taper: what the firmware falls back to */
} taper_scheduler_policy_t;

/** Options of an instance. taper_scheduler_defaults() fills them. */
typedef struct {
    int32_t policy;           /**< taper_scheduler_policy_t */
    int32_t period_s;         /**< 1..3600: the currents of a call hold so long */
    int32_t objective;        /**< taper_objective_t: 0 throughput, 1 log utility */
    int32_t outer_iterations; /**< of the log utility, 1..20; 0: as described */
    int32_t horizon_steps;    /**< that are planned, 2..steps of the station; 0: all of them */
    int32_t fill;             /**< 0: leave out the step `fill` above */
    double lambda_per_kWh2;   /**< of the log utility, 0..10000 */
} taper_scheduler_options_t;

/** A connector as its station describes it, with what was set since. */
typedef struct {
    int32_t group;   /**< innermost group */
    int32_t lines;   /**< of the supply that it draws from: bit 0 L1 .. bit 2 L3; a DC connector from all */
    int32_t between; /**< 1: it draws between its two lines, 0: to neutral */
    double min_A;    /**< least current besides 0; 0: continuous */
    double max_A;
    double voltage_V; /**< that a single-phase current is multiplied with to have power */
} taper_scheduler_connector_t;

/** Limits of a group. In an answer 0 is none; to set, 0 leaves one as it is. */
typedef struct {
    int32_t parent; /**< -1: it is the site. Not looked at when limits are set */
    double limit_kW;
    double line_A;  /**< of each line */
    double delta_A; /**< of each line on the delta side of its transformer, times its ratio of windings */
} taper_scheduler_group_t;

/** What is known of the vehicle at a connector. */
typedef struct {
    uint64_t session;    /**< tells one vehicle from the next at the same connector */
    double need_kWh;     /**< energy still wanted, 0..1000; 0: it has all */
    double departs_s;    /**< when it leaves; may have passed */
    double max_kW;       /**< most that it takes at any charge, 0..2000; 0: not known, the connector's */
    double max_A;        /**< and the most current, 0..409.4; 0: the connector's */
    double capacity_kWh; /**< of the battery, 0..2000; 0: not known, and then there is no taper */
    double stored_kWh;   /**< in it now, 0..capacity_kWh */
    double peak_kW;      /**< what its taper's line says at SOC 0, 0..20000; 0: no taper is known */
    double taper_kW;     /**< fall of the line from SOC 0 to SOC 1, 0..peak_kW */
} taper_scheduler_vehicle_t;

/** One point of a known course: the limit from then on, until the next point. */
typedef struct {
    double time_s;
    double limit_kW;
} taper_scheduler_point_t;

/** Why a connector has the current that it has. */
typedef enum {
    TAPER_SCHEDULER_NO_VEHICLE = 0,      /**< or one that wants nothing */
    TAPER_SCHEDULER_VEHICLE_LIMIT = 1,   /**< all that the vehicle takes, or still wants */
    TAPER_SCHEDULER_CONNECTOR_LIMIT = 2, /**< all that the connector can */
    TAPER_SCHEDULER_LIMIT = 3,           /**< a limit of site or group leaves no more */
    TAPER_SCHEDULER_WAITING = 4,         /**< no room for its least current, or kept off for a while */
    TAPER_SCHEDULER_PLANNED = 5,         /**< the plan wants no more for it now */
} taper_scheduler_why_t;

/** The answer for one connector. */
typedef struct {
    double current_A; /**< per conductor, a multiple of 0.1 A; of its rates, if it has some */
    double wish_kW;   /**< what plan or EDF wanted, before any limit */
    int32_t why;      /**< taper_scheduler_why_t */
} taper_scheduler_current_t;

/** How the last answer came about. */
typedef struct {
    int32_t planned;    /**< 1: by the plan; 0: by EDF, as told, or for want of a good plan */
    int32_t verdict;    /**< taper_verdict_t of the solver: 2 solved, 3 inaccurate but usable; 0 with EDF */
    int32_t iterations; /**< of the solver */
    int32_t lowered;    /**< answers that the guard refused at first: 0, but where rates meet imbalance */
} taper_scheduler_account_t;

typedef struct taper_scheduler taper_scheduler_t;

/** @return TAPER_SCHEDULER_VERSION that the library was built with. */
TAPER_SCHEDULER_API int32_t taper_scheduler_version(void);

/** @return name of the built-in station at `index` from 0, or NULL beyond the last. Lives as long as the library. */
TAPER_SCHEDULER_API const char *taper_scheduler_station_name(int32_t index);

/** @return `status` in words. Lives as long as the library. */
TAPER_SCHEDULER_API const char *taper_scheduler_status_text(int32_t status);

/** Fill `options`: the planner (EDF if there is none), 300 s, throughput, all steps, fill. */
TAPER_SCHEDULER_API void taper_scheduler_defaults(taper_scheduler_options_t *options);

/**
 * Open a station. `*scheduler` is the caller's to close; NULL if the call fails. About 400 KB of heap, and two factorisations.
 * @return ERR_ARGUMENT for options out of range, ERR_STATION, ERR_OPEN, ERR_NO_PLANNER, ERR_MEMORY.
 */
TAPER_SCHEDULER_API int32_t taper_scheduler_open(taper_scheduler_t **scheduler, const char *station,
                                                 const taper_scheduler_options_t *options);

/** Forget everything; the station can be opened again. NULL is allowed. */
TAPER_SCHEDULER_API void taper_scheduler_close(taper_scheduler_t *scheduler);

/** @return number of connectors, 1..240. */
TAPER_SCHEDULER_API int32_t taper_scheduler_connectors(const taper_scheduler_t *scheduler);

/** @return number of groups, at least 1. */
TAPER_SCHEDULER_API int32_t taper_scheduler_groups(const taper_scheduler_t *scheduler);

/** @return ERR_ARGUMENT if there is no such connector. */
TAPER_SCHEDULER_API int32_t taper_scheduler_connector(const taper_scheduler_t *scheduler, int32_t connector,
                                                      taper_scheduler_connector_t *description);

/** @return ERR_ARGUMENT if there is no such group. */
TAPER_SCHEDULER_API int32_t taper_scheduler_group(const taper_scheduler_t *scheduler, int32_t group,
                                                  taper_scheduler_group_t *limits);

/**
 * Other limits than described, from now on; values are rounded down to W and mA. Only a limit that the description has can be
 * set: the solver was generated for those, so 0 (leave it) is all that others take.
 * @return ERR_ARGUMENT for another group, a limit that is not described, or one above 3276.7 kW or 20 kA.
 */
TAPER_SCHEDULER_API int32_t taper_scheduler_set_group(taper_scheduler_t *scheduler, int32_t group,
                                                      const taper_scheduler_group_t *limits);

/**
 * Currents that the EVSE at a connector can give, besides 0: either all from `rates_A[0]` to `rates_A[1]` (`count` 2,
 * `continuous` not 0; the first may be 0), or just those listed, ascending, at most 64. All are multiples of 0.1 A, on AC 0
 * or at least 6 A, and not above the described maximum.
 * @return ERR_ARGUMENT otherwise.
 */
TAPER_SCHEDULER_API int32_t taper_scheduler_set_rates(taper_scheduler_t *scheduler, int32_t connector,
                                                      const double *rates_A, int32_t count,
                                                      int32_t continuous);

/**
 * What is known of the vehicle at a connector, until the next such call; NULL: there is none. A vehicle draws for a whole period
 * what it is given and takes: who still wants less than a period of the least current, and could take more, is not switched on.
 * @return ERR_ARGUMENT for a value out of range; the connector then keeps what was known.
 */
TAPER_SCHEDULER_API int32_t taper_scheduler_set_vehicle(taper_scheduler_t *scheduler, int32_t connector,
                                                        const taper_scheduler_vehicle_t *vehicle);

/**
 * What the site may draw now for charging [kW], 0..3276.7, until the next such call; the described limit holds besides. One that
 * changes again within 5 s flaps, as in the firmware (taper/limits.h): then its lowest value holds for 30 s.
 * @return ERR_ARGUMENT for another.
 */
TAPER_SCHEDULER_API int32_t taper_scheduler_set_limit(taper_scheduler_t *scheduler, double limit_kW);

/**
 * The known course of that limit, besides the present one; the least counts. Without points it is forgotten. At most 384
 * points, ascending, within 24 days of each other and of the times of planning; the last holds for ever.
 * @return ERR_ARGUMENT otherwise.
 */
TAPER_SCHEDULER_API int32_t taper_scheduler_set_course(taper_scheduler_t *scheduler,
                                                       const taper_scheduler_point_t *points, int32_t count);

/**
 * Plan and allocate for the period that begins at `now_s`, 0..1e12; not before the last call's. `currents` is [connectors].
 * Cost, 54 connectors and 24 steps: about 15 ms with the planner, 1 ms without (host, double).
 * @return ERR_ARGUMENT for a time that is out of range or goes back; `currents` is then untouched.
 */
TAPER_SCHEDULER_API int32_t taper_scheduler_plan(taper_scheduler_t *scheduler, double now_s,
                                                 taper_scheduler_current_t *currents);

/** How the last taper_scheduler_plan() came to its answer. */
TAPER_SCHEDULER_API void taper_scheduler_account(const taper_scheduler_t *scheduler,
                                                 taper_scheduler_account_t *account);

/**
 * Whether these currents [connectors, A; rounded up to mA] are within the limits of all groups, by the guard's exact sums of
 * phasors. Connectors' own limits and vehicles are not looked at. @return 1, 0, or ERR_ARGUMENT for a negative one or NaN.
 */
TAPER_SCHEDULER_API int32_t taper_scheduler_holds(const taper_scheduler_t *scheduler,
                                                  const double *current_A);

#ifdef __cplusplus
}
#endif

#endif
