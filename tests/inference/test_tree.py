"""What the groups of a posterior hold, and that ArviZ works on them."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import arviz
import arviz_stats
import numpy as np
import pytest
import torch
import xarray as xr

from tests.inference.three_bodies import NOISE, tracks
from vrdp_prob.inference import Posterior, default_model, infer, tree
from vrdp_prob.inference.draws.samples import Samples
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.predictive import replicated
from vrdp_prob.inference.tree import PREDICTIVE_DRAWS, posterior_tree
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.model_error import ModelError, straying
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.unknowns import DEGREES_OF_FREEDOM, structure_of, unknowns
from vrdp_prob.models.unknowns import NOISE as NOISE_SCALE


@cache
def fit(*, angles: bool = False) -> MapFit:
    return fit_map(tracks(angles=angles), default_model(), np.random.default_rng(0))


def points() -> np.ndarray:
    """Two chains of draws around the best fit."""
    return around(fit())


def around(found: MapFit) -> np.ndarray:
    best = found.modes[0].point
    return best + 0.002 * np.random.default_rng(1).standard_normal((2, 150, len(best)))


@cache
def grouped() -> xr.DataTree:
    return groups_of(fit())


def groups_of(found: MapFit) -> xr.DataTree:
    draws = around(found)
    log_density = found.likelihood.log_density(torch.from_numpy(draws.reshape(300, -1))).numpy().reshape(2, 150)
    return posterior_tree(found, Samples(draws, log_density), np.zeros((2, 150)), np.random.default_rng(2))


def with_angles(kind: str) -> MapFit:
    """A fit to positions and angles, its density that of Gaussian or Student-t noise or of a model error."""
    found = fit(angles=True)
    likelihood, (mode, *_) = found.likelihood, found.modes
    if kind == "gaussian":
        return found
    error = None
    if kind == "model error":
        count, turns = len(likelihood.observations.frame), len(likelihood.observations.angle)
        error = ModelError(0.5, 1.2, 20.0, 5.0, 0.5, np.linspace(1, 2, count), np.linspace(1, 3, turns))
    family = NoiseFamily.GAUSSIAN if error else NoiseFamily.STUDENT_T
    structure = structure_of(likelihood.coordinates)
    coordinates = unknowns(likelihood.tracks, likelihood.model, structure, family, error)
    other = Likelihood(likelihood.tracks, likelihood.model, coordinates, family, error)
    point = likelihood.coordinates.carried(mode.point, coordinates)
    return replace(found, likelihood=other, modes=(replace(mode, point=point, precision=np.eye(len(point))),))


@cache
def posterior() -> Posterior:
    return infer(tracks(), sampler="laplace", draws=300, seed=1)


def test_likelihood_and_prior_add_up_to_the_log_density() -> None:
    check_that_it_adds_up(grouped())


@pytest.mark.parametrize("kind", ["gaussian", "student_t", "model error"])
def test_they_add_up_with_measured_angles(kind: str) -> None:
    groups = groups_of(with_angles(kind))
    check_that_it_adds_up(groups)
    angles = groups["log_likelihood"]["angle"]
    observations = fit(angles=True).likelihood.observations
    assert angles.dims == ("chain", "draw", "angle_observation")
    assert angles["angle_body"].values.tolist() == [str(body) for body in observations.angle_body]
    assert np.isfinite(angles).all()


def test_predicted_angles_scatter_like_the_measured_ones() -> None:
    found = fit(angles=True)
    groups = groups_of(found)
    predicted, observed = groups["posterior_predictive"]["angle"], groups["observed_data"]["angle"]
    assert predicted.dims == ("chain", "draw", *observed.dims)
    measured = found.likelihood.observations.angle_bodies
    unmeasured = [body for body in range(3) if body not in measured]
    assert np.isnan(predicted.isel(body=unmeasured)).all()
    chosen = around(found)[:, predicted["draw"].values].reshape(PREDICTIVE_DRAWS, -1)
    added = predicted.values.reshape(PREDICTIVE_DRAWS, *observed.shape)
    added = added - found.likelihood.predicted(torch.from_numpy(chosen))[..., 2]
    scale = float(groups["posterior"]["angle_noise_scale"].mean()) * found.likelihood.observations.angle_reference
    for body in measured:
        assert np.nanstd(added[..., body]) == pytest.approx(scale, rel=0.05)


def check_that_it_adds_up(groups: xr.DataTree) -> None:
    terms = groups["log_likelihood"].to_dataset().data_vars.values()
    likelihood = sum(values.sum(values.dims[2:]) for values in terms)
    prior = groups["log_prior"].to_dataset().to_stacked_array("number", ("chain", "draw")).sum("number")
    difference = (groups["sample_stats"]["lp"] - likelihood - prior).values
    assert np.isfinite(difference).all()
    assert difference.std() < 1e-3
    assert groups["sample_stats"]["lp"].values.std() > 1


def test_there_is_one_log_likelihood_per_observation_and_one_log_prior_per_sampled_number() -> None:
    groups, seen = grouped(), tracks().seen
    assert groups["log_likelihood"]["position"].sizes == {"chain": 2, "draw": 150, "observation": int(seen.sum())}
    assert np.isfinite(groups["log_likelihood"]["position"]).all()
    assert set(groups["log_likelihood"]["observed_body"].values) == {"0", "1", "2"}
    prior = groups["log_prior"]
    assert prior["position"].dims == ("chain", "draw", "body", "axis")
    assert (prior["mass"].values[..., :2] != 0).all()
    assert (prior["mass"].values[..., 2] == 0).all()


def test_predicted_measurements_scatter_like_the_measured_ones() -> None:
    groups, seen = grouped(), tracks().seen
    predicted, observed = groups["posterior_predictive"]["position"], groups["observed_data"]["position"]
    assert predicted.dims == ("chain", "draw", *observed.dims)
    assert predicted.sizes["chain"] * predicted.sizes["draw"] == PREDICTIVE_DRAWS
    assert "of 150 draws" in groups["posterior_predictive"].attrs["draws"]
    assert np.isnan(predicted.sel(body="2", time=slice(None, 0.3))).all()
    assert np.isfinite(predicted.sel(body="0")).all()
    chosen = torch.from_numpy(points()[:, predicted["draw"].values].reshape(PREDICTIVE_DRAWS, -1))
    added = predicted.values.reshape(PREDICTIVE_DRAWS, *observed.shape) - fit().likelihood.predicted(chosen)[..., :2]
    assert added[:, seen].std() == pytest.approx(NOISE, rel=0.15)
    assert np.abs(predicted.values.mean(axis=(0, 1)) - observed.values)[seen].max() < 5 * NOISE


def test_predicted_measurements_stray_as_the_model_error_and_have_the_tails_of_the_noise() -> None:
    likelihood, point = fit().likelihood, torch.from_numpy(np.tile(fit().point, (2000, 1)))
    exact, noise = likelihood.predicted(point[:1])[..., :2], likelihood.coordinates.quantities(point)[NOISE_SCALE][0, 0]
    unit = float(noise) * likelihood.observations.position_reference
    count, angles = len(likelihood.observations.frame), len(likelihood.observations.angle)
    error = ModelError(float(noise), 1.0, 300.0, 0.0, 0.5, np.ones(count), np.ones(angles))
    strayed = replicated(replace(likelihood, model_error=error), point, np.random.default_rng(0)) - exact
    seen, times = strayed[:, :, 0] / unit, tracks().times
    paths = 300.0**2 * straying(times, times[0], 0.5)
    for frame in (0, 5, 10):
        assert (seen[:, frame] ** 2).mean() == pytest.approx(1 + paths[frame, frame], rel=0.1)
    assert (seen[:, 5] * seen[:, 10]).mean() == pytest.approx(paths[5, 10], rel=0.15)
    robust = replace(likelihood, noise=NoiseFamily.STUDENT_T)
    degrees = float(likelihood.coordinates.quantities(point)[DEGREES_OF_FREEDOM][0, 0])
    wide = replicated(robust, point, np.random.default_rng(0))[:, :, 0] - exact[:, :, 0]
    share = (np.linalg.norm(wide, axis=-1) > 3 * unit).mean()
    assert share == pytest.approx((1 + 9 / degrees) ** (-degrees / 2), rel=0.1)  # two-dimensional Student-t


def test_the_installed_arviz_takes_the_result() -> None:
    data = posterior().to_arviz()
    for group in ("posterior", "posterior_predictive", "log_likelihood", "log_prior", "map_estimate"):
        assert group in data
    summary = arviz.summary(data, var_names=["mass", "velocity"], kind="stats")
    assert float(summary.loc["mass[0]", "mean"]) > 0
    loo = arviz.loo(data, var_name="position", pointwise=True)
    expected, pointwise = (loo.elpd, loo.elpd_i) if hasattr(loo, "elpd") else (loo.elpd_loo, loo.loo_i)
    assert np.isfinite(expected)
    assert pointwise.size == tracks().seen.sum()


def test_arviz_from_version_1_takes_the_tree_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tree, "version", lambda _name: "1.2.0")
    data = posterior().to_arviz()
    assert data is posterior().data
    assert arviz_stats.summary(data, var_names=["mass"], kind="stats").loc["mass[0]", "mean"] > 0
    assert np.isfinite(arviz_stats.loo(data, var_name="position").elpd)
    sensitivity = arviz_stats.psense_summary(data, var_names=["sliding_friction"])
    assert np.isfinite(sensitivity[["prior", "likelihood"]].astype(float).to_numpy()).all()


def test_the_file_is_compressed(tmp_path: Path) -> None:
    path = tmp_path / "posterior.nc"
    posterior().write(path)
    numbers = sum(int(values.size) for group in posterior().data.subtree for values in group.data_vars.values())
    assert path.stat().st_size < 7 * numbers
