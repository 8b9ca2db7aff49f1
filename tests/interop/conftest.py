"""Lets the tests import the independent program the way that it imports its parts."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
