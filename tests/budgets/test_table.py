"""The table of budgets, what is in an image, and the command."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from taperlib import board_run, budgets_command
from taperlib.budgets import BEGIN, END, BadTable, Table, page
from taperlib.image import Image, parse_map

TABLE = """\
# The head stays.
[figures]
ram_B = "RAM in all"
stack_B = "worst stack"

[small.ram_B]
measured = 1000
limit = 1050 # why it is so
why = "growth"
bound = 2000
bound_why = "what the board has"

[small.stack_B]
note = "main 8"
measured = 100
limit = 132
why = "growth"

[history.before]
"as OSQP writes it" = { flash = 12345 }
"""


def test_what_is_within_its_limits_is_no_complaint() -> None:
    assert Table(TABLE).check("small", {"ram_B": 1050, "stack_B": 132}) == []


def test_growth_over_a_limit_names_image_figure_value_limit_and_what_to_do() -> None:
    complaint, = Table(TABLE).check("small", {"ram_B": 1051})
    for text in ("small: ram_B is 1,051", "limit of 1,050 (growth)", "it was 1,000", "tools/budgets --map small",
                 "tools/budgets.toml"):
        assert text in complaint


def test_above_a_bound_there_is_no_talk_of_raising_a_limit() -> None:
    complaint, = Table(TABLE).check("small", {"ram_B": 2001})
    assert "bound of 2,000 (what the board has)" in complaint and "raise" not in complaint


def test_a_figure_without_an_entry_is_a_complaint() -> None:
    assert "no entry" in Table(TABLE).check("small", {"flash_B": 1})[0]
    assert "no entry" in Table(TABLE).check("other", {"ram_B": 1})[0]


def test_a_limit_above_its_bound_is_refused() -> None:
    with pytest.raises(BadTable, match="small.ram_B: the limit 2,001 is above the bound 2,000"):
        Table(TABLE.replace("limit = 1050", "limit = 2001"))


def test_an_entry_of_an_unknown_figure_is_refused() -> None:
    with pytest.raises(BadTable, match="small.ram_B: .figures. does not say"):
        Table(TABLE.replace('ram_B = "RAM in all"\n', ""))


def test_writing_renews_what_was_measured_and_nothing_else() -> None:
    text = Table(TABLE).with_measured("small", {"ram_B": 1040, "stack_B": 101}, {"stack_B": "main 9"}).text
    assert text == (TABLE.replace("measured = 1000", "measured = 1040").replace("measured = 100\n", "measured = 101\n")
                    .replace("main 8", "main 9"))


def test_writing_raises_no_limit() -> None:
    table = Table(TABLE).with_measured("small", {"ram_B": 1500}, {})
    assert table.budgets["small"]["ram_B"].limit == 1050
    assert table.check("small", {"ram_B": 1500})


def test_what_shrank_by_more_than_its_margin_gets_a_lower_limit() -> None:
    table = Table(TABLE).with_measured("small", {"ram_B": 500}, {})
    assert table.budgets["small"]["ram_B"].limit == 525
    assert 'limit = 525\nwhy = "growth"' in table.text


def test_the_page_has_every_figure_its_limit_and_the_history() -> None:
    text = page(f"Before.\n{BEGIN}\nold\n{END}\nAfter.\n", Table(TABLE))
    assert text.startswith("Before.\n") and text.endswith("After.\n") and "old" not in text
    for cell in ("| RAM in all | **1,000** (limit 1,050, bound 2,000) |", "`small`, worst stack: main 8", "**before**",
                 "| as OSQP writes it | 12,345 |"):
        assert cell in text


MAP = """\
Archive member included\n
 .text.gone     0x00000000       0x10 firmware/lost.c.obj
Linker script and memory map

.text           0x00000000       0x60
 .text.short    0x00000000       0x20 firmware/app/libtaper_app.a(send.c.obj)
                0x00000000                short
 .text.with_a_long_name
                0x00000020       0x30 firmware/mps2/CMakeFiles/taper-mps2-an500.dir/main.c.obj
 .text          0x00000050       0x10 /usr/lib/libc_nano.a(libc_a-memset.o)

.rodata         0x00000060        0x8
 .rodata.hub_P  0x00000060        0x8 firmware/planner/libtaper_solvers.a(hub_workspace.c.obj)

.debug_info     0x00000000       0x99
 .debug_info    0x00000000       0x99 firmware/mps2/CMakeFiles/taper-mps2-an500.dir/main.c.obj
"""


def test_a_map_tells_the_pieces_of_the_image_by_library_and_object() -> None:
    pieces = parse_map(MAP)
    assert [(p.output, p.library, p.object, p.size_B) for p in pieces] == [
        (".text", "app", "send", 0x20), (".text", "mps2", "main", 0x30), (".text", "c_nano", "libc_a-memset", 0x10),
        (".rodata", "solvers", "hub_workspace", 8)]
    assert [piece.is_solver_workspace for piece in pieces] == [False, False, False, True]


def test_a_helper_for_doubles_is_found_where_the_core_has_no_unit_for_them(make_image: Callable[..., Image]) -> None:
    code = "volatile double number; void mps2_reset_entry(void) { number = number / 3; }"
    assert "__aeabi_ddiv" in make_image(code, "m4").forbidden(has_doubles=False)
    assert make_image(code, "m7").forbidden(has_doubles=False) == []


def test_sixty_four_bit_integers_are_no_doubles(make_image: Callable[..., Image]) -> None:
    code = "volatile long long n; void mps2_reset_entry(void) { n = n / 3; }"
    assert make_image(code, "m4").forbidden(has_doubles=False) == []


def test_heap_and_formatted_output_are_found(make_image: Callable[..., Image]) -> None:
    code = """
void *malloc(unsigned size); void *_sbrk(int more); int snprintf(char *text);
KEEP void *malloc(unsigned size) { taken(&size); return 0; }
KEEP void *_sbrk(int more) { taken(&more); return 0; }
KEEP int snprintf(char *text) { taken(text); return 0; }
void mps2_reset_entry(void) { taken(malloc(1)); taken(_sbrk(1)); snprintf(0); }
"""
    assert make_image(code).forbidden(has_doubles=True) == ["_sbrk", "malloc", "snprintf"]


# ---- The committed table, and the command

def test_the_committed_page_is_that_of_the_committed_table() -> None:
    assert budgets_command.DOCS.read_text() == page(budgets_command.DOCS.read_text(), Table.read())


def test_the_committed_table_holds_every_image_to_what_was_promised() -> None:
    budgets = Table.read().budgets
    assert set(budgets) == set(budgets_command.PRESETS)
    assert budgets["cm7-hub"]["ram_B"].bound == 256 * 1024
    assert budgets["cm7-hub"]["flash_code_B"].bound == 128 * 1024
    assert budgets["cm7-garage"]["ram_B"].bound == 1024 * 1024
    assert budgets["cm7-hub"]["tick_worst"].bound == budgets["cm7-garage"]["tick_worst"].bound == 2_400_000


def test_an_unknown_preset_is_a_bad_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        budgets_command.main(["cm9-hub"])
    assert "cm9-hub: no preset of a board; there are cm7-hub" in capsys.readouterr().err


def test_an_image_that_is_not_there_is_told(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
                                           tmp_path: Path) -> None:
    monkeypatch.setattr(budgets_command, "ROOT", tmp_path)
    assert budgets_command.main(["cm7-hub", "--built"]) == 1
    assert "cm7-hub holds 0 images" in capsys.readouterr().err


# ---- What runs

def test_a_scene_has_a_vehicle_on_every_connector() -> None:
    lines = board_run.SCENES["garage"].sessions().splitlines()
    assert len(lines) == 1 + 54 and len({line.split(",")[1] for line in lines[1:]}) == 54


DUMP = """\
summary: 1000
fn=(1) taper_station_step
cfn=(2) taper_planner_run
calls=1 0
10 900
fn=(2)
cfn=(3) taper_iterate
calls=2 0
20 800
fn=(3)
cfn=(4) taper_update_xz_tilde
calls=5 0
30 600
"""


def test_dumps_of_callgrind_are_counted_with_and_without_a_slice() -> None:
    steps = [board_run.Calls(DUMP), board_run.Calls("summary: 70\n"), board_run.Calls("summary: 90\n"),
             board_run.Calls("summary: 80\n")]
    assert board_run.summary(steps) == {"host_tick_median": 80, "host_tick_worst_without_slice": 90,
                                        "host_tick_worst": 1000, "host_iteration": 160}


def test_the_stack_that_the_emulator_saw_must_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    for used, agrees in ((2000, True), (1400, True), (1399, False), (2001, False)):
        measured = budgets_command.Measured.__new__(budgets_command.Measured)
        measured.preset, measured.figures, measured.complaints = "cm7-hub", {"stack_B": 2000}, []
        measured.add_run({"stack_used_B": used})
        assert (measured.complaints == []) == agrees
