"""What docs/porting.md shows is what the tests build."""

import re

from conftest import EXAMPLE, README, ROOT

BLOCK = re.compile(r"(?:^    .*\n|^\n(?=    ))+", re.MULTILINE)


def blocks(text: str) -> set[str]:
    """Indented code, without its indentation."""
    return {re.sub(r"^    ", "", found, flags=re.MULTILINE).strip() for found in BLOCK.findall(text)} - {""}


def test_the_loop_is_that_of_the_example_and_the_commands_are_those_of_its_readme() -> None:
    shown = blocks((ROOT / "docs/porting.md").read_text())
    program = (EXAMPLE / "main.c").read_text().strip()
    assert program in shown
    assert shown - {program} <= blocks(README.read_text())


def test_every_callback_of_the_port_is_explained() -> None:
    struct = (ROOT / "firmware/port/include/taper/port.h").read_text().split("typedef struct {")[1]
    callbacks = set(re.findall(r"\(\*(\w+)\)", struct))
    guide = (ROOT / "docs/porting.md").read_text()
    table = set(re.findall(r"`(\w+)`", "".join(line for line in guide.splitlines() if line.startswith("| `"))))
    assert {"receive", "store_write"} < callbacks <= table
