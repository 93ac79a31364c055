"""The comparison of samplers goes through; what it finds is measured by `benchmarks/agreement.py` itself."""

import importlib
from pathlib import Path
from types import ModuleType

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
TWO_SPHERES, NOTHING_MOVES = 128, 231
"""Seeds of scenes."""


@pytest.fixture
def agreement(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("agreement")


def test_two_samplers_are_compared_in_all_quantities(agreement: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(agreement, "SAMPLERS", {"laplace": 2000, "emcee": 200})
    result = agreement.one(TWO_SPHERES)
    assert result["stopped"] is None
    quantities = {pair["quantity"] for pair in result["compared"]}
    assert "the mass ratio of objects 0 and 1" in quantities
    assert len(result["compared"]) == 2 * len(quantities)
    assert {tuple(pair["samplers"]) for pair in result["compared"]} == {("laplace", "emcee")}
    assert all(abs(pair["difference"]) < agreement.TOO_FAR for pair in result["compared"])
    table = agreement.tables([{**result, "version": "here"}])
    assert f"| {TWO_SPHERES} | {result['unknowns']} |" in table
    assert agreement.checks([result], 1)[0]["ok"]


def test_a_scene_in_which_nothing_moves_is_told_and_left_out(agreement: ModuleType) -> None:
    result = agreement.one(NOTHING_MOVES)
    assert result["stopped"]["sampler"] == agreement.REFUSED
    assert "no object moves" in result["stopped"]["sentence"]
    assert agreement.tables([result]) == "In none of 1 scenes all samplers have converged."
    assert agreement.checks([result], 1)[1]["value"] is None
