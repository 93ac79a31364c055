"""Imported for its effect: what lies beside the package (the tests) can be imported by a benchmark run as a script."""

import sys
from pathlib import Path

ROOT = str(Path(__file__).parents[1])
if ROOT not in sys.path:
    sys.path.append(ROOT)
