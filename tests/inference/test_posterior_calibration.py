"""Whether what is true of scenes from the prior lies anywhere in their posteriors, as often as it should.

`benchmarks/calibration.py` does the same for all samplers and more scenes.
"""

from collections.abc import Iterable
from itertools import count, islice

import numpy as np
import pytest

from tests.inference.prior_scenes import PriorScene, prior_scene
from tests.inference.rank_statistics import shares, simultaneous_band, uniformity
from tests.inference.scene_ranks import KINDS, LEVELS, Rank, ranks
from vrdp_prob.errors import InputError
from vrdp_prob.inference import infer

FALSE_ALARMS = 0.01
"""Probability with which a calibrated sampler fails one of the tests below, over all kinds of quantities together."""
SEEDS = (128, 386, 871, 1140, 1270, 1297, 1493, 1572, 1665, 1704, 1733, 2000)
"""Scenes that are kept by their data: two or three discs and spheres, some of which collide."""
FEWEST = 6


def uniform_in_every_kind(found: Iterable[list[Rank]]) -> dict[str, float]:
    """Probability of the ranks of each kind, one per scene, times the number of kinds."""
    scenes, generator = list(found), np.random.default_rng(0)
    chosen: dict[str, list[int]] = {}
    for scene in scenes:
        for kind in KINDS:
            candidates = [rank.rank for rank in scene if rank.kind == kind]
            if candidates:
                chosen.setdefault(kind, []).append(int(generator.choice(candidates)))
    tested = {kind: np.array(values) for kind, values in chosen.items() if len(values) >= FEWEST}
    return {kind: len(tested) * uniformity(values, LEVELS) for kind, values in tested.items()}


def test_uniform_ranks_leave_the_band_as_often_as_it_says() -> None:
    generator = np.random.default_rng(1)
    sets = generator.integers(0, LEVELS + 1, size=(2000, 80))
    band = simultaneous_band(80, LEVELS)
    left = np.mean([not band.holds(one) for one in sets])
    assert left == pytest.approx(0.05, abs=0.02)
    small = np.mean([uniformity(one, LEVELS) <= 0.1 for one in sets])
    assert small == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize(("sd", "shift"), [(1.6, 0.0), (0.6, 0.0), (1.0, 0.5)])
def test_intervals_that_are_too_narrow_too_wide_or_biased_are_seen(sd: float, shift: float) -> None:
    generator = np.random.default_rng(2)
    truths, draws = shift + sd * generator.standard_normal(100), generator.standard_normal((100, LEVELS))
    found = (draws < truths[:, None]).sum(axis=1)
    assert uniformity(found, LEVELS) < 0.001
    assert not simultaneous_band(100, LEVELS).holds(found)
    assert shares(found, LEVELS)[-1] <= 1


def test_scenes_are_kept_by_their_data_and_their_seed_says_everything() -> None:
    kept = [scene for scene in map(prior_scene, range(60)) if scene is not None]
    assert kept
    again = prior_scene(kept[0].seed)
    assert again is not None
    np.testing.assert_array_equal(again.tracks.positions, kept[0].tracks.positions)
    scene = kept[0]
    scatter = (scene.tracks.positions - scene.exact)[scene.tracks.seen].std()
    assert scatter == pytest.approx(scene.noise, rel=0.15)
    assert set(scene.shared) == {"sliding_friction", "rolling_resistance", "air_drag", "angular_drag"}


def test_ranks_are_those_of_the_draws() -> None:
    scene = prior_scene(SEEDS[0])
    assert scene is not None
    posterior = infer(scene.tracks, sampler="laplace", draws=200, hand_on=False)
    found = {rank.name: rank for rank in ranks(scene, posterior)}
    noise = posterior.data["posterior"]["noise_scale"]
    below = float((noise.values * noise.attrs["reference_m"] < scene.noise).mean())
    assert found["noise"].below == pytest.approx(below)
    (pair,) = posterior.pairs
    mass = posterior.data["posterior"]["mass"]
    ratio = scene.scene.mass[int(pair[0])] / scene.scene.mass[int(pair[1])]
    below = float((mass.sel(body=pair[0]) / mass.sel(body=pair[1]) < ratio).mean())
    assert found[f"mass {pair[0]}/{pair[1]}"].below == pytest.approx(below)
    resting = np.flatnonzero((scene.scene.velocity == 0).all(axis=1))
    assert all(f"velocity x {body}" not in found for body in resting)


def test_ranks_over_a_few_scenes_are_uniform() -> None:
    scenes = [scene for scene in map(prior_scene, SEEDS) if scene is not None]
    assert len(scenes) == len(SEEDS)
    probabilities = uniform_in_every_kind(ranks_of(scenes))
    assert set(probabilities) >= {"log mass ratio", "pair restitution", "velocity", "air drag", "noise"}
    assert min(probabilities.values()) > FALSE_ALARMS, probabilities


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_ranks_over_many_scenes_are_uniform() -> None:
    scenes = islice((scene for scene in map(prior_scene, count()) if scene is not None), 200)
    probabilities = uniform_in_every_kind(ranks_of(scenes, only_converged=True))
    assert min(probabilities.values()) > FALSE_ALARMS, probabilities


def ranks_of(scenes: Iterable[PriorScene], *, only_converged: bool = False) -> Iterable[list[Rank]]:
    for scene in scenes:
        try:
            posterior = infer(scene.tracks, sampler="laplace", draws=1000, seed=scene.seed, hand_on=False)
        except InputError:  # nothing moves
            continue
        if posterior.convergence.converged or not only_converged:
            yield ranks(scene, posterior)
