/**
 * Registers of the MPS2 boards' FPGA images AN386 and AN500: Arm's CMSDK peripherals (DDI 0479) and the core's System
 * Control Space (ARMv7-M Architecture Reference Manual, B3). Only what is used.
 */
#ifndef MPS2_REGISTERS_H
#define MPS2_REGISTERS_H

#include <stdint.h>

/** Clock of core and peripherals. */
#define MPS2_CLOCK_Hz 25000000u

typedef volatile uint32_t mps2_register_t;

typedef struct {
    mps2_register_t data, state, control, interrupts, baud_divider;
} mps2_uart_registers_t;

#define MPS2_UART0         ((mps2_uart_registers_t *)0x40004000u)
#define MPS2_UART1         ((mps2_uart_registers_t *)0x40005000u)
#define MPS2_UART_TX_FULL  (1u << 0) // state
#define MPS2_UART_RX_FULL  (1u << 1)
#define MPS2_UART_TX_ON    (1u << 0) // control
#define MPS2_UART_RX_ON    (1u << 1)
#define MPS2_UART_TX_IRQ   (1u << 2)
#define MPS2_UART_RX_IRQ   (1u << 3)
#define MPS2_UART_TX_EVENT (1u << 0) // interrupts: pending, cleared by writing 1
#define MPS2_UART_RX_EVENT (1u << 1)

typedef struct {
    mps2_register_t control, value, reload, interrupts;
} mps2_timer_registers_t;

#define MPS2_TIMER0   ((mps2_timer_registers_t *)0x40000000u)
#define MPS2_TIMER_ON (1u << 0)

typedef struct {
    mps2_register_t load, value, control, clear, raw, masked;
    uint32_t reserved[0x2FA];
    mps2_register_t lock; // 0xC00
} mps2_watchdog_registers_t;

#define MPS2_WATCHDOG        ((mps2_watchdog_registers_t *)0x40008000u)
#define MPS2_WATCHDOG_NMI    (1u << 0) // control: counts, and its first end is an NMI
#define MPS2_WATCHDOG_RESET  (1u << 1) // and its second one a reset
#define MPS2_WATCHDOG_UNLOCK 0x1ACCE551u

_Static_assert(sizeof(mps2_watchdog_registers_t) == 0xC04, "the lock register is at 0xC00");

// The core.
#define MPS2_SYSTICK_CONTROL (*(mps2_register_t *)0xE000E010u)
#define MPS2_SYSTICK_RELOAD  (*(mps2_register_t *)0xE000E014u)
#define MPS2_SYSTICK_VALUE   (*(mps2_register_t *)0xE000E018u)
#define MPS2_SYSTICK_ON      0x7u // counts the core's clock, with interrupt

#define MPS2_NVIC_ENABLE (*(mps2_register_t *)0xE000E100u) // interrupts 0..31

#define MPS2_SCB_AIRCR    (*(mps2_register_t *)0xE000ED0Cu)
#define MPS2_AIRCR_RESET  0x05FA0004u // key, SYSRESETREQ
#define MPS2_SCB_CCR      (*(mps2_register_t *)0xE000ED14u)
#define MPS2_CCR_DIV_0    (1u << 4) // division by 0 is a UsageFault
#define MPS2_SCB_SHCSR    (*(mps2_register_t *)0xE000ED24u)
#define MPS2_SHCSR_FAULTS (7u << 16) // MemManage, BusFault and UsageFault by their own handlers
#define MPS2_SCB_CFSR     (*(mps2_register_t *)0xE000ED28u)
#define MPS2_SCB_HFSR     (*(mps2_register_t *)0xE000ED2Cu)
#define MPS2_SCB_MMFAR    (*(mps2_register_t *)0xE000ED34u)
#define MPS2_SCB_BFAR     (*(mps2_register_t *)0xE000ED38u)
#define MPS2_SCB_CPACR    (*(mps2_register_t *)0xE000ED88u)
#define MPS2_CPACR_FPU    (0xFu << 20) // full access to CP10 and CP11

#define MPS2_MPU_CONTROL (*(mps2_register_t *)0xE000ED94u)
#define MPS2_MPU_ON      1u // for all but faults and NMI; what no region names is forbidden
#define MPS2_MPU_REGION  (*(mps2_register_t *)0xE000ED98u)
#define MPS2_MPU_BASE    (*(mps2_register_t *)0xE000ED9Cu)
#define MPS2_MPU_SIZE    (*(mps2_register_t *)0xE000EDA0u)

/** Numbers of interrupts. */
enum { MPS2_IRQ_UART0_RX = 0, MPS2_IRQ_UART0_TX = 1, MPS2_IRQS = 32 };

#endif
