"""What videos share is known no better than the middle of restitutions, which may do what a shared number does.

The reference solves for all numbers of all videos and the middle at once.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from jaxtyping import Float

from vrdp_prob.inference.several_videos.arrow import Expansion, Expansions, SharedExpansion
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.population import shared_sd, with_learned_spread
from vrdp_prob.models.parameters import MASS, RESTITUTION, Prior
from vrdp_prob.models.physics import PhysicsModel

SHARED, BODIES, OTHERS, VIDEOS = 3, 2, 2, 8
"""Shared numbers; restitutions, and other own numbers of each video; and videos."""
OWN = BODIES + OTHERS
BELIEVED = Prior(-0.3, 0.05)
"""What the fit believes of a restitution."""


def told(seed: int, *, alike: bool) -> list[tuple[Float[np.ndarray, "datum number"], Float[np.ndarray, "datum"]]]:
    """Derivative of each video's data by the shared numbers and its own, restitutions first, and the data.

    Where `alike`, the last shared number does nearly what all restitutions together do.
    """
    generator = np.random.default_rng(seed)
    shared, videos = generator.standard_normal(SHARED), []
    for _ in range(VIDEOS):
        derivative = 30.0 * generator.standard_normal((9, SHARED + OWN))
        if alike:
            derivative[:, SHARED - 1] = derivative[:, SHARED : SHARED + BODIES].sum(axis=1) + generator.normal(size=9)
        own = np.append(generator.normal(-0.1, 0.03, BODIES), generator.standard_normal(OTHERS))
        videos.append((derivative, derivative @ np.append(shared, own) + generator.standard_normal(9)))
    return videos


def whole(
    videos: list[tuple[Float[np.ndarray, "datum number"], Float[np.ndarray, "datum"]]], sd: float, middle: Prior
) -> tuple[Float[np.ndarray, "number"], Float[np.ndarray, "number number"]]:
    """Mean and covariance of the shared numbers, each video's own ones, and the middle of restitutions, last."""
    size = SHARED + VIDEOS * OWN + 1
    rows, ends = [np.eye(SHARED, size), np.eye(size)[-1:] / middle.sd], [np.zeros(SHARED), [middle.mean / middle.sd]]
    for number, (derivative, data) in enumerate(videos):
        first = SHARED + number * OWN
        row = np.zeros((len(data) + OWN, size))
        row[: len(data), [*range(SHARED), *range(first, first + OWN)]] = derivative
        row[len(data) :, first : first + OWN] = np.diag([1 / sd] * BODIES + [1.0] * OTHERS)
        row[len(data) : len(data) + BODIES, -1] = -1 / sd
        rows.append(row)
        ends.append(np.append(data, np.zeros(OWN)))
    stacked = np.concatenate(rows)
    return np.linalg.lstsq(stacked, np.concatenate(ends))[0], np.linalg.inv(stacked.T @ stacked)


def fit_of(videos: list[tuple[Float[np.ndarray, "datum number"], Float[np.ndarray, "datum"]]]) -> SharedFit:
    """The fit in which restitutions spread around the middle that is believed."""
    known = Prior(BELIEVED.mean, 1e-9)
    mean, _ = whole(videos, BELIEVED.sd, known)
    own = np.pad(np.diag([1 / BELIEVED.sd] * BODIES + [1.0] * OTHERS), ((0, 0), (SHARED, 0)))
    stacked = [np.concatenate([derivative, own]) for derivative, _ in videos]
    prior = SharedExpansion(np.zeros(SHARED), np.eye(SHARED))
    parts = [Expansion(np.zeros(SHARED), np.zeros(OWN), one[:, :SHARED], one[:, SHARED:]) for one in stacked]
    locals_ = list(mean[SHARED:-1].reshape(VIDEOS, OWN))
    gaussian = Expansions(prior, tuple(parts)).gaussian(mean[:SHARED], locals_, np.zeros(SHARED, dtype=bool))
    entries = [SimpleNamespace(field=RESTITUTION.name, prior=BELIEVED)] * BODIES
    entries += [SimpleNamespace(field=MASS.name, prior=Prior(0.0, 1.0))] * OTHERS
    likelihood = SimpleNamespace(coordinates=SimpleNamespace(entries=entries))
    video = SimpleNamespace(likelihood=likelihood, local_places=range(OWN))
    model = replace(PhysicsModel.base(), beliefs={RESTITUTION.name: replace(RESTITUTION, prior=BELIEVED)})
    fit = object.__new__(SharedFit)  # a fit of linear videos has no simulator, and needs nothing else here
    fit.__dict__.update(model=model, joint=SimpleNamespace(gaussian=gaussian, videos=[video] * VIDEOS))
    return fit


@pytest.mark.parametrize("alike", [False, True])
@pytest.mark.parametrize("seed", [1, 3])
def test_a_middle_is_learned_together_with_what_is_shared(seed: int, alike: bool) -> None:
    videos = told(seed, alike=alike)
    learned = with_learned_spread(fit_of(videos), RESTITUTION, mean=True).prior
    mean, _ = whole(videos, learned.sd, RESTITUTION.prior)
    assert learned.mean == pytest.approx(mean[-1], abs=1e-6)
    assert abs(mean[-1] - BELIEVED.mean) > 0.05  # the fit believed something else


@pytest.mark.parametrize("seed", [1, 2])
def test_what_is_shared_is_known_no_better_than_the_middle(seed: int) -> None:
    videos = told(seed, alike=True)
    fit = fit_of(videos)
    _, covariance = whole(videos, BELIEVED.sd, RESTITUTION.prior)
    found = shared_sd(fit)
    np.testing.assert_allclose(found, np.sqrt(np.diag(covariance)[:SHARED]), rtol=1e-6)
    assert found[-1] > 1.2 * fit.joint.gaussian.sd[-1]
    assert found[0] == pytest.approx(fit.joint.gaussian.sd[0], rel=0.05)


def test_where_too_few_bodies_are_told_of_the_middle_is_no_matter_of_theirs() -> None:
    fit = fit_of([(np.where(np.arange(SHARED + OWN) < SHARED, one, 0.0), data) for one, data in told(1, alike=False)])
    np.testing.assert_array_equal(shared_sd(fit), fit.joint.gaussian.sd)
