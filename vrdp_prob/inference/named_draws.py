"""Points of the unconstrained vector as named draws with units."""

from collections.abc import Mapping

import numpy as np
import torch
import xarray as xr
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import MASS, RESTITUTION, WALL_RESTITUTION
from vrdp_prob.models.unknowns import ANGLE_NOISE, DEGREES_OF_FREEDOM, NOISE

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
    DEGREES_OF_FREEDOM: "1",
}
"""Units of the variables that every posterior has."""
PLANAR = {"position": ("x", "y"), "velocity": ("velocity_x", "velocity_y")}
"""Variables with an axis for the direction, and the fields that they are made of."""
PER_BODY = ("chain", "draw", "body")


def named_draws(likelihood: Likelihood, points: Float[np.ndarray, "chain draw dimension"]) -> xr.Dataset:
    """All quantities of the worlds that points stand for, sampled or not, with axes `chain`, `draw` and their own."""
    quantities = likelihood.coordinates.quantities(flat_draws(points))
    fields = {name: column.numpy().reshape(*points.shape[:2], -1) for name, column in quantities.items()}
    if (DEGREES_OF_FREEDOM, None) not in likelihood.coordinates.places:
        del fields[DEGREES_OF_FREEDOM]
    dataset = named_fields(likelihood, fields)
    units = {**UNITS, **{parameter.name: parameter.unit for parameter in likelihood.model.parameters}}
    for name, variable in dataset.data_vars.items():
        variable.attrs["units"] = units.get(str(name), "1")
    dataset[NOISE].attrs["reference_m"] = likelihood.observations.position_reference
    return dataset


def named_fields(likelihood: Likelihood, fields: Mapping[str, Float[np.ndarray, "chain draw owner"]]) -> xr.Dataset:
    """Numbers of each field and owner (of all its owners) as variables with axes `chain`, `draw` and their own."""
    values = dict(fields)
    variables: dict[str, tuple[tuple[str, ...], np.ndarray]] = {}
    for name, parts in PLANAR.items():
        if parts[0] in values:
            variables[name] = ((*PER_BODY, "axis"), np.stack([values.pop(part) for part in parts], axis=-1))
    shared = {p.name for p in likelihood.model.parameters if p.scope.per_video} | {
        NOISE,
        ANGLE_NOISE,
        DEGREES_OF_FREEDOM,
    }
    for name, value in values.items():
        if name in shared:
            variables[name] = (PER_BODY[:2], value[..., 0])
        elif name == WALL_RESTITUTION.name:
            if value.shape[-1]:
                variables[name] = ((*PER_BODY[:2], "wall"), value)
        else:
            variables[name] = (PER_BODY, value)
    chains, draws = next(iter(fields.values())).shape[:2]
    coordinates = {
        "chain": np.arange(chains),
        "draw": np.arange(draws),
        "body": [body.id for body in likelihood.tracks.bodies],
        "axis": ["x", "y"],
    }
    return xr.Dataset(variables, coordinates)


def flat_draws(points: Float[np.ndarray, "chain draw dimension"]) -> Float[Tensor, "point dimension"]:
    """The draws of all chains, one after the other."""
    return torch.from_numpy(np.ascontiguousarray(points.reshape(-1, points.shape[-1])))
