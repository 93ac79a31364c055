"""Files are complete or absent."""

import json

import pytest

from vrdp_prob.errors import InputError
from vrdp_prob.report import write_report


def test_writes_both_files_and_nothing_else(content, tmp_path):
    files = write_report(content, tmp_path / "a" / "b")
    assert json.loads(files.document.read_text(encoding="utf-8"))["video"] == "video_00000"
    assert files.page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert sorted(path.name for path in files.page.parent.iterdir()) == ["report.html", "report.json"]


def test_writing_again_replaces(content, tmp_path):
    (tmp_path / "report.json").write_text("old", encoding="utf-8")
    first = write_report(content, tmp_path).page.read_bytes()
    assert write_report(content, tmp_path).page.read_bytes() == first
    assert (tmp_path / "report.json").read_text(encoding="utf-8") != "old"


def test_folder_that_cannot_be_made_is_one_sentence(content, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    with pytest.raises(InputError, match=r"cannot be written .*choose another"):
        write_report(content, blocked)


def test_failure_leaves_nothing_half_written(content, tmp_path):
    (tmp_path / "report.html").mkdir()
    with pytest.raises(InputError):
        write_report(content, tmp_path)
    assert not list(tmp_path.glob(".*"))
