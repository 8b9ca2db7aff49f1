"""Lets the tests import the tools; the library that they are about, and what it is built for."""

import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = Path(os.environ["TAPER_SCHEDULER"])
sys.path.insert(0, str(ROOT / "tools"))


@pytest.fixture
def hub():
    """The hub by the planner, closed at the end."""
    from taperlib.scheduler import Scheduler
    with Scheduler("hub", library=LIBRARY) as scheduler:
        yield scheduler
