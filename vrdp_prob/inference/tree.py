"""Everything that is known of a video's draws as one tree of groups, named as ArviZ names them."""

from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float, Int

from vrdp_prob.inference.draws.samples import Samples
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.named_draws import flat_draws, named_draws, named_fields
from vrdp_prob.inference.predictive import drawn_lateness, replicated, replicated_angles
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.spread import evenly_spread

PRIOR_DRAWS = 500
PREDICTIVE_DRAWS = 200
"""Draws whose measurement is drawn anew; they are evenly spaced among all."""
BATCH = 500
"""Worlds simulated at once when the draws are looked at again."""
SAMPLE = ("chain", "draw")


def posterior_tree(
    fit: MapFit, samples: Samples, changed: Float[np.ndarray, "chain draw"], generator: np.random.Generator
) -> xr.DataTree:
    """The groups of a posterior.

    Parameters
    ----------
    fit
        The most probable values and the density around them.
    samples
        The draws.
    changed
        1 for a draw whose collisions come in another order than those of the most probable world, else 0.
    generator
        Draws the prior and the noise of the predicted measurements.

    Returns
    -------
    Groups `posterior`, `map_estimate`, `prior`, `sample_stats`, `log_likelihood`, `log_prior`, `posterior_predictive`
    and `observed_data`. What is large is rounded to single precision, so that it compresses well.
    """
    likelihood, points = fit.likelihood, samples.points
    prior = likelihood.coordinates.prior_draws(PRIOR_DRAWS, generator)[None]
    statistics = {"lp": samples.log_density, "collision_order_changed": changed, **samples.statistics}
    return xr.DataTree.from_dict(
        {
            "posterior": named_draws(likelihood, points),
            "map_estimate": named_draws(likelihood, fit.point[None, None]).isel(chain=0, draw=0, drop=True),
            "prior": named_draws(likelihood, prior),
            "sample_stats": _numbered({name: (SAMPLE, values) for name, values in statistics.items()}, points),
            "log_likelihood": _log_likelihood(likelihood, points),
            "log_prior": _log_prior(likelihood, points),
            "posterior_predictive": _predictive(likelihood, points, generator),
            "observed_data": _observed(likelihood),
        }
    )


def for_arviz(tree: xr.DataTree) -> Any:
    """The tree as the installed ArviZ wants it: `InferenceData` before its version 1, the tree itself since then."""
    if int(version("arviz").split(".")[0]) >= 1:
        return tree
    import arviz  # noqa: PLC0415 (slow to import, and only an old one is needed)

    inference_data: Any = arviz.InferenceData
    return inference_data.from_datatree(tree)


def _log_likelihood(likelihood: Likelihood, points: Float[np.ndarray, "chain draw dimension"]) -> xr.Dataset:
    """Log likelihood of each seen position, and of each measured angle, in one row, so that nothing is missing."""
    flat, seen = flat_draws(points), likelihood.observations
    batches = [likelihood.pointwise(flat[k : k + BATCH]) for k in range(0, len(flat), BATCH)]
    positions, angles = (np.concatenate(part).reshape(*points.shape[:2], -1) for part in zip(*batches, strict=True))
    dataset = _numbered({"position": ((*SAMPLE, "observation"), _rounded(positions))}, points)
    dataset = dataset.assign_coords(_places(likelihood, "observation", "observed", seen.frame, seen.body))
    if not len(seen.angle):
        return dataset
    dataset["angle"] = ((*SAMPLE, "angle_observation"), _rounded(angles))
    return dataset.assign_coords(_places(likelihood, "angle_observation", "angle", seen.angle_frame, seen.angle_body))


def _places(
    likelihood: Likelihood, axis: str, prefix: str, frame: Int[np.ndarray, "seen"], body: Int[np.ndarray, "seen"]
) -> dict[str, Any]:
    """Time and body of observations, as coordinates of their axis."""
    tracks = likelihood.tracks
    return {
        f"{prefix}_time": (axis, tracks.times[frame], {"units": "s"}),
        f"{prefix}_body": (axis, np.array([one.id for one in tracks.bodies])[body]),
    }


def _log_prior(likelihood: Likelihood, points: Float[np.ndarray, "chain draw dimension"]) -> xr.Dataset:
    """Log prior (up to a constant) of each sampled number, by the names of the posterior; 0 for what is not sampled."""
    coordinates = likelihood.coordinates
    terms = coordinates.log_prior(flat_draws(points)).numpy().reshape(points.shape)
    fields: dict[str, np.ndarray] = {}
    for place, entry in enumerate(coordinates.entries):
        owners = len(coordinates.defaults[entry.field])
        column = fields.setdefault(entry.field, np.zeros((*points.shape[:2], owners)))
        column[..., entry.owner or 0] = terms[..., place]
    return named_fields(likelihood, fields).map(_rounded)


def _predictive(
    likelihood: Likelihood, points: Float[np.ndarray, "chain draw dimension"], generator: np.random.Generator
) -> xr.Dataset:
    """Positions, and angles where some were measured, as they would be measured; NaN before a body's release."""
    draws = points.shape[1]
    per_chain = min(draws, max(1, PREDICTIVE_DRAWS // len(points)))
    chosen = evenly_spread(per_chain, draws)
    worlds = flat_draws(points[:, chosen])
    axes, sizes = (*SAMPLE, "time", "body"), (len(points), per_chain, *likelihood.tracks.seen.shape)
    late = drawn_lateness(likelihood, worlds, generator)
    positions = replicated(likelihood, worlds, generator, late).reshape(*sizes, 2)
    variables: dict[str, Any] = {"position": ((*axes, "axis"), _rounded(positions), {"units": "m"})}
    if len(likelihood.observations.angle):
        # a stream of its own: what is drawn after the positions is the same with and without angles
        angles = replicated_angles(likelihood, worlds, generator.spawn(1)[0], late).reshape(sizes)
        variables["angle"] = (axes, _rounded(angles), {"units": "rad"})
    return xr.Dataset(
        variables,
        {
            "chain": np.arange(len(points)),
            "draw": chosen,
            "time": likelihood.tracks.data["time"],
            "body": [body.id for body in likelihood.tracks.bodies],
            "axis": ["x", "y"],
        },
        {"draws": f"{per_chain} of {draws} draws of each chain"},
    )


def _observed(likelihood: Likelihood) -> xr.Dataset:
    """The tracks, with their positions once more under the name and the axes of the prediction."""
    tracks = likelihood.tracks
    position = (("time", "body", "axis"), tracks.positions, {"units": "m"})
    return tracks.data.assign(position=position).assign_coords(axis=["x", "y"])


def _numbered(variables: Mapping[str, Any], points: Float[np.ndarray, "chain draw dimension"]) -> xr.Dataset:
    """Variables with the numbers of chains and draws as coordinates."""
    return xr.Dataset(variables, {name: np.arange(size) for name, size in zip(SAMPLE, points.shape[:2], strict=True)})


def _rounded(values: Any) -> Any:
    """The values to single precision: their last bits are zero, and take no room in a compressed file."""
    return values.astype(np.float32).astype(np.float64)
