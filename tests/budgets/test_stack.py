"""The deepest stack: what is found in an image, and what it does not let pass."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from taperlib.callgraph import EXCEPTION_B, CallGraph, CallList, Interrupt, StackUnknown, pointers_in, pushed_B
from taperlib.image import Image

MakeImage = Callable[..., Image]
POINTER = """
KEEP static void small(void) { volatile int used[4]; taken(used); }
KEEP static void large(void) { volatile int used[100]; taken(used); }
void (*volatile chosen)(void);
void mps2_reset_entry(void) { chosen = small; chosen = large; chosen(); taken(0); }
"""
SITE = "firmware/small/main.c: chosen"


def known(*to: str, site: str = SITE) -> CallList:
    return CallList({site: to} if to else {}, (Interrupt("tick", 0),), "fault", ())


def names(graph: CallGraph) -> list[str]:
    return [name for name, _ in graph.worst().links]


def test_the_deepest_chain_is_told_with_its_frames(make_image: MakeImage) -> None:
    graph = CallGraph(make_image("""
KEEP static void shallow(void) { volatile int used[10]; taken(used); }
KEEP static void deep(void) { volatile int used[50]; taken(used); shallow(); taken(used); }
void mps2_reset_entry(void) { shallow(); deep(); taken(0); }
"""), known())
    chain = graph.deepest_from("mps2_reset_entry")
    assert [name for name, _ in chain.links][:3] == ["mps2_reset_entry", "deep", "shallow"]
    assert 200 + 40 <= chain.size_B <= 200 + 40 + 48
    assert str(chain).startswith("mps2_reset_entry 8 > deep 2")


def test_an_interrupt_and_a_fault_come_on_top(make_image: MakeImage) -> None:
    graph = CallGraph(make_image("void mps2_reset_entry(void) { volatile int used[20]; taken(used); taken(0); }"), known())
    assert names(graph)[-4:] == ["exception", "tick", "taken", "exception"]
    assert graph.worst().size_B == (graph.deepest_from("mps2_reset_entry").size_B + graph.deepest_from("tick").size_B
                                    + 2 * EXCEPTION_B)


def test_interrupts_of_one_priority_do_not_add_up_and_those_of_two_do(make_image: MakeImage) -> None:
    image = make_image("void mps2_reset_entry(void) { taken(0); }")
    same = CallList({}, (Interrupt("tick", 0), Interrupt("tick", 0)), "fault", ())
    nested = CallList({}, (Interrupt("tick", 0), Interrupt("tick", 1)), "fault", ())
    more_B = CallGraph(image, nested).worst().size_B - CallGraph(image, same).worst().size_B
    assert more_B == CallGraph(image, same).deepest_from("tick").size_B + EXCEPTION_B


def test_a_naked_function_counts_with_what_it_pushes(make_image: MakeImage) -> None:
    assert CallGraph(make_image("void mps2_reset_entry(void) { taken(0); }"), known()).worst_of_fault().size_B == 32


def test_functions_of_the_toolchain_count_with_what_their_code_pushes(make_image: MakeImage) -> None:
    graph = CallGraph(make_image("""
volatile long long left, right;
void mps2_reset_entry(void) { left = left / right; taken(0); }
"""), known())
    chain = dict(graph.deepest_from("mps2_reset_entry").links)
    assert chain["__aeabi_ldivmod"] >= 16 and chain["__udivmoddi4"] >= 32


def test_a_recursion_is_named(make_image: MakeImage) -> None:
    image = make_image("""
KEEP void odd(int n);
KEEP void even(int n) { volatile int used[2]; taken(used); if (n) { odd(n - 1); } taken(used); }
KEEP void odd(int n) { volatile int used[2]; taken(used); if (n) { even(n - 1); } taken(used); }
void mps2_reset_entry(void) { even(7); taken(0); }
""")
    with pytest.raises(StackUnknown, match="recursion: even > odd > even"):
        CallGraph(image, known()).worst()


def test_a_call_through_a_pointer_that_is_not_listed_is_an_error_that_says_what_to_add(make_image: MakeImage) -> None:
    with pytest.raises(StackUnknown, match=r'mps2_reset_entry \(firmware/small/main.c\).*\n  at = \["' + SITE):
        CallGraph(make_image(POINTER), known())


def test_a_call_through_a_pointer_leads_to_the_deepest_that_is_listed(make_image: MakeImage) -> None:
    graph = CallGraph(make_image(POINTER), known("small", "large"))
    graph.check_list()
    assert names(graph)[:2] == ["mps2_reset_entry", "large"]
    assert graph.worst().size_B > 400


def test_a_function_that_a_pointer_may_hold_and_no_entry_has_is_an_error(make_image: MakeImage) -> None:
    graph = CallGraph(make_image(POINTER), known("small"))
    with pytest.raises(StackUnknown, match="^large: something holds the address"):
        graph.check_list()


def test_a_recursion_through_a_pointer_is_found(make_image: MakeImage) -> None:
    image = make_image("""
void (*volatile chosen)(void);
KEEP static void again(void) { volatile int used[2]; taken(used); chosen(); taken(used); }
void mps2_reset_entry(void) { chosen = again; again(); taken(0); }
""")
    with pytest.raises(StackUnknown, match="recursion: again > again"):
        CallGraph(image, known("again")).worst()


def test_a_frame_of_unknown_size_is_an_error(make_image: MakeImage) -> None:
    image = make_image("""
KEEP static void flexible(int n) { volatile int used[n]; taken(used); }
volatile int length;
void mps2_reset_entry(void) { flexible(length); taken(0); }
""")
    with pytest.raises(StackUnknown, match="flexible .* size that is not known"):
        CallGraph(image, known())


def test_an_object_without_its_ci_file_is_an_error(make_image: MakeImage) -> None:
    image = make_image("void mps2_reset_entry(void) { taken(0); }")
    (image.build / "firmware/small/main.c.ci").unlink()
    with pytest.raises(StackUnknown, match="main.c.obj: no .ci file"):
        CallGraph(image, known())


@pytest.mark.parametrize(("instruction", "operands", "pushed"), [
    ("push", "{r4, r5, lr}", 12),
    ("push", "{r4-r11, lr}", 36),
    ("stmdb", "sp!, {r4, r5, r6, lr}", 16),
    ("vpush", "{d8-d15}", 64),
    ("vpush", "{s16-s17}", 8),
    ("sub", "sp, #24", 24),
    ("sub.w", "sp, sp, #1328\t; 0x530", 1328),
    ("strd", "ip, lr, [sp, #-16]!", 16),
    ("str.w", "r4, [sp, #-4]!", 4),
    ("stmdb", "r0!, {r4, r5}", 0),
    ("add", "sp, #24", 0),
    ("sub", "r0, #24", 0),
])
def test_instructions_that_push(instruction: str, operands: str, pushed: int) -> None:
    assert pushed_B(instruction, operands) == pushed


def test_what_only_describes_code_holds_no_address() -> None:
    line = "00000010  00001e02 R_ARM_ABS32            00000000   handler\n"
    assert pointers_in("Relocation section '.rel.rodata.table' at offset 0x1\n" + line) == {"handler"}
    assert pointers_in("Relocation section '.rel.debug_info' at offset 0x1\n" + line) == set()
