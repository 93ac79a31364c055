"""What some videos tell of the numbers that further videos of the same table share with them."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.linking import Key, shared_key
from vrdp_prob.inference.several_videos.population import with_learned_population
from vrdp_prob.models.coordinates import Coordinate
from vrdp_prob.models.parameters import WALL_RESTITUTION, Scope, belief_key
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Tracks, Wall

OF_THE_TABLE = (Scope.SHARED, Scope.MATERIAL)
"""What further videos of a table have in common with others: no numbers of a single video or body."""


def learned_model(fit: SharedFit) -> PhysicsModel:
    """The model of a fit, believing what its videos tell: for further videos of the same table.

    Shared parameters, those of materials and the restitutions of walls have what all videos say of them as their prior
    and default. Of what bodies have of their own
    (masses, restitutions, frictions) it is learned how far apart they are, of restitutions their middle, too; that of
    masses cannot be seen.
    """
    gaussian = fit.joint.gaussian
    return believing(with_learned_population(fit), fit.joint.numbers.keys, gaussian.mean, gaussian.sd)


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


def with_learned_walls(fit: SharedFit, tracks: Tracks) -> Tracks:
    """Tracks of a further video, with the most probable restitution of each wall that the videos of a fit have met.

    What is stated of a wall is kept.
    """
    joint = fit.joint
    told = dict(zip(joint.numbers.keys, joint.gaussian.mean, strict=True))

    def with_learned_restitution(number: int, wall: Wall) -> Wall:
        entry = Coordinate.of(WALL_RESTITUTION, number)
        key = shared_key(entry, tracks)
        if wall.restitution is not None or key not in told:
            return wall
        return replace(wall, restitution=min(math.exp(told[key]), 1.0))

    return replace(tracks, walls=tuple(with_learned_restitution(*one) for one in enumerate(tracks.walls)))
