"""Starts of which no world is possible go no further, and a mode without a world weighs nothing."""

from unittest.mock import Mock

import numpy as np
import pytest

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.search import refinement
from vrdp_prob.inference.search.descent import Descent
from vrdp_prob.inference.search.least_squares import Minimum
from vrdp_prob.inference.search.refinement import ROUNDS, refine

IMPOSSIBLE, POSSIBLE = 0.0, 5.0


def test_a_start_of_which_no_world_is_possible_goes_no_further(monkeypatch: pytest.MonkeyPatch) -> None:
    rounds: list[list[float]] = []

    def descent(starts: np.ndarray, *_given: object, **_named: object) -> list[Mock]:
        rounds.append(starts[:, 0].tolist())
        return [
            Mock(
                spec=Minimum,
                point=one,
                cost=1.0 if one[0] else np.inf,
                jacobian=np.eye(1),
                converged=False,
                evaluations=1,
            )
            for one in np.where(starts == IMPOSSIBLE, starts, starts + 1.0)
        ]

    monkeypatch.setattr(refinement, "best_noise", lambda _likelihood, point: point)
    monkeypatch.setattr(refinement, "evaluate", lambda _density, points: np.where(points[:, 0], points[:, 0], -np.inf))
    likelihood = Mock(coordinates=Mock(mask=lambda _fields: np.zeros(1, dtype=bool)))
    starts = [np.array([IMPOSSIBLE]), np.array([POSSIBLE])]
    impossible, possible = refine(Mock(spec=Descent, side_effect=descent, likelihood=likelihood), starts, hopeless=9.0)
    assert rounds == [[IMPOSSIBLE, POSSIBLE], *([POSSIBLE + number] for number in range(1, ROUNDS))]
    assert (impossible.log_density, impossible.evaluations) == (-np.inf, 1)
    assert (possible.log_density, possible.evaluations) == (POSSIBLE + ROUNDS, ROUNDS)


def test_a_mode_of_which_no_world_is_possible_has_no_evidence() -> None:
    assert Mode(np.zeros(2), np.full((2, 2), np.nan), -np.inf).log_evidence == -np.inf
