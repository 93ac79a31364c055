"""The climb of several videos where the best own numbers of one are at an edge."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.inference.several_videos.videos import sliding
from vrdp_prob.inference.search.least_squares import jacobian
from vrdp_prob.inference.several_videos import ascent, joint_fit, own_steps
from vrdp_prob.inference.several_videos.arrow import Expansion
from vrdp_prob.inference.several_videos.climb_state import State
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers
from vrdp_prob.models.coordinates import Coordinate, Coordinates
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import Prior, Transform
from vrdp_prob.models.physics import PhysicsModel

BELIEVED = Prior(2.0, 0.3)
"""Of the shared number."""
BEST = (2 / 0.3**2 - 1 / 2) / (1 / 0.3**2 + 1 / 2)
"""Most probable shared number: (shared - 2)^2 / (2 0.3^2) + (shared + 1)^2 / 4 is least there."""


@dataclass(frozen=True)
class Grazing(LinkedVideo):
    """Two bodies that meet if `second > shared + first`; they did, and all else would rather have `second` at -1."""

    @property
    def data(self) -> Any:
        return SimpleNamespace(residuals=self._residuals, coordinates=self.likelihood.coordinates)

    def _residuals(self, points: np.ndarray) -> np.ndarray:
        shared, first, second = points.T
        missed = 100.0 * (second <= shared + first)
        return np.stack([first, second + 1, missed], axis=1)

    def log_density(self, shared: np.ndarray, local: np.ndarray) -> np.ndarray:
        values: np.ndarray = -(self._residuals(self.points(shared, local)) ** 2).sum(axis=1) / 2
        return values


@dataclass(frozen=True)
class Sticking(Grazing):
    """What just sticks at a friction of 1, and would leave its track with any less, of which all else would have less.

    The other shared number is as good as any friction.
    """

    def _residuals(self, points: np.ndarray) -> np.ndarray:
        strength, friction, own = points.T
        slides = 100.0 * np.maximum(1 - friction, 0.0)
        return np.stack([5 * (strength - 1), friction + own, own, slides], axis=1)


@dataclass(frozen=True)
class Agreed(Grazing):
    """What both numbers are is plain."""

    def _residuals(self, points: np.ndarray) -> np.ndarray:
        strength, own = points.T
        return np.stack([5 * (strength - 1), own, 0 * own], axis=1)


def expand(video: LinkedVideo, shared: np.ndarray, local: np.ndarray) -> Expansion:
    """That of residuals, on the side of the edge where the point is."""
    point = video.points(shared, local)
    residuals, derivative = jacobian(video.data.residuals, point, np.ones(len(point)), central=True)
    derivative[-1], residuals = 0.0, residuals[:-1]
    gradient, count = derivative[:-1].T @ residuals, len(shared)
    return Expansion(gradient[:count], gradient[count:], derivative[:, :count], derivative[:, count:])


def grazing() -> tuple[SharedNumbers, Grazing]:
    entries = (Coordinate("shared", None, Transform.IDENTITY, BELIEVED),)
    own = tuple(Coordinate(name, 0, Transform.IDENTITY, Prior(0.0, 1.0)) for name in ("first", "second"))
    likelihood = Likelihood(sliding(0), PhysicsModel.base(), Coordinates(entries + own, {}))
    place = np.zeros(1, dtype=np.int64)
    return SharedNumbers((("shared", ()),), entries, None), Grazing(likelihood, place, place, np.zeros(1))


def climbed(monkeypatch: pytest.MonkeyPatch) -> ascent.JointFit:
    monkeypatch.setattr(joint_fit, "expand", expand)
    numbers, video = grazing()
    return ascent.climb(numbers, [video], np.zeros(1), [np.array([-0.52, -0.48])])


@pytest.mark.parametrize("both_sides", [True, False])
def test_a_ridge_is_followed_along_an_edge(monkeypatch: pytest.MonkeyPatch, *, both_sides: bool) -> None:
    if not both_sides:
        for module in (ascent, own_steps):
            monkeypatch.setattr(module, "best_of_cloud", lambda video, shared, centre, root, known: known)
    found = climbed(monkeypatch)
    assert found.gaussian.mean[0] == pytest.approx(BEST, abs=0.2)
    most = -((BEST - 2) ** 2) / (2 * 0.3**2) - (BEST + 1) ** 2 / 4
    assert found.log_density > most - 0.5
    assert not found.converged  # at an edge the density is no Gaussian


def test_where_one_shared_number_is_at_an_edge_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joint_fit, "expand", expand)
    keys = ("strength", "friction")
    entries = tuple(Coordinate(name, None, Transform.IDENTITY, Prior(0.0, 10.0)) for name in keys)
    own = Coordinate("own", 0, Transform.IDENTITY, Prior(0.0, 1.0))
    likelihood = Likelihood(sliding(0), PhysicsModel.base(), Coordinates((*entries, own), {}))
    video = Sticking(likelihood, np.arange(2), np.arange(2), np.zeros(2))
    numbers = SharedNumbers(tuple((name, ()) for name in keys), entries, None)
    begin = np.array([0.0, 1.001])
    found = ascent.climb(numbers, [video], begin, [np.array([-0.5])])
    assert found.gaussian.mean == pytest.approx([1.0, 1.0], abs=0.01)
    slopes = joint_fit.expand_all(numbers, [video], begin, [np.array([-0.5])])
    whole = ascent._improved(
        numbers, ascent._Ridges([video]), State.at([video], begin, [np.array([-0.5])]), slopes.shared_step
    )
    assert np.abs(whole.shared - begin).max() < 0.1  # all together they would leave the edge


@pytest.mark.parametrize("hindered", [True, False])
def test_others_do_not_follow_a_step_that_one_video_hinders(monkeypatch: pytest.MonkeyPatch, *, hindered: bool) -> None:
    numbers, video = grazing()
    videos, followed = [video, video], []

    def end(_: ascent._Ridges, index: int, shared: np.ndarray, own: np.ndarray, target: np.ndarray) -> np.ndarray:
        followed.append((index, float(target[0])))
        return np.array([3.0, 0.0]) if hindered and index else own  # where bodies that met do not

    monkeypatch.setattr(ascent._Ridges, "end", end)
    state = State.at(videos, np.zeros(1), [np.array([-3.0, -0.4])] * 2)
    found = ascent._improved(numbers, ascent._Ridges(videos), state, np.array([2.0]), 1.0)
    assert (found is state) == hindered
    assert [share for index, share in followed if index == 0] == [2.0]
    assert len([share for index, share in followed if index == 1]) == (len(ascent.SHARES) if hindered else 1)


def test_a_cloud_finds_the_other_side_of_an_edge() -> None:
    _, video = grazing()
    shared, beyond = np.array([1.0]), np.array([-0.9, 0.05])  # they would have to meet, and just do not
    found = own_steps.best_of_cloud(video, shared, beyond, np.eye(2), beyond)
    assert video.value(shared, beyond) < -1000
    assert video.value(shared, found) > -3


def test_the_same_cloud_is_drawn_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    assert climbed(monkeypatch).log_density == climbed(monkeypatch).log_density


@pytest.mark.parametrize(("gain", "rounds"), [(0.5, 1), (1.5, ascent.WHOLE.rounds)], ids=["a trifle", "a good part"])
def test_a_climb_ends_where_no_common_step_brings_anything_and_edges_bring_a_trifle_of_what_it_promises(
    gain: float, rounds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    numbers, video = grazing()
    crossed = []

    def across(_videos: object, state: State, _expansions: object) -> State:
        crossed.append(state)
        return replace(state, values=(state.values[0] + gain,))

    monkeypatch.setattr(joint_fit, "expand", expand)
    monkeypatch.setattr(ascent, "across_edges", across)
    monkeypatch.setattr(ascent, "settled", lambda _videos, state, _expansions: state)
    monkeypatch.setattr(ascent, "_improved", lambda _numbers, _ridges, state, *_others, **_how: state)
    monkeypatch.setattr(ascent, "_with_one_held", lambda _numbers, _ridges, state, _slopes: state)
    monkeypatch.setattr(
        ascent, "smooth", lambda _slopes: SimpleNamespace(expected_gain=100.0, shared_step=np.array([2.0]))
    )
    found = ascent.climb(numbers, [video], np.zeros(1), [np.array([-0.52, -0.48])])
    assert len(crossed) == rounds
    assert not found.converged


def test_a_climb_does_not_end_before_a_video_that_is_far_off_by_itself_has_come(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the others promise together is nothing, and it was taken to be at an edge."""
    monkeypatch.setattr(joint_fit, "expand", expand)
    entries = (Coordinate("strength", None, Transform.IDENTITY, Prior(1.0, 10.0)),)
    own = Coordinate("own", 0, Transform.IDENTITY, Prior(0.0, 1.0))
    likelihood = Likelihood(sliding(0), PhysicsModel.base(), Coordinates((*entries, own), {}))
    video = Agreed(likelihood, np.arange(1), np.arange(1), np.zeros(1))
    numbers = SharedNumbers((("strength", ()),), entries, None)
    found = ascent.climb(numbers, [video] * 3, np.ones(1), [np.zeros(1), np.zeros(1), np.array([5.0])])
    assert found.converged
    assert found.log_density == pytest.approx(0.0, abs=1e-6)
