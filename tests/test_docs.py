"""The programs that the documentation shows do what it says."""

import contextlib
import io
import math
import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[1] / "docs" / "write-your-own-effect.md"
BLOCK = re.compile(r"^```python\n(?P<source>.*?)^```\n(?:\n```text\n(?P<printed>.*?)^```\n)?", re.MULTILINE | re.DOTALL)


def test_the_effect_of_the_documentation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    names: dict[str, object] = {}
    text = PAGE.read_text(encoding="utf-8")
    blocks = list(BLOCK.finditer(text))
    assert len(blocks) == text.count("```python") == 4
    assert sum(block["printed"] is not None for block in blocks) == text.count("```text") == 3
    Path("bowl.py").write_text(blocks[0]["source"], encoding="utf-8")
    for block in blocks[1:]:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(block["source"], PAGE.name, "exec"), names)
        assert printed.getvalue() == (block["printed"] or "")
    _check_oscillation(names)


def _check_oscillation(names: dict[str, object]) -> None:
    """Compare with the closed form: half a metre from the middle of a bowl of stiffness 2, at 4 s."""
    frequency, time = math.sqrt(2.0), 4.0
    cosine, sine = math.cos(frequency * time), math.sin(frequency * time)
    place = (0.5 + 0.5 * cosine + 0.3 / frequency * sine, 0.6 / frequency * sine)
    by_frequency = -0.5 * time * sine + 0.3 * (time * cosine / frequency - sine / frequency**2)
    assert names["place"].tolist() == pytest.approx(place, abs=1e-10)
    assert names["slope"].item() == pytest.approx(by_frequency / (2 * frequency), abs=1e-9)
    assert '"bowl:Bowl", # The table is hollow' in Path("bowl.toml").read_text(encoding="utf-8")
