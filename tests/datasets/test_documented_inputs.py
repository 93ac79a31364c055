"""The examples of docs/inputs.md are read as they stand there."""

import re
from pathlib import Path

import numpy as np

from vrdp_prob.datasets import load, read_questions
from vrdp_prob.reasoning.checking import check_question
from vrdp_prob.scene import Camera

TEXT = (Path(__file__).parents[2] / "docs" / "inputs.md").read_text(encoding="utf-8")


def test_the_documented_files_are_read(tmp_path: Path) -> None:
    tables = re.findall(r"`(\w+\.csv)`:\n\n```csv\n(.*?)```", TEXT, flags=re.DOTALL)
    documents = re.findall(r"## `(\w+\.json)`\n\n```json\n(.*?)```", TEXT, flags=re.DOTALL)
    for name, content in tables + documents:
        (tmp_path / name).write_text(content, encoding="utf-8")
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "camera.json",
        "objects.csv",
        "questions.json",
        "tracks.csv",
        "walls.csv",
    ]
    tracks = load(tmp_path)
    assert [body.id for body in tracks.bodies] == ["A", "B"]
    assert len(tracks.walls) == 2
    np.testing.assert_allclose(tracks.camera.projection, Camera.clevrer().projection)
    for question in read_questions(tmp_path / "questions.json")[tracks.video]:
        check_question(question, tracks=tracks)
