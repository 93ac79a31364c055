"""Objects that never collided: default mass and restitution, or values drawn from the prior.

A default says 'as the others'; it makes answers sharper than the video allows. Values drawn from the prior carry the
doubt about the object into the answer.
"""

from dataclasses import replace
from typing import Literal

import numpy as np
import torch

from vrdp_prob.errors import InputError
from vrdp_prob.models.parameters import MASS
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.models.unknowns import prior_restitutions

Defaults = Literal["fixed", "prior"]

DEFAULT, DRAWN = "default", "drawn"


def with_defaults(
    worlds: Worlds,
    model: PhysicsModel,
    statuses: list[tuple[str, str]],
    defaults: Defaults,
    generator: np.random.Generator,
) -> Worlds:
    """The same worlds with the constants of objects that never collided as asked.

    Parameters
    ----------
    worlds
        Posterior draws.
    model
        The physics, with what it believes of masses and restitutions.
    statuses
        Status of mass and restitution of each body; `drawn` for a mass that is an unknown, of which the tracks say next
        to nothing.
    defaults
        `fixed` leaves the defaults, `prior` draws from the prior: the mass around its default, by the prior's spread;
        the restitution where it is at most 1.
    generator
        Source of the draws.

    Raises
    ------
    InputError
        If `defaults` is neither.
    """
    if defaults not in ("fixed", "prior"):
        raise InputError(f"defaults is '{defaults}'; use fixed or prior.")
    if defaults == "fixed":
        return worlds
    mass, restitution = worlds.mass.clone(), worlds.restitution.clone()
    for body, (of_mass, of_restitution) in enumerate(statuses):
        if of_mass == DEFAULT:
            spread = model.believed(MASS).prior.sd * generator.standard_normal(len(worlds))
            mass[:, body] *= MASS.transform.from_coordinate(torch.from_numpy(spread)).to(mass)
        if of_restitution == DEFAULT:
            drawn = prior_restitutions(model, (len(worlds),), generator)
            restitution[:, body] = torch.from_numpy(drawn).to(restitution)
    return replace(worlds, mass=mass, restitution=restitution)
