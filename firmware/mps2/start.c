/* Vector table and reset. */
#include "fault.h"
#include "memory.h"
#include "protect.h"
#include "registers.h"
#include "stack.h"

typedef union {
    void (*handler)(void);
    const void *stack;
} vector_t;

void mps2_reset_entry(void);
void mps2_systick_interrupt(void);
void mps2_uart_receive_interrupt(void);
void mps2_uart_transmit_interrupt(void);
int main(void);

#define FAULT        {.handler = mps2_fault_entry}
#define FOUR_FAULTS  FAULT, FAULT, FAULT, FAULT
#define EIGHT_FAULTS FOUR_FAULTS, FOUR_FAULTS

/** What nobody uses is a fault, too: an interrupt that nobody asked for. */
__attribute__((section(".vectors"), used)) static const vector_t vectors[16 + MPS2_IRQS] = {
    {.stack = mps2_stack_top},
    {.handler = mps2_reset_entry},
    FAULT, // NMI: the watchdog
    FAULT, // HardFault
    FAULT, // MemManage
    FAULT, // BusFault
    FAULT, // UsageFault
    FOUR_FAULTS,
    FAULT, // SVCall
    FAULT, // debug monitor
    FAULT,
    FAULT, // PendSV
    {.handler = mps2_systick_interrupt},
    {.handler = mps2_uart_receive_interrupt},
    {.handler = mps2_uart_transmit_interrupt},
    FAULT,
    FAULT,
    FOUR_FAULTS,
    EIGHT_FAULTS,
    EIGHT_FAULTS,
    EIGHT_FAULTS,
};

static void enable_fpu(void) {
    MPS2_SCB_CPACR |= MPS2_CPACR_FPU;
    __asm volatile("dsb\n isb" ::: "memory");
}

static void copy_data(void) {
    const uint32_t *from = mps2_data_load;
    for (uint32_t *to = mps2_data_start; to < mps2_data_end; to++, from++) {
        *to = *from;
    }
}

static void zero_bss(void) {
    for (uint32_t *word = mps2_bss_start; word < mps2_bss_end; word++) {
        *word = 0;
    }
}

/** Registers decide what a division by 0 does, before any code may depend on it. */
static void enable_faults(void) {
    MPS2_SCB_SHCSR |= MPS2_SHCSR_FAULTS;
    MPS2_SCB_CCR |= MPS2_CCR_DIV_0;
}

void mps2_reset_entry(void) {
    enable_fpu();
    enable_faults();
    mps2_stack_paint();
    copy_data();
    zero_bss();
    mps2_protect_start();
    (void)main();
    mps2_reset();
}
