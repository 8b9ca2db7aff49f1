/** How deep the stack was: it is painted at the start, and what is still paint was never used. */
#ifndef MPS2_STACK_H
#define MPS2_STACK_H

#include <stdint.h>

/** Paint what is below the caller's frame. */
void mps2_stack_paint(void);

/** Most that was ever used [B]. Cost: O(what was not used). */
uint32_t mps2_stack_used_B(void);

uint32_t mps2_stack_size_B(void);

#endif
