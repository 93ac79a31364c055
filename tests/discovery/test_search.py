"""In which order the search tries causes."""

from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from vrdp_prob.discovery import search
from vrdp_prob.discovery.trials import Trial


def _refit(cause: str, gained: float, *, patches: bool = False) -> Mock:
    """A refit, with what it gains in each of three videos, and whether its cause patches several of them."""
    refit = create_autospec(Trial, instance=True)
    refit.causes, refit.log_density, refit.log_prior = (cause,), np.full(3, gained), 0.0
    refit.fit = Mock(videos=(0, 1, 2))
    refit.patches.return_value = patches
    return refit


def _searcher() -> search._Searcher:
    return search._Searcher((), seed=0, needed=0.0, advance=lambda _count: None)


@pytest.mark.parametrize(("in_doubt", "order"), [(False, ["tilt", "drag", "kicks"]), (True, ["kicks", "tilt", "drag"])])
def test_kicks_come_last_unless_the_best_other_cause_is_in_doubt(
    in_doubt: bool, order: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kicks, tilt, drag = _refit("kicks", 30.0, patches=True), _refit("tilt", 20.0), _refit("drag", 10.0)
    asked: list[Trial] = []

    def doubted(_self: object, trial: Trial, _lesser: object, _divisor: np.ndarray) -> bool:
        asked.append(trial)
        return in_doubt

    monkeypatch.setattr(search._Searcher, "doubted", doubted)
    found = _searcher()._in_order(_refit("nothing", 0.0), [drag, kicks, tilt])
    assert [one.causes[0] for one in found] == order
    assert asked == [tilt]


def test_kicks_alone_are_ordered_by_merit() -> None:
    kicks, weaker = _refit("kicks", 30.0, patches=True), _refit("kicks", 5.0, patches=True)
    assert _searcher()._in_order(_refit("nothing", 0.0), [weaker, kicks]) == [kicks, weaker]
