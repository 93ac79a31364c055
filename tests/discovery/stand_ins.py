"""Stand-ins for refits, and for what makes them."""

from collections.abc import Mapping
from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.selection import refits
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.models.effects.effect import Effect


def start_with(effect: Effect, values: Mapping[str, float] | None = None) -> CauseScore:
    """A start of refits with a cause."""
    return CauseScore(effect, dict(values or {}), (), 0.0, 0, 0.0, {})


def refit_with(cause: str, gained: float, *, patches: bool = False) -> Mock:
    """A refit, with what it gains in each of three videos, and whether its cause patches several of them."""
    refit = create_autospec(Trial, instance=True)
    refit.causes, refit.log_density, refit.log_prior = tuple(cause.split("+")), np.full(3, gained), 0.0
    refit.cause_names = frozenset(refit.causes) - {""}
    refit.fitted_density = refit.log_density
    refit.fit, refit.lacking = Mock(videos=(0, 1, 2)), 0.0
    refit.beyond = lambda base: tuple(one for one in refit.causes if one not in base.causes)
    refit.patches.return_value, refit.may_vanish.return_value = patches, False
    refit.loses_videos_of.return_value = refit.loses_most_of.return_value = False
    refit.fallen_from.return_value = []
    refit.start_with.side_effect = start_with
    refit.with_courses_of.side_effect = lambda _other: refit
    refit.continued.return_value = refit
    refit.freed.side_effect = lambda _base, **_how: refit
    return refit


def refits_with(needed: float = 0.0) -> refits.Refits:
    return refits.Refits((), seed=0, needed=needed, advance=lambda _count: None)


def without_tracks(monkeypatch: pytest.MonkeyPatch) -> None:
    """No refit has tracks to look at, nor fits of videos that could be explained or not."""
    monkeypatch.setattr(refits.Refits, "_placed", lambda _self, _trial: [])
    monkeypatch.setattr(refits.Refits, "_dropped", lambda _self, _trial: [])
    monkeypatch.setattr(refits, "trusted", lambda _fits: np.ones(4, dtype=bool))
