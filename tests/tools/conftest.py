"""Lets the tests import the tools the way that the tools import one another; the scene of tools/monitor's tests."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))


@pytest.fixture(scope="session")
def database():
    from taperlib.canbus import Database
    return Database(ROOT / "codegen" / "taper.dbc")


@pytest.fixture
def scene(database):
    from monitor_bench import three_connectors
    return three_connectors(database)
