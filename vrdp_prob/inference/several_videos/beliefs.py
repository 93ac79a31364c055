"""Models that believe something of what several videos share."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.several_videos.linking import Key
from vrdp_prob.models.parameters import WALL_RESTITUTION, Scope, belief_key
from vrdp_prob.models.physics import PhysicsModel

OF_THE_TABLE = (Scope.SHARED, Scope.MATERIAL)
"""What further videos of a table have in common with others: no numbers of a single video or body."""


def believing(
    model: PhysicsModel,
    keys: Sequence[Key],
    mean: Float[np.ndarray, "shared"],
    sd: Float[np.ndarray, "shared"],
) -> PhysicsModel:
    """A model that believes something of what several videos share.

    Parameters
    ----------
    model
        The model.
    keys
        What each number is shared as.
    mean, sd
        What is believed of the numbers, in their coordinates; it is never believed less sharply than before.
    """
    stated = {parameter.name: parameter for parameter in model.parameters if parameter.scope in OF_THE_TABLE}
    stated[WALL_RESTITUTION.name] = WALL_RESTITUTION
    beliefs = dict(model.beliefs)
    for (name, group), middle, width in zip(keys, mean.tolist(), sd.tolist(), strict=True):
        if name in stated:
            parameter = model.believed(stated[name], group)
            prior = replace(parameter.prior, mean=middle, sd=min(width, parameter.prior.sd))
            value = parameter.transform.to_value(middle)
            value = value if prior.upper is None else min(value, 1.0)
            beliefs[belief_key(name, group)] = replace(parameter, prior=prior, default=value)
    return replace(model, beliefs=beliefs)
