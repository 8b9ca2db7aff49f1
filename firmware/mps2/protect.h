/** What the image may not do to memory, by the core's memory protection unit. */
#ifndef MPS2_PROTECT_H
#define MPS2_PROTECT_H

/**
 * Code can be read and run, the image's RAM and the peripherals read and written, and all else is a MemManage fault: writing
 * through NULL or into code, running data, and a stack that leaves the RAM at its lower end.
 */
void mps2_protect_start(void);

#endif
