"""Writing a report: complete files or none."""

import json
import os
from pathlib import Path
from typing import NamedTuple

from vrdp_prob.errors import InputError
from vrdp_prob.report.content import ReportContent
from vrdp_prob.report.document import to_document
from vrdp_prob.report.page import render


class ReportFiles(NamedTuple):
    """Where a report was written."""

    document: Path
    page: Path


def write_report(content: ReportContent, directory: Path) -> ReportFiles:
    """Write report.json and report.html into a folder, which is made where it is missing.

    Raises
    ------
    InputError
        If the folder cannot be made or written to.
    """
    files = ReportFiles(directory / "report.json", directory / "report.html")
    texts = (json.dumps(to_document(content), indent=1, allow_nan=False) + "\n", render(content))
    try:
        directory.mkdir(parents=True, exist_ok=True)
        _replace_all(dict(zip(files, texts, strict=True)))
    except OSError as error:
        raise InputError(
            f"{directory}: the report cannot be written there ({error.strerror}); choose another folder with --out."
        ) from error
    return files


def _replace_all(texts: dict[Path, str]) -> None:
    """Write all files under temporary names, then rename them; an interruption leaves none half-written."""
    temporary = {path: path.with_name(f".{path.name}.{os.getpid()}.tmp") for path in texts}
    try:
        for path, text in texts.items():
            temporary[path].write_text(text, encoding="utf-8")
        for path, written in temporary.items():
            written.replace(path)
    finally:
        for written in temporary.values():
            written.unlink(missing_ok=True)
