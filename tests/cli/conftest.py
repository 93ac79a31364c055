"""A tracks folder to run commands on."""

from pathlib import Path

import pytest
from command_line import OBJECTS, two_discs


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A tracks folder of one video with one collision."""
    (tmp_path / "tracks.csv").write_text(two_discs())
    (tmp_path / "objects.csv").write_text(OBJECTS)
    return tmp_path
