"""The mutants that tools/mutate.py makes: real mistakes, in code only."""

from taperlib.mutants import mutants


def changes(text: str) -> set[str]:
    return {mutant.change for mutant in mutants(text)}


def test_a_comparison_is_moved_by_one_and_turned_around():
    assert changes("bool f(void) { return a < b; }") == {"< -> <=", "< -> >="}


def test_each_mutant_changes_one_place_of_the_text():
    text = "void f(void) {\n    if (a == b && c) {\n        g(1, true);\n    }\n}\n"
    for mutant in mutants(text):
        changed = mutant.apply(text)
        assert changed != text
        assert changed.startswith(text[: mutant.start])
        assert changed.endswith(text[mutant.end :])
        assert text.splitlines()[mutant.line - 1].strip() != ""


def test_comments_strings_and_includes_are_left_alone():
    assert changes('#include "a<b.h"\n/* 1 < 2 */ // 3 == 4\nstatic const char s[] = "5 + 6";\n') == set()


def test_numbers_of_defines_are_changed():
    assert changes("#define LIMIT_ms UINT32_C(7000)\n#if A > 1\n#endif\n") == {"7000 -> 7001"}


def test_nothing_and_one_become_each_other():
    assert changes("int x = 0;\nint y = 1u;\n") == {"0 -> 1", "1u -> 0u"}


def test_a_call_and_an_assignment_are_left_out_but_no_declaration():
    text = "void f(void) {\n    int a = b;\n    c = d;\n    g(a);\n    a->x++;\n}\n"
    assert {change for change in changes(text) if change.endswith("nothing")} == {
        "c = d -> nothing", "g(a) -> nothing", "a->x++ -> nothing",
    }  # fmt: skip


def test_a_sign_and_a_pointer_are_no_arithmetic():
    assert not {"- -> +", "* -> /"} & changes("void f(void) { return -a; }")
    assert "- -> +" in changes("void f(void) { return b - a; }")


def test_words_that_are_easily_confused_are_swapped():
    assert changes("return taper_min_i32(a, b) && true;") == {
        "taper_min_i32 -> taper_max_i32", "true -> false", "&& -> ||",
    }  # fmt: skip
