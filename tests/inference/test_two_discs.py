"""The samplers on a whole video, the smallest that tells something: a disc hits another one."""

import os
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from tests.inference.generator import Scene, observe
from vrdp_prob.inference import Posterior, default_model, fit_map, infer
from vrdp_prob.inference.draws.diagnostics import Reported
from vrdp_prob.inference.infer import sampled
from vrdp_prob.scene import Shape, Tracks

ROOT = Path(__file__).parents[2]
MASS_RATIO = 1.5 / 0.8
PATIENCE = 120.0
"""Seconds."""


@cache
def tracks() -> Tracks:
    scene = Scene(
        (Shape.CYLINDER, Shape.CYLINDER),
        np.array([[-1.0, 0.0], [0.0, 0.05]]),
        np.array([[1.8, 0.0], [0.0, 0.0]]),
        np.array([1.5, 0.8]),
        np.array([0.9, 0.95]),
        np.full(2, 0.2),
        np.array([0.4, 0.4]),
    )
    return observe(scene, noise=0.005, frames=40, seed=2)


def by_emcee(checkpoint: Path | None = None) -> Posterior:
    return infer(tracks(), sampler="emcee", draws=200, checkpoint=checkpoint)


@cache
def whole() -> Posterior:
    return by_emcee()


def test_emcee_tells_the_mass_ratio() -> None:
    posterior = whole()
    assert posterior.convergence.converged
    assert posterior.warnings == ()
    (ratio,) = posterior.mass_ratios()
    assert ratio.summary.mean == pytest.approx(MASS_RATIO, abs=4 * ratio.summary.sd)
    assert ratio.summary.sd < 0.1
    assert posterior.draw_count >= 200


@pytest.mark.slow
def test_nuts_agrees_with_emcee() -> None:
    fit = fit_map(tracks(), default_model(), np.random.default_rng(0))
    reported = Reported.of(fit.likelihood.coordinates, fit.contacts, tracks().bodies)
    few = {"warm_up": 5, "most_gradients": 1, "processes": 1}
    samples = sampled(fit, "nuts", draws=100, generator=np.random.default_rng(1), reported=reported, **few)
    assert np.isfinite(samples.log_density).all()
    (place,) = (k for k, name in enumerate(reported.names) if name.startswith("the mass ratio"))
    drawn = reported.values(samples.points)[..., place]
    ratio = np.log(whole().data["posterior"]["mass"].sel(body="0") / whole().data["posterior"]["mass"].sel(body="1"))
    assert drawn.mean() == pytest.approx(float(ratio.mean()), abs=float(ratio.std()))
    assert drawn.std() == pytest.approx(float(ratio.std()), rel=0.5)


@pytest.mark.slow
def test_a_video_whose_sampling_was_killed_goes_on_to_the_same_numbers(tmp_path: Path) -> None:
    folder, about_half = tmp_path / "checkpoint", tmp_path / "checkpoint" / "ensemble_2.h5"
    program = "import sys; from pathlib import Path; from tests.inference.test_two_discs import by_emcee; "
    process = subprocess.Popen(
        [sys.executable, "-c", program + "by_emcee(Path(sys.argv[1]))", str(folder)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    deadline = time.monotonic() + PATIENCE
    while not about_half.exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL, "it was done before it could be killed"
    assert about_half.exists()
    for again in (by_emcee(folder), by_emcee(folder)):  # the second with everything there
        for name, group in whole().data.children.items():
            xr.testing.assert_identical(again.data[name].to_dataset(), group.to_dataset())
        assert again.convergence == whole().convergence
