"""Fits from the beginning that believe spins to decay at other rates, where nobody has measured the yaws of cubes.

How a cube lies at a contact is told by the contact; how it got there, by a spin and its decay, of which many pairs do.
Where some videos have agreed on a wrong decay each of them is best where it is, and no search of single videos, given
what the others say, leads away.
"""

from collections.abc import Iterator
from dataclasses import replace

from vrdp_prob.inference.search.yaw_search import tells_yaws_by_contacts
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.inference.several_videos.fitting import NEWS, SharedFit, fit_together
from vrdp_prob.models.parameters import ANGULAR_DRAG, Parameter, Prior, Scope
from vrdp_prob.models.physics import PhysicsModel

DECAY = ANGULAR_DRAG.name
"""The shared number on which the yaws hang."""
PLACES, WIDTH = (-1.5, -0.5, 0.5, 1.5), 0.15
"""Where it is believed to be, and how surely, in standard deviations of its prior."""


def with_other_spins(fit: SharedFit, *, seed: int) -> SharedFit:
    """The best of fits from the beginning that believe spins to decay slower or faster; itself where none is better.

    Parameters
    ----------
    fit
        The fit.
    seed
        Of the searches.

    Returns
    -------
    The fit, of the same model: what was believed of the decay serves to begin with.
    """
    decay = next((one for one in fit.model.parameters if one.name == DECAY and one.scope is Scope.SHARED), None)
    if decay is None or not any(tells_yaws_by_contacts(one.likelihood, one.modes[0].point) for one in fit.fits):
        return fit
    best = fit
    for model in _elsewhere(fit.model, fit.model.believed(decay)):
        try:
            begun = fit_together(fit.tracks, model=model, shared=fit.shared, seed=seed, model_error=False)
            found = begun.under(fit.model, model_error=False)
        except ImpossibleStartError:  # some video has no world there
            continue
        best = found if found.joint.log_density > best.joint.log_density else best
    return best if best.joint.log_density > fit.joint.log_density + NEWS else fit


def _elsewhere(model: PhysicsModel, decay: Parameter) -> Iterator[PhysicsModel]:
    """A model that believes spins to decay slower, or faster."""
    prior = decay.prior
    for place in PLACES:
        near = replace(decay, prior=Prior(prior.mean + place * prior.sd, WIDTH * prior.sd))
        yield replace(model, beliefs={**model.beliefs, DECAY: near})
