"""Points of the unconstrained vector as named draws with units."""

import numpy as np
import torch
import xarray as xr
from jaxtyping import Float

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import MASS, RESTITUTION, WALL_RESTITUTION, Scope
from vrdp_prob.models.unknowns import ANGLE_NOISE, NOISE

UNITS = {
    "position": "m",
    "velocity": "m/s",
    "angle": "rad",
    "spin": "rad/s",
    "angle_zero": "rad",
    MASS.name: MASS.unit,
    RESTITUTION.name: RESTITUTION.unit,
    WALL_RESTITUTION.name: WALL_RESTITUTION.unit,
    NOISE: "1",
    ANGLE_NOISE: "1",
}
"""Units of the variables that every posterior has."""


def named_draws(likelihood: Likelihood, points: Float[np.ndarray, "chain draw dimension"]) -> xr.Dataset:
    """All quantities of the worlds that points stand for, sampled or not, with axes `chain`, `draw` and their own."""
    chains, draws = points.shape[:2]
    flat = torch.from_numpy(np.ascontiguousarray(points.reshape(chains * draws, -1)))
    quantities = likelihood.coordinates.quantities(flat)
    values = {field: column.numpy().reshape(chains, draws, -1) for field, column in quantities.items()}
    per_body = ("chain", "draw", "body")
    variables: dict[str, tuple[tuple[str, ...], np.ndarray]] = {
        "position": ((*per_body, "axis"), np.stack([values.pop("x"), values.pop("y")], axis=-1)),
        "velocity": ((*per_body, "axis"), np.stack([values.pop("velocity_x"), values.pop("velocity_y")], axis=-1)),
    }
    shared = {p.name for p in likelihood.model.parameters if p.scope is Scope.SHARED} | {NOISE, ANGLE_NOISE}
    units = {**UNITS, **{parameter.name: parameter.unit for parameter in likelihood.model.parameters}}
    for name, value in values.items():
        if name in shared:
            variables[name] = (("chain", "draw"), value[..., 0])
        elif name == WALL_RESTITUTION.name:
            if value.shape[-1]:
                variables[name] = (("chain", "draw", "wall"), value)
        else:
            variables[name] = (per_body, value)
    reference = likelihood.observations.position_reference
    dataset = xr.Dataset(
        {name: (axes, value, {"units": units.get(name, "1")}) for name, (axes, value) in variables.items()},
        coords={
            "chain": np.arange(chains),
            "draw": np.arange(draws),
            "body": [body.id for body in likelihood.tracks.bodies],
            "axis": ["x", "y"],
        },
    )
    dataset[NOISE].attrs["reference_m"] = reference
    return dataset
