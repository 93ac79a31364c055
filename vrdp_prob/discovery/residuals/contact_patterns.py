"""What could act at contacts, and how strongly it shows beside free flight and all that a fit absorbs.

Contacts of bodies with each other and with stated walls are asked alike, each kind beside the other. Where a cube's yaw
is not measured its contacts may do anything: the direction of their impulse is known from the motion after them alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.linear import Score
from vrdp_prob.discovery.residuals.residual_model import ResidualModel, joined
from vrdp_prob.models.simulator.events import RolloutEventKind

AT_CONTACTS, AT_WALLS = "at contacts", "at walls"
WHERE = {AT_CONTACTS: RolloutEventKind.COLLISION, AT_WALLS: RolloutEventKind.WALL}
"""Where bodies touch each other, and stated walls."""
GROW = "grow"


def contacts_of(model: ResidualModel) -> dict[str, list[FittedContacts]]:
    """Contacts of each video, by where they are."""
    return {where: [FittedContacts.of(video.motion, kind) for video in model.videos] for where, kind in WHERE.items()}


@dataclass(frozen=True)
class ContactScore:
    """How strongly patterns of what acts at contacts show.

    Parameters
    ----------
    clear
        The contacts of each video whose normal is known, by where they are.
    vague
        All others.
    turning
        Whether turning is measured in all videos.
    score, places
        How strongly all patterns show, and the places of each set of them.
    """

    clear: Mapping[str, Sequence[FittedContacts]]
    vague: Mapping[str, Sequence[FittedContacts]]
    turning: bool
    score: Score
    places: Mapping[str, Sequence[int]]

    @classmethod
    def of(cls, model: ResidualModel, flight: FreeFlight, *, each: bool = False) -> "ContactScore | None":
        """All patterns in the residuals of a fit, where the patterns of free flight may show; None without contacts.

        Parameters
        ----------
        model, flight
            The residuals, and the patterns of free flight.
        each
            Whether spins, rebounds and durations are also to be told at each contact by itself.
        """
        motions = [video.motion for video in model.videos]
        contacts = {where: some for where, some in contacts_of(model).items() if any(map(len, some))}
        if not contacts:
            return None
        clear = {where: [one.where(one.known_normal) for one in some] for where, some in contacts.items()}
        vague = {where: [one.where(~one.known_normal) for one in some] for where, some in contacts.items()}
        changes = {GROW: [motion.growth[..., None] for motion in motions]}
        for where, some in clear.items():
            changes |= {
                f"anything {where}": _one_after_another([one.pushed_anyhow() for one in vague[where]]),
                f"rub {where}": _one_after_another([_rubbing_each(one) for one in some]),
                f"slip {where}": [_slipping(one) for one in some],
                f"turn {where}": [_slipping(one, moving=False) for one in some],
                f"last {where}": [one.lasting(np.ones((len(one), 1))) for one in some],
            }
            if where == AT_CONTACTS:
                changes["together"] = _one_after_another([one.pushed_together(unbalanced(one)) for one in some])
            else:
                changes["bounce"] = [_bouncing(one) for one in some]
            if each:
                changes[f"turn each {where}"] = _one_after_another([_rubbing_each(one, moving=False) for one in some])
                changes[f"last each {where}"] = _one_after_another([one.lasting(np.eye(len(one))) for one in some])
            if each and where == AT_WALLS:
                changes["bounce each"] = _one_after_another([_bouncing_each(one) for one in some])
        rows = {
            name: [video.rows(one) for video, one in zip(model.videos, parts, strict=True)]
            for name, parts in changes.items()
        }
        score, places = joined(model.sharing(flight.rows_beside_contacts), rows)
        return cls(clear, vague, all(motion.tracks.turning_told for motion in motions), score, places)

    @property
    def rubbing(self) -> tuple[str, ...]:
        """The tangential impulses of all contacts, each by itself."""
        return tuple(f"rub {where}" for where in self.clear)

    def part(self, name: str, *given: str) -> Score:
        """The score of a set of patterns, where some others may show as well."""
        return self.score.of(self.places[name], self._beside(*given))

    def _beside(self, *given: str) -> list[int]:
        return [k for name in (*(f"anything {where}" for where in self.clear), *given) for k in self.places[name]]

    def tangential(self, name: str, where: str) -> Score:
        """The score of what acts along the tangent of contacts, beside all sizes and what acts at the other ones."""
        word = "slip" if self.turning else "rub"
        return self.part(f"{name} {where}", GROW, *(f"{word} {other}" for other in self.clear if other != where))

    def normal(self, name: str) -> Score:
        """The score of what acts beside tangential impulses of any size at each contact, and beside all sizes."""
        return self.part(name, *self.rubbing, GROW)

    def durations(self, name: str, where: str, *given: str) -> Score:
        """The score of contacts that last, beside tangential impulses of any size, other contacts and perhaps more."""
        others = (f"last {one}" for one in self.clear if one != where)
        return self.part(f"{name} {where}", *self.rubbing, *others, *given)

    @property
    def rebounds(self) -> Score:
        """The score of restitution at each contact with a wall, whatever it is on average."""
        _, average = self.places["bounce"]
        return self.score.of(self.places["bounce each"], [*self._beside(*self.rubbing, GROW), average])


def durations_freed(model: ResidualModel) -> ResidualModel:
    """The model of a fit in which every contact may last."""
    columns = []
    for video, *contacts in zip(model.videos, *contacts_of(model).values(), strict=True):
        columns.append(video.rows(np.concatenate([one.lasting(np.eye(len(one))) for one in contacts], axis=-1)))
    return model.freed(columns)


def unbalanced(contacts: FittedContacts) -> list[Float[np.ndarray, "contact 2"]]:
    """Directions in which momentum can be seen to be lost: along the normal only where the masses are known."""
    weighed = all(body.mass is not None for body in contacts.motion.tracks.bodies)
    return [contacts.tangent, contacts.events.normal] if weighed else [contacts.tangent]


def _slipping(contacts: FittedContacts, *, moving: bool = True) -> Float[np.ndarray, "time body 3 column"]:
    """Impulses against the slip, as large as the normal ones, and such as stop the slip of what does not turn."""
    sizes = np.stack([contacts.rubbing * contacts.events.impulse, -contacts.slip * contacts.common_mass], axis=1)
    chosen = sizes if moving else sizes[:, :1]
    return contacts.pushed_apart(contacts.tangent[:, :, None] * chosen[:, None], moving=moving)


def _rubbing_each(contacts: FittedContacts, *, moving: bool = True) -> Float[np.ndarray, "time body 3 column"]:
    """Impulses to the left of the normal, as large as the normal one, at each contact by itself."""
    sizes = np.eye(len(contacts)) * contacts.events.impulse
    return contacts.pushed_apart(contacts.tangent[:, :, None] * sizes[:, None], moving=moving)


def _bouncing(contacts: FittedContacts) -> Float[np.ndarray, "time body 3 column"]:
    """Impulses along the normal of a restitution that goes with a power of the approach speed, and of a larger one."""
    sizes = contacts.bounce[:, None] * np.stack([contacts.log_speed, np.ones(len(contacts))], axis=1)
    return contacts.pushed_apart(contacts.events.normal[:, :, None] * sizes[:, None])


def _bouncing_each(contacts: FittedContacts) -> Float[np.ndarray, "time body 3 column"]:
    """Impulses along the normal of a restitution twice as large, at each contact by itself."""
    sizes = np.eye(len(contacts)) * contacts.bounce
    return contacts.pushed_apart(contacts.events.normal[:, :, None] * sizes[:, None])


def _one_after_another(
    changes: Sequence[Float[np.ndarray, "_ _ 3 _"]],
) -> list[Float[np.ndarray, "_ _ 3 column"]]:
    """Patterns of single videos side by side, so that each has an amplitude of its own."""
    widths = [one.shape[-1] for one in changes]
    total, result, first = sum(widths), [], 0
    for one, width in zip(changes, widths, strict=True):
        wide = np.zeros((*one.shape[:-1], total))
        wide[..., first : first + width] = one
        result.append(wide)
        first += width
    return result
