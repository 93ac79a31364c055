from pathlib import Path

import numpy as np
import pytest

from tests.inference.generator import Scene, observe, random_scene
from vrdp_prob.datasets import load_all
from vrdp_prob.inference import infer
from vrdp_prob.inference.draws.samples import ESS_GOAL

SCENES = 12


def scene_of(seed: int) -> Scene:
    return random_scene(np.random.default_rng(100 + seed), bodies=3 + seed % 2, squares=False)


@pytest.mark.slow
def test_intervals_cover_the_truth_about_as_often_as_they_say() -> None:
    covered = []
    for seed in range(SCENES):
        scene = scene_of(seed)
        posterior = infer(observe(scene, noise=0.01, dropout=0.03, seed=seed), sampler="laplace", draws=400, seed=seed)
        for pair in posterior.mass_ratios():
            first, second = (int(name) for name in pair.objects)
            ratio = scene.mass[first] / scene.mass[second]
            covered.append(pair.summary.q05 <= ratio <= pair.summary.q95)
    share, count = float(np.mean(covered)), len(covered)
    assert count >= SCENES
    assert abs(share - 0.9) < 3 * np.sqrt(0.9 * 0.1 / count) + 0.02, f"{share:.2f} of {count} intervals of 90 %"


@pytest.mark.slow
def test_samplers_agree_on_one_scene_within_their_errors() -> None:
    tracks = observe(scene_of(0), noise=0.01, seed=0)
    posteriors = {name: infer(tracks, sampler=name, draws=1000) for name in ("emcee", "laplace", "nuts")}
    reference = posteriors["emcee"]
    for name, posterior in posteriors.items():
        effective = min(posterior.convergence.ess_bulk or 0.0, 1000.0)
        assert effective > ESS_GOAL / 4, f"{name}: {posterior.convergence.sentence}"
        for pair, other in zip(reference.mass_ratios(), posterior.mass_ratios(), strict=True):
            error = pair.summary.sd * np.sqrt(1 / effective + 1 / 400)
            assert other.summary.mean == pytest.approx(pair.summary.mean, abs=4 * error)


@pytest.mark.slow
def test_annotated_collisions_of_a_practice_scene_are_found(shared_data: Path) -> None:
    tracks = next(one for one in load_all(shared_data / "clevrer_bullet") if one.video == "video_00000")
    posterior = infer(tracks, sampler="laplace", draws=50)
    assert {frozenset(pair) for pair in posterior.pairs} == {frozenset("23"), frozenset("12")}
