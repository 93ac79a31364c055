"""What a model leaves unexplained makes the data say less, and noise does not."""

from dataclasses import replace

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from vrdp_prob.discovery.residuals.overdispersion import overdispersion
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.inference.several_videos.population import with_learned_population


@pytest.fixture(scope="module")
def null() -> ResidualModel:
    _, fit = fitted(seed=1)
    return ResidualModel.of(fit.under(with_learned_population(fit), model_error=False))


def _with(model: ResidualModel, extra: list[np.ndarray]) -> ResidualModel:
    """The model with more in its residuals."""
    linear = tuple(
        replace(one, residuals=one.residuals + more) for one, more in zip(model.linear.videos, extra, strict=True)
    )
    return replace(model, linear=replace(model.linear, videos=linear))


def _noise(model: ResidualModel, factor: float, generator: np.random.Generator) -> list[np.ndarray]:
    return [factor * generator.standard_normal(len(one.residuals)) for one in model.linear.videos]


def test_noise_is_not_divided_out(null: ResidualModel) -> None:
    assert overdispersion(null, seed=0).max() < 1.5


def test_residuals_that_are_larger_count_by_their_square(null: ResidualModel) -> None:
    found = overdispersion(_with(null, _noise(null, 3.0, np.random.default_rng(1))), seed=0)
    # variance 1 + 9, less what the 95 % quantile of the replications allows for
    assert (found > 6.0).all()
    assert (found < 16.0).all()


def test_residuals_that_remember_count_more_than_scattered_ones_of_the_same_size(null: ResidualModel) -> None:
    generator = np.random.default_rng(2)
    scattered = _noise(null, 1.5, generator)
    waves = []
    for video, one in zip(null.videos, scattered, strict=True):
        wave, bodies = np.zeros_like(one), video.likelihood.observations.body
        for body in np.unique(bodies):
            places = np.flatnonzero(bodies == body)
            for axis in (0, 1):
                wave[2 * places + axis] = 1.5 * np.sqrt(2) * np.sin(np.arange(len(places)) / 2.0 + axis)
        waves.append(wave)
    assert (overdispersion(_with(null, waves), seed=0) > overdispersion(_with(null, scattered), seed=0)).all()


def test_the_same_seed_gives_the_same_factors(null: ResidualModel) -> None:
    assert np.array_equal(overdispersion(null, seed=3), overdispersion(null, seed=3))
