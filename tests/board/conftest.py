import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from taperlib.drive import Drive  # noqa: E402
from taperlib.emulator import Emulator, emulated  # noqa: E402


@pytest.fixture(scope="session")
def image() -> Path:
    """The image under test."""
    path = os.environ.get("TAPER_IMAGE")
    assert path, "TAPER_IMAGE names no image; ctest --preset cm7-hub sets it"
    return Path(path)


@pytest.fixture
def board(image: Path) -> Iterator[Emulator]:
    """A board that was just switched on."""
    with emulated(image, debug=True) as emulator:
        yield emulator


@pytest.fixture
def drive(board: Emulator) -> Iterator[Drive]:
    with Drive(board.port) as attached:
        yield attached
