"""What the tracks of a video say about masses and restitutions, as its fit tells it before anything is sampled."""

from dataclasses import dataclass

from vrdp_prob.inference.identifiability.information import Information
from vrdp_prob.inference.identifiability.status import BodyStatus, CollisionGroup, collision_groups, identifiability
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.search.events import Pairs, contacts_with_fixed_things
from vrdp_prob.models.parameters import RESTITUTION
from vrdp_prob.models.unknowns import felt_masses, structure_of


@dataclass(frozen=True)
class Identified:
    """What can be told of bodies one by one, and in combinations.

    Parameters
    ----------
    status
        By the id of a body: what the data say about its mass and its restitution.
    groups
        Which combinations the data determine, for each group of bodies that collisions link.
    """

    status: dict[str, BodyStatus]
    groups: tuple[CollisionGroup, ...]


def identified(fit: MapFit) -> Identified:
    """What the tracks can tell under the model of a fit, from the curvature at its most probable values.

    Nothing is sampled for it. It is what a posterior of this fit says in `status` and `groups`.

    Parameters
    ----------
    fit
        The most probable values, of `fit_map`.
    """
    tracks, coordinates = fit.likelihood.tracks, fit.likelihood.coordinates
    information = Information(coordinates, fit.modes[0])
    told, fixed = _telling(fit), contacts_with_fixed_things(fit.rollout, 0, len(tracks.walls))
    model = fit.likelihood.model
    felt, obstacles = felt_masses(model, structure_of(coordinates).moving), model.obstacle_restitutions
    status = identifiability(tracks, told, fixed, information, felt=felt, obstacles=obstacles)
    return Identified(status, collision_groups(tracks, told, fixed, information, obstacles))


def _telling(fit: MapFit) -> Pairs:
    """Contacts of bodies of which both had something to tell, so that their restitutions are unknowns."""
    places = fit.likelihood.coordinates.places
    return tuple((i, j) for i, j in fit.contacts if {(RESTITUTION.name, i), (RESTITUTION.name, j)} <= places.keys())
