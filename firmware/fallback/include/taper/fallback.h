/**
 * Proposals that need no solver: earliest deadline first (EDF) and least laxity first (LLF), both clamped to what each
 * battery takes at its SOC. They only say who comes first and how much is of use; the allocator fills the limits.
 * Integers, constant loop bounds, no state.
 */
#ifndef TAPER_FALLBACK_H
#define TAPER_FALLBACK_H

#include <stdint.h>

#include "taper/types.h"

/** Earliest deadline first. Ties go to the lower connector. Cost: O(connectors^2) comparisons at worst. */
void taper_propose_edf(const taper_snapshot_t *snapshot, uint32_t tick_ms, taper_proposal_t *proposal);

/** Least laxity first; laxity is the time to departure less the time that the need takes at the present limit. */
void taper_propose_llf(const taper_snapshot_t *snapshot, uint32_t tick_ms, taper_proposal_t *proposal);

#endif
