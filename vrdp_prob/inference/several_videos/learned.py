"""What some videos tell of the numbers that further videos of the same table share with them."""

import math
from dataclasses import replace

from vrdp_prob.inference.several_videos.beliefs import believing
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.linking import shared_key
from vrdp_prob.inference.several_videos.population import with_learned_population
from vrdp_prob.models.coordinates import Coordinate
from vrdp_prob.models.parameters import WALL_RESTITUTION
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Tracks, Wall


def learned_model(fit: SharedFit) -> PhysicsModel:
    """The model of a fit, believing what its videos tell: for further videos of the same table.

    Shared parameters, those of materials and the restitutions of walls have what all videos say of them as their prior
    and default. Of what bodies have of their own
    (masses, restitutions, frictions) it is learned how far apart they are, of restitutions their middle, too; that of
    masses cannot be seen.
    """
    gaussian = fit.joint.gaussian
    return believing(with_learned_population(fit), fit.joint.numbers.keys, gaussian.mean, gaussian.sd)


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
