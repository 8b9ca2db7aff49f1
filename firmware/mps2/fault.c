#include "fault.h"

#include "boot.h"
#include "memory.h"
#include "registers.h"
#include "text.h"

/** What the core stacks at an exception. */
typedef struct {
    uint32_t r0, r1, r2, r3, r12, lr, pc, psr;
} frame_t;

_Noreturn void mps2_fault_report(const frame_t *frame, const uint32_t r4_to_r11[8], uint32_t exc_return);

_Noreturn void mps2_reset(void) {
    __asm volatile("dsb" ::: "memory");
    MPS2_SCB_AIRCR = MPS2_AIRCR_RESET;
    for (;;) {
    }
}

__attribute__((naked)) void mps2_fault_entry(void) {
    __asm volatile("mov r0, sp\n"
                   "ldr r1, =mps2_fault_stack_top\n"
                   "mov sp, r1\n"
                   "push {r4-r11}\n"
                   "mov r1, sp\n"
                   "mov r2, lr\n"
                   "b mps2_fault_report\n"
                   ".ltorg");
}

static const char *name_of(uint32_t exception) {
    static const char *const names[] = {"NMI (watchdog)", "HardFault", "MemManage", "BusFault", "UsageFault"};
    return exception >= 2 && exception <= 6 ? names[exception - 2] : "unexpected interrupt";
}

/** A stack that ran over holds no frame. */
static bool is_readable(const frame_t *frame) {
    return (uintptr_t)frame >= (uintptr_t)mps2_ram_start && (uintptr_t)(frame + 1) <= (uintptr_t)mps2_ram_end;
}

static void tell_frame(const frame_t *frame) {
    if (!is_readable(frame)) {
        mps2_text(" stack overflow");
        return;
    }
    mps2_text_hex("pc", frame->pc);
    mps2_text_hex("lr", frame->lr);
    mps2_text_hex("psr", frame->psr);
    mps2_text_hex("r0", frame->r0);
    mps2_text_hex("r1", frame->r1);
    mps2_text_hex("r2", frame->r2);
    mps2_text_hex("r3", frame->r3);
    mps2_text_hex("r12", frame->r12);
}

static void tell_others(const uint32_t r4_to_r11[8]) {
    static const char *const names[] = {"r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11"};
    for (unsigned i = 0; i < 8; i++) {
        mps2_text_hex(names[i], r4_to_r11[i]);
    }
}

__attribute__((used)) _Noreturn void mps2_fault_report(const frame_t *frame, const uint32_t r4_to_r11[8],
                                                       uint32_t exc_return) {
    uint32_t exception;
    __asm volatile("mrs %0, ipsr" : "=r"(exception));
    mps2_boot_note_fault(exception);
    mps2_text("taper: fault: ");
    mps2_text(name_of(exception));
    mps2_text_u32("exception", exception);
    mps2_text_hex("cfsr", MPS2_SCB_CFSR);
    mps2_text_hex("hfsr", MPS2_SCB_HFSR);
    mps2_text_hex("mmfar", MPS2_SCB_MMFAR);
    mps2_text_hex("bfar", MPS2_SCB_BFAR);
    mps2_text_hex("sp", (uint32_t)(uintptr_t)frame);
    mps2_text_hex("exc_return", exc_return);
    tell_frame(frame);
    tell_others(r4_to_r11);
    mps2_text("\n");
    mps2_reset();
}
