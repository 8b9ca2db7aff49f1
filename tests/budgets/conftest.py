"""Small images, compiled and linked as those of the boards are."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from taperlib.image import Image  # noqa: E402

CORES = {"m7": ("-mcpu=cortex-m7", "-mfpu=fpv5-d16"), "m4": ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16")}
FLAGS = ("-mthumb", "-mfloat-abi=hard", "-Os", "-g", "-ffunction-sections", "-fdata-sections", "-ffreestanding",
         "-fcallgraph-info=su")
# What every image has: an interrupt, and a handler of faults with a stack of its own.
AROUND = """
#define KEEP __attribute__((noinline, noipa))
KEEP void taken(volatile void *memory);
KEEP void taken(volatile void *memory) { __asm volatile("" ::"r"(memory) : "memory"); }
void tick(void);
void tick(void) { volatile int used[8]; taken(used); }
void fault(void);
__attribute__((naked)) void fault(void) { __asm volatile("push {r4-r11}\\n b ."); }
__attribute__((section(".rodata.vectors"), used)) static void (*const vectors[])(void) = {tick, fault};
void mps2_reset_entry(void);
"""


@pytest.fixture
def make_image(tmp_path: Path) -> Callable[..., Image]:
    def make(code: str, core: str = "m7") -> Image:
        folder = tmp_path / "firmware/small"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "main.c").write_text(AROUND + code)
        compiler = ["arm-none-eabi-gcc", *CORES[core], *FLAGS]
        subprocess.run([*compiler, "-c", tmp_path / "firmware/small/main.c", "-o", "firmware/small/main.c.obj"],
                       cwd=tmp_path, check=True)
        subprocess.run([*compiler, "-nostdlib", "-nostartfiles", "firmware/small/main.c.obj", "-lgcc", "-Wl,--gc-sections",
                        "-Wl,-e,mps2_reset_entry,-u,tick,-u,fault", "-Wl,-Map=firmware/small/small.map", "-o", "firmware/small/small.elf"],
                       cwd=tmp_path, check=True)
        return Image.of_build(tmp_path)
    return make
