"""Imports between packages, and between the rooms of `inference` and `discovery`, point one way."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HOUSE = ("cli", "evaluation", "discovery", "report", "reasoning", "inference", "models", "scene")
INFERENCE = ("several_videos", "", "samplers", "search", "identifiability", "draws")
DISCOVERY = ("page", "selection", "candidates", "checks", "residuals")
"""From the top down; a package may import those that follow it. Without a name are modules that stand in no room."""


def arrows(package: Path, module: str) -> set[tuple[str, str]]:
    """Which rooms of a package import which, where those are not the same."""
    rooms = {path.name for path in package.iterdir() if (path / "__init__.py").exists()}
    found = set()
    for file in package.rglob("*.py"):
        if file == package / "__init__.py":
            continue  # the door, which hands out what is behind it
        first = file.relative_to(package).parts[0]
        here = first if first in rooms else Path(first).stem if module == "vrdp_prob" else ""
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith(f"{module}."):
                there = node.module.removeprefix(f"{module}.").split(".")[0]
                found.add((here, there if there in rooms or module == "vrdp_prob" else ""))
    return {(here, there) for here, there in found if here != there}


@pytest.mark.parametrize(
    ("package", "order"),
    [("vrdp_prob", HOUSE), ("vrdp_prob.inference", INFERENCE), ("vrdp_prob.discovery", DISCOVERY)],
)
def test_imports_point_down(package: str, order: tuple[str, ...]) -> None:
    known = [pair for pair in arrows(ROOT.joinpath(*package.split(".")), package) if set(pair) <= set(order)]
    assert len(known) >= len(order) - 2
    assert [pair for pair in known if order.index(pair[0]) > order.index(pair[1])] == []
