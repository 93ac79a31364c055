"""Frames that are late by chance: the density of what is seen, against the dense Gaussian that it stands for."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
import torch
from scipy.stats import multivariate_normal

from vrdp_prob.errors import InputError
from vrdp_prob.inference import infer
from vrdp_prob.inference.predictive import drawn_lateness, replicated, replicated_angles
from vrdp_prob.inference.search.noise_fit import best_noise
from vrdp_prob.inference.several_videos import fit_together
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.irregular_frames import IrregularFrames
from vrdp_prob.models.lateness import Lateness
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.parameters import ANGULAR_DRAG, FRAME_JITTER
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import ANGLE_NOISE, NOISE, Structure, unknowns
from vrdp_prob.scene import Body, Shape, Tracks

FRAME, COUNT = 0.04, 30
VELOCITY = np.array([[0.8, 0.3], [-0.5, 0.4], [0.0, 0.0]])
STARTS = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]])
SPIN = np.array([2.0, 0.0, 0.0])
SD, JITTER = 0.004, 0.006


def tracks(late: np.ndarray | None = None, *, seed: int = 0, sd: float = SD) -> Tracks:
    """Two discs in steady motion, the first of which turns, and one at rest; frames late by some seconds."""
    generator = np.random.default_rng(seed)
    stamps = FRAME * np.arange(COUNT)
    true = stamps if late is None else stamps + late
    places = STARTS + true[:, None, None] * VELOCITY + sd * generator.standard_normal((COUNT, 3, 2))
    places[5, 0] = places[9, 1] = np.nan
    angles = np.where([True, False, False], true[:, None] * SPIN + 0.02 * generator.standard_normal((COUNT, 3)), np.nan)
    bodies = tuple(Body(str(k), Shape.CYLINDER, 0.1) for k in range(3))
    return Tracks.from_arrays("one", bodies, stamps, places, angles=angles)


def likelihood_of(seen: Tracks, *effects: Effect, noise: NoiseFamily = NoiseFamily.GAUSSIAN) -> Likelihood:
    model = PhysicsModel("irregular", (*PhysicsModel.base().effects, *effects))
    coordinates = unknowns(seen, model, Structure(frozenset({0, 1}), frozenset()), noise)
    return Likelihood(seen, model, coordinates, noise)


def point_of(likelihood: Likelihood, **values: float) -> torch.Tensor:
    """The true world: steady motion without friction, with noise of the true size."""
    known = {
        "sliding_friction": -30.0,
        "air_drag": -30.0,
        ANGULAR_DRAG.name: -30.0,
        NOISE: np.log(SD / likelihood.observations.position_reference),
        ANGLE_NOISE: np.log(0.02 / likelihood.observations.angle_reference),
        FRAME_JITTER.name: np.log(JITTER),
        **values,
    }
    point = likelihood.coordinates.prior_mean.copy()
    for (field, owner), place in likelihood.coordinates.places.items():
        if field in known:
            point[place] = known[field]
        if field in ("x", "y"):
            point[place] = STARTS[owner, int(field == "y")]
        if field in ("velocity_x", "velocity_y"):
            point[place] = VELOCITY[owner, int(field == "velocity_y")]
        if field == "spin":
            point[place] = SPIN[owner]
        if field == "angle_zero":
            point[place] = 0.0
    return torch.tensor(point)[None]


@pytest.fixture(scope="module")
def seen() -> Tracks:
    return tracks(JITTER * np.random.default_rng(1).standard_normal(COUNT))


def dense_log_likelihood(likelihood: Likelihood, point: torch.Tensor, jitter: float) -> float:
    """Log density of all that was seen, with the covariance written out."""
    found = likelihood.observations
    predicted = likelihood.predicted(point)[0]
    offsets = np.concatenate(
        [
            (found.position - predicted[found.frame, found.body, :2]).ravel(),
            found.angle - predicted[found.angle_frame, found.angle_body, 2],
        ]
    )
    rates = np.concatenate([VELOCITY[found.body].ravel(), SPIN[found.angle_body]])
    frames = np.concatenate([np.repeat(found.frame, 2), found.angle_frame])
    sd = np.concatenate([np.full(2 * len(found.frame), SD), np.full(len(found.angle), 0.02)])
    together = jitter**2 * np.outer(rates, rates) * (frames[:, None] == frames)
    return float(multivariate_normal(cov=np.diag(sd**2) + together).logpdf(offsets))


def test_the_likelihood_is_that_of_the_dense_gaussian(seen: Tracks) -> None:
    likelihood = likelihood_of(seen, IrregularFrames())
    for jitter in (1e-6, JITTER, 0.02):
        point = point_of(likelihood, **{FRAME_JITTER.name: np.log(jitter)})
        positions, angles = likelihood.pointwise(point)
        dense = dense_log_likelihood(likelihood, point, jitter)
        assert positions.sum() + angles.sum() == pytest.approx(dense, abs=1e-6)
    first, second = (point_of(likelihood, **{FRAME_JITTER.name: np.log(one)}) for one in (JITTER, 0.02))
    prior = likelihood.coordinates.log_prior(torch.cat([first, second])).sum(dim=1)
    density = likelihood.log_density(torch.cat([first, second])) - prior
    expected = dense_log_likelihood(likelihood, first, JITTER) - dense_log_likelihood(likelihood, second, 0.02)
    assert float(density[0] - density[1]) == pytest.approx(expected, abs=1e-6)


def test_without_jitter_it_is_the_model_on_time(seen: Tracks) -> None:
    irregular, on_time = likelihood_of(seen, IrregularFrames()), likelihood_of(seen)
    point = point_of(irregular, **{FRAME_JITTER.name: -40.0})
    assert np.allclose(
        irregular.residuals(point.numpy())[0, : 5 * COUNT], on_time.residuals(point_of(on_time).numpy())[0, : 5 * COUNT]
    )


@pytest.mark.parametrize("noise", list(NoiseFamily))
def test_derivatives(seen: Tracks, noise: NoiseFamily) -> None:
    likelihood = likelihood_of(seen, IrregularFrames(), noise=noise)
    point = point_of(likelihood).requires_grad_()
    likelihood.log_density(point).sum().backward()
    assert point.grad is not None
    for name, owner in ((FRAME_JITTER.name, None), ("velocity_x", 0), ("spin", 0), (NOISE, None)):
        place = likelihood.coordinates.places[name, owner]
        step = torch.zeros_like(point)
        step[0, place] = 1e-6
        with torch.no_grad():
            ends = [likelihood.log_density(point + sign * step).item() for sign in (1, -1)]
        assert point.grad[0, place].item() == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-4, abs=1e-3)


def test_the_jitter_is_found_beside_the_noise(seen: Tracks) -> None:
    likelihood = likelihood_of(seen, IrregularFrames())
    found = best_noise(likelihood, point_of(likelihood, **{FRAME_JITTER.name: np.log(0.001)})[0].numpy())
    quantities = likelihood.coordinates.quantities(torch.from_numpy(found[None]))
    # 30 frames tell a standard deviation to 13 %
    assert float(quantities[FRAME_JITTER.name][0, 0]) == pytest.approx(JITTER, rel=0.4)
    assert float(quantities[NOISE][0, 0]) * likelihood.observations.position_reference == pytest.approx(SD, rel=0.25)


def test_the_lateness_of_each_frame_is_found() -> None:
    late = JITTER * np.random.default_rng(2).standard_normal(COUNT)
    likelihood = likelihood_of(tracks(late, sd=1e-5), IrregularFrames())
    point = point_of(likelihood, **{NOISE: np.log(1e-5 / likelihood.observations.position_reference)})
    assert np.allclose(likelihood.late(point)[0], late, atol=1e-4)
    off = likelihood.tracks.positions - likelihood.fitted(point)[0, :, :, :2]
    assert np.nanmax(np.abs(off)) < 2e-4
    assert np.nanmax(np.abs(likelihood.tracks.positions - likelihood.predicted(point)[0, :, :, :2])) > 5e-3


def test_the_first_frames_alone_have_their_own_residuals(seen: Tracks) -> None:
    likelihood = likelihood_of(seen, IrregularFrames())
    point = point_of(likelihood).numpy()
    early, all_ = likelihood.residuals(point, 10)[0], likelihood.residuals(point)[0]
    numbers = 2 * int((likelihood.observations.frame < 10).sum())
    assert np.allclose(early[:numbers], all_[:numbers])


def test_measurements_drawn_anew_scatter_along_the_paths(seen: Tracks) -> None:
    likelihood = likelihood_of(seen, IrregularFrames())
    point = point_of(likelihood, **{NOISE: np.log(1e-6 / likelihood.observations.position_reference)})
    points, generator = point.expand(2000, -1), np.random.default_rng(0)
    late = drawn_lateness(likelihood, points, generator)
    drawn = replicated(likelihood, points, generator, late)
    off = drawn - likelihood.predicted(point)[..., :2]
    assert np.std(off[:, 7, 0, 0]) == pytest.approx(JITTER * VELOCITY[0, 0], rel=0.1)
    assert np.allclose(off[:, 7, 0, 0] / VELOCITY[0, 0], off[:, 7, 1, 1] / VELOCITY[1, 1], atol=1e-4)
    assert np.abs(off[:, :, 2]).max() < 1e-4
    turned = replicated_angles(likelihood, points, generator, late) - likelihood.predicted(point)[..., 2]
    along = off[:, 7, 0, 0] / VELOCITY[0, 0] * SPIN[0]  # one frame is late for places and angles alike
    assert np.corrcoef(turned[:, 7, 0], along)[0, 1] > 0.4
    assert drawn_lateness(likelihood_of(seen), points[:, :-1], generator) is None


def test_the_parameter_of_irregular_frames_is_the_one_that_is_found_with_the_noise() -> None:
    class Shaky(Effect):
        """Frames come irregularly, by a parameter of another name."""

        name: ClassVar = "shaky"
        parameters: ClassVar = (replace(FRAME_JITTER, name="camera_jitter"),)

        def frame_jitter(self, parameters: Mapping[str, torch.Tensor]) -> torch.Tensor:
            return parameters["camera_jitter"]

    with pytest.raises(InputError, match=r"effect 'shaky': .*'frame_jitter' must be its one parameter"):
        PhysicsModel.base().with_effect(Shaky())


def test_a_posterior_holds_the_jitter_and_its_model_can_be_written(seen: Tracks, tmp_path: Path) -> None:
    model = PhysicsModel.base().with_effect(IrregularFrames(), [seen])
    posterior = infer(seen, model=model, sampler="laplace", draws=200, seed=0)
    low, high = np.quantile(posterior.data["posterior"]["frame_jitter"], [0.005, 0.995])
    assert low < JITTER < high < 3 * JITTER
    model.write(tmp_path / "model.toml")
    assert PhysicsModel.read(tmp_path / "model.toml").text == model.text


@pytest.mark.parametrize("shared", [None, ["sliding_friction", "air_drag"]])
def test_several_videos_have_one_jitter_or_each_its_own(seen: Tracks, shared: list[str] | None) -> None:
    other = replace(tracks(JITTER * np.random.default_rng(3).standard_normal(COUNT), seed=3), video="two")
    model = PhysicsModel.base().with_effect(IrregularFrames(), [seen, other])
    fit = fit_together([seen, other], model=model, shared=shared, model_error=False)
    found = fit.value("frame_jitter")
    if shared is None:
        assert found == pytest.approx(JITTER, rel=0.4)
    else:
        assert found is None
        for index, video in enumerate(fit.joint.videos):
            quantities = video.likelihood.coordinates.quantities(torch.from_numpy(fit.joint.point(index)[None]))
            assert float(quantities["frame_jitter"][0, 0]) == pytest.approx(JITTER, rel=0.5)


def test_a_frame_in_which_nothing_moves_tells_nothing() -> None:
    frame = torch.tensor([0, 0, 1, 1])
    rates = torch.tensor([[0.0, 0.0, 3.0, 4.0]], dtype=torch.float64)
    lateness = Lateness(frame, rates, torch.tensor([2.0], dtype=torch.float64), 3)
    residuals = torch.tensor([[1.0, -1.0, 3.0, 4.0]], dtype=torch.float64)
    assert lateness.variance.tolist() == [[0.0, 100.0, 0.0]]
    found = lateness.independent(residuals)
    assert found[0, :2].tolist() == [1.0, -1.0]
    assert found[0, 2:].norm().item() == pytest.approx(5 / np.sqrt(101))
    assert lateness.expected(residuals)[0].tolist() == pytest.approx([0.0, -100 / 101, 0.0])


def test_a_tenth_of_the_time_between_frames_is_expected(seen: Tracks) -> None:
    expected = IrregularFrames().expected([seen])[FRAME_JITTER.name]
    assert expected.default == pytest.approx(FRAME / 10)
    assert np.exp(expected.prior.mean) == pytest.approx(FRAME / 10)
