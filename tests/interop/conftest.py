"""Lets the tests import the independent program the way that it imports its parts."""

import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
DBC = str(HERE.parents[1] / "codegen" / "taper.dbc")
sys.path.insert(0, str(HERE))


@pytest.fixture(scope="session")
def wire():
    from peer.wire import Wire
    return Wire(DBC)
