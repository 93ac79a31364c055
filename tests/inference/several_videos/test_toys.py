"""The samplers of several videos on densities whose marginals are known by quadrature."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.special import logsumexp

from tests.inference.several_videos.videos import sliding
from vrdp_prob.inference.draws.diagnostics import chain_statistics
from vrdp_prob.inference.several_videos.arrow import ArrowGaussian, Expansion, Expansions, SharedExpansion
from vrdp_prob.inference.several_videos.gibbs import sample_gibbs
from vrdp_prob.inference.several_videos.importance import sample_by_importance
from vrdp_prob.inference.several_videos.joint_fit import JointFit, LocalMode
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers
from vrdp_prob.inference.several_videos.slice_steps import Chains, slice_step
from vrdp_prob.models.coordinates import Coordinate, Coordinates
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import Prior, Transform
from vrdp_prob.models.physics import PhysicsModel

SEEN = np.array([0.9, 1.6, 1.2, 0.7, 1.4])
"""One number per toy video."""
SD = 0.3
WIGGLE = 0.8


@dataclass(frozen=True)
class Toy(LinkedVideo):
    """A video that sees `shared + exp(WIGGLE own)` with noise; the own number is standard normal before."""

    seen: float = 0.0

    @property
    def data(self) -> Any:
        return SimpleNamespace(residuals=self._residuals)

    def _residuals(self, points: np.ndarray) -> np.ndarray:
        shared, own = points[:, 0], points[:, 1]
        return np.stack([(shared + np.exp(WIGGLE * own) - self.seen) / SD, own], axis=1)

    def log_density(self, shared: np.ndarray, local: np.ndarray) -> np.ndarray:
        values: np.ndarray = -(self._residuals(self.points(shared, local)) ** 2).sum(axis=1) / 2
        return values


def toy_fit(seen: np.ndarray) -> JointFit:
    """The toy videos around a rough guess of their mode."""
    numbers = SharedNumbers((("shared", ()),), (Coordinate("shared", None, Transform.IDENTITY, Prior(0.0, 1.0)),), None)
    own = Coordinate("own", 0, Transform.IDENTITY, Prior(0.0, 1.0))
    coordinates = Coordinates((numbers.entries[0], own), {})
    likelihood = Likelihood(sliding(0), PhysicsModel.base(), coordinates)
    one = np.zeros(1, dtype=np.int64)
    videos = tuple(Toy(likelihood, one, one, np.zeros(1), seen=float(value)) for value in seen)
    shared = np.zeros(1)
    locals_, expansions = [], []
    for value in seen:
        local = np.array([np.log(max(value, 0.3)) / WIGGLE])
        slope = WIGGLE * np.exp(WIGGLE * local[0]) / SD
        expansion = Expansion(np.zeros(1), np.zeros(1), np.array([[1 / SD], [0.0]]), np.array([[slope], [1.0]]))
        locals_.append(local)
        expansions.append(expansion)
    prior = SharedExpansion(np.zeros(1), np.eye(1))
    gaussian = Expansions(prior, tuple(expansions)).gaussian(shared, locals_, numbers.logarithms)
    return JointFit(numbers, videos, gaussian, 0.0, converged=True)


def by_quadrature(seen: np.ndarray) -> tuple[float, float, float, float]:
    """Mean and sd of the shared number, mean of the first video's own, and the log evidence."""
    shared, own = np.linspace(-4, 4, 1601)[:, None], np.linspace(-6, 6, 2401)[None]
    log_own = -(own**2) / 2 - np.log(2 * np.pi) / 2 + np.log(own[0, 1] - own[0, 0])
    log_each = [log_own - ((shared + np.exp(WIGGLE * own) - value) / SD) ** 2 / 2 for value in seen]
    log_shared = -(shared[:, 0] ** 2) / 2 - np.log(2 * np.pi) / 2 + np.log(shared[1, 0] - shared[0, 0])
    log_joint = log_shared + sum(logsumexp(one, axis=1) for one in log_each)
    weights = np.exp(log_joint - logsumexp(log_joint))
    mean = float(weights @ shared[:, 0])
    sd = float(np.sqrt(weights @ (shared[:, 0] - mean) ** 2))
    conditional = np.exp(log_each[0] - logsumexp(log_each[0], axis=1, keepdims=True)) @ own[0]
    return mean, sd, float(weights @ conditional), float(logsumexp(log_joint))


def test_parts_of_a_newton_step_make_it_up() -> None:
    generator = np.random.default_rng(1)
    rows, gradient = generator.standard_normal((9, 6)), generator.standard_normal(4)
    # The last number is known a million times worse than the others.
    rows[:, 5] *= 1e-6
    expansion = Expansion(np.zeros(2), gradient, rows[:, :2], rows[:, 2:])
    parts = expansion.separate_steps
    assert parts.sum(axis=0) == pytest.approx(expansion.local_step, rel=1e-6)
    curvature = rows[:, 2:].T @ rows[:, 2:]
    promised = -(parts @ gradient) - np.einsum("ki,ij,kj->k", parts, curvature, parts) / 2
    assert promised.sum() == pytest.approx(expansion.promised, rel=1e-6)
    assert (promised >= 0).all()


def test_an_arrow_is_the_whole_matrix() -> None:
    generator = np.random.default_rng(0)
    shared, owns = 3, (2, 4, 1)
    whole = np.zeros((shared + sum(owns), shared + sum(owns)))
    gradient = np.zeros(len(whole))
    expansions, begin = [], shared
    for own in owns:
        rows = generator.standard_normal((shared + own + 3, shared + own))
        slope = generator.standard_normal(shared + own)
        places = np.r_[:shared, begin : begin + own]
        whole[np.ix_(places, places)] += rows.T @ rows
        gradient[places] += slope
        expansions.append(Expansion(slope[:shared], slope[shared:], rows[:, :shared], rows[:, shared:]))
        begin += own
    prior = SharedExpansion(generator.standard_normal(shared), np.eye(shared))
    whole[:shared, :shared] += np.eye(shared)
    gradient[:shared] += prior.gradient
    arrow = Expansions(prior, tuple(expansions))
    step = -np.linalg.solve(whole, gradient)
    assert arrow.shared_step == pytest.approx(step[:shared], rel=1e-6)
    own_step = expansions[1].local_step + expansions[1].slope @ arrow.shared_step
    assert own_step == pytest.approx(step[shared + 2 : shared + 6], rel=1e-6)
    assert arrow.expected_gain == pytest.approx(-gradient @ step / 2, rel=1e-6)
    rest = np.delete(np.arange(len(whole)), 1)
    held = -np.linalg.solve(whole[np.ix_(rest, rest)], gradient[rest])
    along, promised = arrow.step_without(1)
    assert along == pytest.approx([held[0], 0.0, held[1]], rel=1e-6)
    own_alone = sum(one.promised for one in expansions)
    assert promised + own_alone == pytest.approx(-gradient[rest] @ held / 2, rel=1e-6)
    gaussian: ArrowGaussian = arrow.gaussian(
        np.zeros(shared), [np.zeros(own) for own in owns], np.zeros(shared, dtype=bool)
    )
    covariance = np.linalg.inv(whole)
    assert gaussian.root @ gaussian.root.T == pytest.approx(covariance[:shared, :shared], rel=1e-6)
    assert gaussian.log_volume == pytest.approx(-np.linalg.slogdet(whole)[1] / 2)


def test_an_arrow_holds_where_some_own_numbers_are_known_a_million_times_better() -> None:
    """As after several collisions in a row, where a Schur complement of curvatures is rounding error: -380 for 8."""
    generator = np.random.default_rng(3)
    count, own, shared = 200, 12, 2
    bases = np.linalg.qr(generator.standard_normal((count, own + shared)))[0]
    turn = np.linalg.qr(generator.standard_normal((own, own)))[0]
    stiff = bases[:, :own] * np.geomspace(1.0, 1e7, own) @ turn
    follows = generator.standard_normal((own, shared))
    # what the own numbers cannot take over of the shared ones is known: the rest of the bases
    soft = stiff @ follows + bases[:, own:] * np.array([3.0, 0.5])
    expansion = Expansion(np.ones(shared), np.zeros(own), soft, stiff)
    prior = SharedExpansion(np.zeros(shared), np.eye(shared))
    gaussian = Expansions(prior, (expansion,)).gaussian(np.zeros(shared), [np.zeros(own)], np.zeros(shared, dtype=bool))
    assert expansion.slope == pytest.approx(-follows, rel=1e-6)
    assert gaussian.root @ gaussian.root.T == pytest.approx(np.diag([1 / 10, 1 / 1.25]), rel=1e-6, abs=1e-8)
    assert gaussian.locals[0].log_volume == pytest.approx(-np.log(np.geomspace(1.0, 1e7, own)).sum())


@pytest.mark.parametrize("count", [1, pytest.param(5, marks=pytest.mark.slow)])
def test_chains_have_the_marginal_of_the_product_of_all_videos(count: int) -> None:
    mean, sd, own, _ = by_quadrature(SEEN[:count])
    draws = sample_gibbs(toy_fit(SEEN[:count]), generator=np.random.default_rng(1), rounds=3)
    shared = draws.shared[..., 0]
    ess = chain_statistics(draws.shared).ess_bulk
    assert ess > 400
    assert abs(shared.mean() - mean) < 4 * sd / np.sqrt(ess)
    assert shared.std() == pytest.approx(sd, rel=4 / np.sqrt(ess))
    ess = chain_statistics(draws.locals[0]).ess_bulk
    assert abs(draws.locals[0].mean() - own) < 4 * draws.locals[0].std() / np.sqrt(ess)
    assert draws.drift < 1.03


def test_weighted_draws_have_it_too() -> None:
    count = 5
    mean, sd, own, log_evidence = by_quadrature(SEEN[:count])
    draws = sample_by_importance(toy_fit(SEEN[:count]), draws=2000, generator=np.random.default_rng(1))
    assert draws.effective > 200
    assert draws.log_evidence == pytest.approx(log_evidence, abs=0.1)
    error = sd / np.sqrt(min(draws.effective, 2000))
    assert abs(draws.shared.mean() - mean) < 4 * error
    assert abs(draws.locals[0].mean() - own) < 4 * draws.locals[0].std() / np.sqrt(draws.effective)


def test_slice_steps_leave_a_density_with_an_edge_as_it_is() -> None:
    # an exponential in the first coordinate, a normal in the second
    generator = np.random.default_rng(3)
    places = np.stack([generator.exponential(size=400), generator.standard_normal(400)], axis=1)

    def log_density(_chosen: np.ndarray, points: np.ndarray) -> np.ndarray:
        return np.where(points[:, 0] > 0, -points[:, 0] - points[:, 1] ** 2 / 2, -np.inf)

    chains = Chains(places, log_density(np.arange(400), places))
    kept = []
    for _ in range(50):
        slice_step(chains, log_density, generator)
        assert chains.log_density == pytest.approx(log_density(np.arange(400), chains.places))
        kept.append(chains.places.copy())
    later = np.concatenate(kept[10:])
    assert later.mean(axis=0) == pytest.approx([1.0, 0.0], abs=0.05)
    assert later.std(axis=0) == pytest.approx([1.0, 1.0], abs=0.05)


def test_two_modes_of_a_video_are_visited_by_their_weight() -> None:
    """The own number enters as a square, so that either sign will do; the prior tells them apart a little."""
    seen, lean = np.array([2.0, 2.5]), 0.25
    fit = square_fit(seen, lean)
    shared, own = np.linspace(-4, 4, 801)[:, None], np.linspace(-6, 6, 2401)[None]
    log_each = [-((own - lean) ** 2) / 2 - ((shared + own**2 - value) / SD) ** 2 / 2 for value in seen]
    log_shared = -(shared[:, 0] ** 2) / 2 + sum(logsumexp(one, axis=1) for one in log_each)
    weights = np.exp(log_shared - logsumexp(log_shared))
    inner = np.exp(log_each[0] - logsumexp(log_each[0], axis=1, keepdims=True))
    positive = float(weights @ inner[:, own[0] > 0].sum(axis=1))
    mean = float(weights @ shared[:, 0])
    assert 0.55 < positive < 0.85
    draws = sample_gibbs(fit, generator=np.random.default_rng(2), rounds=2)
    assert draws.locals[0].shape[1] > 500
    sides = (draws.locals[0] > 0).astype(float)
    assert len(draws.modes[0]) == 2
    assert sum(mode.weight for mode in draws.modes[0]) == pytest.approx(1.0)
    heavier = max(draws.modes[0], key=lambda mode: mode.weight)
    assert heavier.weight == pytest.approx(positive, abs=4 * heavier.error)
    assert sides.mean() == pytest.approx(positive, abs=4 * 0.5 / np.sqrt(chain_statistics(sides).ess_bulk))
    assert draws.shared.mean() == pytest.approx(mean, abs=4 * draws.shared.std() / np.sqrt(400))
    weighted = sample_by_importance(fit, draws=2000, generator=np.random.default_rng(2))
    assert (weighted.locals[0] > 0).mean() == pytest.approx(positive, abs=2 / np.sqrt(weighted.effective))


@dataclass(frozen=True)
class Square(Toy):
    """A video that sees `shared + own^2`; the own number is expected at `lean`."""

    lean: float = 0.0

    def _residuals(self, points: np.ndarray) -> np.ndarray:
        shared, own = points[:, 0], points[:, 1]
        return np.stack([(shared + own**2 - self.seen) / SD, own - self.lean], axis=1)


def square_fit(seen: np.ndarray, lean: float) -> JointFit:
    fit = toy_fit(seen)
    videos = tuple(
        Square(one.likelihood, one.shared_columns, one.shared_places, one.offset, seen=float(value), lean=lean)
        for one, value in zip(fit.videos, seen, strict=True)
    )
    expansions = {sign: [square_expansion(sign * np.sqrt(value)) for value in seen] for sign in (1, -1)}
    prior, none = SharedExpansion(np.zeros(1), np.eye(1)), np.zeros(1, dtype=bool)
    centres = [np.array([np.sqrt(value)]) for value in seen]
    gaussian = Expansions(prior, tuple(expansions[1])).gaussian(np.zeros(1), centres, none)
    modes = tuple(
        (
            LocalMode(expansions[1][k].around(centre, none), 0.0),
            LocalMode(expansions[-1][k].around(-centre, none), -0.5),
        )
        for k, centre in enumerate(centres)
    )
    return JointFit(fit.numbers, videos, gaussian, 0.0, converged=True, alternatives=modes)


def square_expansion(own: float) -> Expansion:
    slope = 2 * own / SD
    return Expansion(np.zeros(1), np.zeros(1), np.array([[1 / SD], [0.0]]), np.array([[slope], [1.0]]))
