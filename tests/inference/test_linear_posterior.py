"""The posterior to first order around the truth, with which the inference is compared."""

from collections.abc import Iterator
from itertools import count, islice

import numpy as np
import pytest
from scipy.stats import chi2, norm

from tests.inference.linear_posterior import linear_errors
from tests.inference.prior_scenes import PriorScene, prior_scene

SCENES, MANY, FIRST = 40, 300, 20_000
FALSE_ALARM = 1e-3


@pytest.mark.slow
def test_its_errors_are_standard_normal_over_scenes() -> None:
    chosen = [_one_of(scene, "position", "velocity") for scene in _scenes(SCENES)]
    low, high = chi2.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], SCENES)
    assert low < np.square(chosen).sum() < high
    ratios = [_one_of(scene, "mass") for scene in _scenes(SCENES) if len(scene.pairs)]
    low, high = chi2.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], len(ratios))
    assert len(ratios) > SCENES / 2
    assert low < np.square(ratios).sum() < high


@pytest.mark.slow
def test_its_squared_errors_are_one_over_many_scenes() -> None:
    scenes = list(_scenes(MANY))
    for kind in ("position", "velocity", "mass", "log likelihood"):
        squares = np.square([_one_of(scene, kind) for scene in scenes])
        error = squares.std() / np.sqrt(MANY)
        assert abs(squares.mean() - 1) < norm.ppf(1 - FALSE_ALARM / 2) * error, kind


def _scenes(number: int) -> Iterator[PriorScene]:
    return islice((one for seed in count(FIRST) if (one := prior_scene(seed)) is not None), number)


def _one_of(scene: PriorScene, *kinds: str) -> float:
    errors = [error for name, error in linear_errors(scene).items() if name.startswith(kinds)]
    return errors[scene.seed % len(errors)] if errors else 0.0


def test_a_body_that_nothing_meets_and_that_rests_is_as_far_off_as_the_mean_of_its_measurements() -> None:
    scene = next(one for seed in count() if (one := prior_scene(seed)) is not None and _untouched(one))
    body = _untouched(scene)[0]
    seen = scene.tracks.seen[:, body]
    noise = (scene.tracks.positions - scene.exact)[seen, body, 0] / scene.noise
    assert np.isclose(linear_errors(scene)[f"position x {body}"], noise.mean() * np.sqrt(seen.sum()), atol=1e-3)


def _untouched(scene: PriorScene) -> list[int]:
    met = {int(body) for pair in scene.pairs for body in pair}
    return [body for body, v in enumerate(scene.scene.velocity) if not v.any() and body not in met]
