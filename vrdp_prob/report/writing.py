"""Writing a report: complete files or none."""

import json
from pathlib import Path
from typing import NamedTuple

from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically
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
    document = json.dumps(to_document(content), indent=1, allow_nan=False) + "\n"
    page = render(content)
    try:
        with write_atomically(files.document) as new_document, write_atomically(files.page) as new_page:
            new_document.write_text(document, encoding="utf-8")
            new_page.write_text(page, encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"{directory}: the report cannot be written there ({error.strerror}); choose another folder."
        ) from error
    return files
