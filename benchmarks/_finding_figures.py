"""Figures of a finding, from its page to the documentation."""

import shutil
from pathlib import Path

from vrdp_prob.discovery.finding import Finding
from vrdp_prob.files import write_atomically

DRAWN = (
    "Missing acceleration over the plane",
    "Missing acceleration against speed",
    "Tangential against normal impulse",
    "Duration of touch at contacts",
)
"""Figures of the page of a finding that are kept as files too."""
WHITE = '<rect width="100%" height="100%" fill="white"/>'


def keep_figures(finding: Finding, folder: Path) -> None:
    """Write what is kept of the figures of a finding to a folder, on a white ground."""
    for title in finding.figures.keys() & set(DRAWN):
        with write_atomically(_file(folder, title)) as temporary:
            temporary.write_text(finding.figures[title].replace(">", f">{WHITE}", 1), encoding="utf-8")


def copy_figures(folder: Path, docs: Path, name: str) -> None:
    """Copy figures that were kept in a folder to the documentation, as far as they are there; others stay as they are.

    Parameters
    ----------
    folder
        Where they were kept.
    docs
        Folder of the documentation.
    name
        With which the names of the copies begin.
    """
    for title in DRAWN:
        if (kept := _file(folder, title)).exists():
            shutil.copyfile(kept, docs / "figures" / f"{name}-{kept.name}")


def _file(folder: Path, title: str) -> Path:
    """Where a figure of a finding is kept."""
    return folder / f"{title.lower().replace(' ', '-')}.svg"
