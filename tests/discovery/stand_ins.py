"""Stand-ins for refits, and for what makes them."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from vrdp_prob.discovery.candidates.first_guess import FirstGuess
from vrdp_prob.discovery.selection import refits
from vrdp_prob.discovery.selection.forward import ForwardSelection, Step
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.models.effects.effect import Effect


def start_with(effect: Effect, values: Mapping[str, float] | None = None) -> FirstGuess:
    """A start of refits with a cause."""
    return FirstGuess(effect, dict(values or {}))


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
    refit.begun_elsewhere.side_effect = lambda _base, _score: refit
    return refit


def refits_with(needed: float = 0.0) -> refits.Refits:
    """Refits of which none was made yet."""
    return refits.Refits((), seed=0, needed=needed, advance=lambda _count: None)


def without_tracks(monkeypatch: pytest.MonkeyPatch) -> None:
    """No refit has tracks to look at, nor fits of videos that could be explained or not."""
    monkeypatch.setattr(refits.Refits, "_placed", lambda _self, _trial: [])
    monkeypatch.setattr(refits.Refits, "_dropped", lambda _self, _trial: [])
    monkeypatch.setattr(refits, "trusted", lambda _fits: np.ones(4, dtype=bool))
    monkeypatch.setattr(refits.Refits, "searched_where_checks_fail", lambda _self, trial: trial)


def selection_with(needed: float = 0.0) -> ForwardSelection:
    """A selection that has refitted nothing yet."""
    return ForwardSelection(refits_with(needed))


def asked_models(monkeypatch: pytest.MonkeyPatch) -> list[Trial]:
    """The models on which causes are tried, as they come; none is."""
    asked: list[Trial] = []

    def tried(self: ForwardSelection, trial: Trial) -> Step:
        asked.append(trial)
        return self.untried(trial)

    monkeypatch.setattr(ForwardSelection, "tried", tried)
    return asked


def judge_by_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cause is doubted that gains less than two nats."""

    def doubted(_self: object, trial: Trial, lesser: Trial, _divisor: object) -> bool:
        return bool((trial.log_density - lesser.log_density).sum() < 2.0)

    monkeypatch.setattr(Leavings, "of", Mock())
    monkeypatch.setattr(refits.Refits, "doubted", doubted)


def asked_of_each(models: Sequence[Mock], monkeypatch: pytest.MonkeyPatch) -> list[Trial]:
    """The models on which causes are tried, as they come, each of which leads to the next one."""
    following = dict(pairwise(models))
    monkeypatch.setattr(ForwardSelection, "chosen", lambda _self, trial, _step: (trial, following[trial]))
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    return asked_models(monkeypatch)


def step_of(*tried: Trial) -> Step:
    """A step in which some causes were tried."""
    return Step(refit_with("", 0.0), Left((), (), np.ones(3)), tried)
