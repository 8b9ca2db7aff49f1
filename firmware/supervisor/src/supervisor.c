#include "taper/supervisor.h"

/** The situation as one word. */
enum {
    STARTING = 1, /* no other mode than INIT so far */
    HEARD = 2,
    ALIVE = 4,
    OVERRAN = 8,
    READY = 16,
};

typedef struct {
    uint8_t of, are; /* the condition: these bits of the situation have these values */
    taper_mode_t mode;
    uint32_t ends_ms; /* so long after the start the row does not hold any more; 0: it has no end */
} row_t;

/** The first row whose condition holds decides. All do so in the same tick, and are left in the tick that ends them. */
static const row_t table[] = {
    /* The gateway was never heard. Way back: its first limit. */
    {STARTING | HEARD, STARTING, TAPER_MODE_INIT, TAPER_INIT_ms},
    /* Never heard in all that time, or silent for too long. Way back: a limit that is in force (limits.h). */
    {ALIVE, 0, TAPER_MODE_FAILSAFE, 0},
    /* The last tick took too long: the cheap proposal in this one. Way back: a tick in time. */
    {OVERRAN, OVERRAN, TAPER_MODE_FALLBACK, 0},
    /* No proposal: none yet, late, not finite, refused, or the planner is off. Way back: the next good one. */
    {READY, 0, TAPER_MODE_FALLBACK, 0},
    {0, 0, TAPER_MODE_PLAN, 0},
};

void taper_supervisor_init(taper_supervisor_t *supervisor) {
    *supervisor = (taper_supervisor_t){.mode = TAPER_MODE_INIT};
}

static unsigned word_of(const taper_supervisor_t *supervisor, const taper_situation_t *situation) {
    return (supervisor->mode == TAPER_MODE_INIT ? STARTING : 0u) | (situation->gateway_heard ? HEARD : 0u) |
           (situation->gateway_alive ? ALIVE : 0u) | (situation->tick_overran ? OVERRAN : 0u) |
           (situation->proposal_ready ? READY : 0u);
}

static bool holds(const row_t *row, unsigned situation, uint32_t running_ms) {
    return (situation & row->of) == row->are && (row->ends_ms == 0 || running_ms < row->ends_ms);
}

taper_mode_t taper_supervisor_update(taper_supervisor_t *supervisor, const taper_situation_t *situation,
                                     uint32_t now_ms) {
    if (!supervisor->started) {
        supervisor->started = true;
        supervisor->started_ms = now_ms;
    }
    const unsigned word = word_of(supervisor, situation);
    const row_t *row = table;
    while (!holds(row, word, taper_elapsed_ms(now_ms, supervisor->started_ms))) {
        row++; /* the last one always holds */
    }
    supervisor->mode = row->mode;
    return row->mode;
}

bool taper_health_judge(taper_health_t *health, bool usable, uint32_t now_ms) {
    if (health->off) {
        return false;
    }
    health->bad = usable ? 0 : (uint8_t)(health->bad + 1);
    health->off = health->bad >= TAPER_BAD_PLANS;
    health->off_ms = now_ms;
    return health->off;
}

bool taper_health_may_plan(taper_health_t *health, uint32_t now_ms) {
    if (health->off && taper_elapsed_ms(now_ms, health->off_ms) >= TAPER_PLANNER_OFF_ms) {
        *health = (taper_health_t){.bad = TAPER_BAD_PLANS - 1};
    }
    return !health->off;
}

bool taper_self_ticked(taper_self_t *self, uint32_t late_ms, uint32_t tick_ms) {
    self->overran = late_ms > tick_ms / 2;
    if (self->overruns < TAPER_RESET_OVERRUNS) {
        self->overruns = self->overran ? (uint8_t)(self->overruns + 1) : 0;
    }
    return self->overran;
}

void taper_self_flipped(taper_self_t *self) {
    if (self->flips < TAPER_RESET_FLIPS) {
        self->flips++;
    }
}

bool taper_self_is_sound(const taper_self_t *self) {
    return self->overruns < TAPER_RESET_OVERRUNS && self->flips < TAPER_RESET_FLIPS;
}
