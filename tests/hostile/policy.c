/* Plans that nobody should follow. */
#include "world.h"

static const int32_t extremes[] = {INT32_MIN, INT32_MIN + 1, -1, 0, 1, INT32_MAX - 1, INT32_MAX};

static int32_t poison(world_t *world, policy_t policy) {
    switch (policy) {
    case POLICY_EQUAL: return 1000000;
    case POLICY_EXTREMES: return extremes[random_below(&world->random, sizeof extremes / sizeof extremes[0])];
    case POLICY_NEGATIVE: return -random_in(&world->random, 0, 100000);
    case POLICY_NOISE: return random_in(&world->random, 0, 30000);
    case POLICY_NOTHING:
    case POLICIES:
    default: return 0;
    }
}

void policy_propose(void *context, const taper_snapshot_t *snapshot, int32_t site_limit_W,
                    taper_proposal_t *proposal) {
    world_t *world = context;
    const bool broken = world->policy != POLICY_EQUAL;
    (void)site_limit_W;
    world->injuries.poisoned += broken ? 1u : 0u;
    for (uint8_t i = 0; i < TAPER_MAX_CONNECTORS; i++) {
        proposal->wish_W[i] = poison(world, world->policy);
        proposal->ceiling_W[i] = poison(world, world->policy);
        const bool permuted = i < snapshot->count && (!broken || random_once_in(&world->random, 2));
        proposal->rank[i] = permuted ? i : (uint8_t)random_bits(&world->random);
    }
}
