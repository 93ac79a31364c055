"""Which causes are worth a refit, by their scores."""

from unittest.mock import Mock

import pytest

from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.selection import shortlist as module
from vrdp_prob.discovery.selection.shortlist import shortlist


def test_kicks_are_no_measure_of_laws(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = {"kicks": 1000.0, "patch": 150.0, "drag": 100.0, "curl": 20.0, "wind": 45.0, "a jump of the clock": 90.0}
    scores = [Mock(spec=CauseScore, effect=cause, size=size, p_value=1e-9) for cause, size in sizes.items()]
    monkeypatch.setattr(module, "happens_once", lambda cause: cause in {"kicks", "a jump of the clock"})
    assert [one.effect for one in shortlist(scores)] == ["kicks", "patch", "drag"]
    assert [one.effect for one in shortlist(scores, 0.8)] == ["kicks", "patch"]


@pytest.mark.parametrize(("sixth", "refitted"), [(96.0, 6), (94.0, 5)])
def test_causes_that_score_as_well_as_the_last_that_is_refitted_are_refitted_too(
    sixth: float, refitted: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "happens_once", lambda _cause: False)
    sizes = [300.0, 200.0, 150.0, 110.0, 100.0, sixth, 60.0]
    scores = [Mock(spec=CauseScore, effect=f"cause {size}", size=size, p_value=0.0) for size in sizes]
    assert len(shortlist(scores)) == refitted
