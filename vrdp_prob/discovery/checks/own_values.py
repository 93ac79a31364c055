"""What the fit found of single bodies: their restitutions, masses and frictions, as the tracks alone tell them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.special import expit

from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight import FRICTION
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.parameters import MASS, RESTITUTION, Prior
from vrdp_prob.scene import Body

OPEN = 10.0
"""Standard deviation of a logarithm of which nothing is believed."""
LARGEST_SD = 0.3
"""Values that are known no better (standard deviation of the logarithm) tell nothing."""


@dataclass(frozen=True)
class OwnValues:
    """Logarithms of a quantity that every body has for itself, in all videos, as the tracks alone tell them.

    What was believed of bodies is no observation: it would hold them together where a law drives them apart.

    Parameters
    ----------
    values, given_shared
        The most probable logarithms where next to nothing was believed of them, and their covariance given what videos
        share.
    following
        Change of each number per standard deviation of each standard normal coordinate of what videos share, as the
        fit knows it.
    bodies
        Video and body that each belongs to.
    """

    values: Float[np.ndarray, "number"]
    given_shared: Float[np.ndarray, "number number"]
    following: Float[np.ndarray, "number shared"]
    bodies: tuple[tuple[int, int], ...]

    @property
    def covariance(self) -> Float[np.ndarray, "number number"]:
        """Their covariance where what videos share is known no better than the fit says.

        A dependence that a law of the model might as well have by itself is none that the model lacks.
        """
        whole: np.ndarray = self.given_shared + self.following @ self.following.T
        return whole

    @property
    def sd(self) -> Float[np.ndarray, "number"]:
        """Standard deviations given what videos share: of what tells bodies apart."""
        return np.sqrt(np.diag(self.given_shared))

    @classmethod
    def of(cls, fit: SharedFit, field: str) -> "OwnValues":
        """Those of a fit."""
        values, blocks, following, bodies = [], [], [], []
        for index, video in enumerate(fit.joint.videos):
            local = fit.joint.gaussian.locals[index]
            entries = [video.likelihood.coordinates.entries[place] for place in video.local_places]
            mine = [k for k, entry in enumerate(entries) if entry.field == field and entry.owner is not None]
            root = local.root[mine]
            believed = np.array([1 / entries[k].prior.sd ** 2 for k in mine])
            expected = np.array([entries[k].prior.mean for k in mine])
            edge, curvature = _edges([entries[k].prior for k in mine], local.centre[mine])
            precision = np.linalg.inv(root @ root.T)
            both = precision - np.diag(curvature)
            own, directions = np.linalg.eigh(both - np.diag(believed))
            alone = (directions / (np.maximum(own, 0.0) + 1 / OPEN**2)) @ directions.T
            pull = both @ (local.centre[mine] - expected) + edge
            values += (expected + alone @ pull).tolist()
            blocks.append(alone)
            following.append(alone @ precision @ local.slope[mine])
            bodies += [(index, int(entries[k].owner or 0)) for k in mine]
        moving = np.concatenate(following) @ fit.joint.gaussian.root
        return cls(np.array(values), block_diag(*blocks), moving, tuple(bodies))


def _edges(
    priors: Sequence[Prior], values: Float[np.ndarray, "number"]
) -> tuple[Float[np.ndarray, "number"], Float[np.ndarray, "number"]]:
    """First derivative of the negative log priors' soft edges, and the curvature that a fit has of them."""
    upper = np.array([np.inf if prior.upper is None else prior.upper for prior in priors])
    beyond = (values - upper) / np.array([prior.softness for prior in priors])
    slope = expit(beyond) / np.array([prior.softness for prior in priors])
    height = 2 * np.logaddexp(0.0, beyond)
    return slope, np.divide(slope**2, height, out=np.zeros_like(slope), where=height > 0)


@dataclass(frozen=True)
class Rebounds:
    """Restitutions of pairs of bodies that met, as the fit has them.

    Parameters
    ----------
    logarithm, covariance
        Logarithms of the products of the two bodies' factors.
    sd
        Their standard deviations given what videos share.
    closing_speed
        Speeds in m/s at which they met; the geometric mean where they did so several times.
    owners
        Which bodies' factors are in which product.
    """

    logarithm: Float[np.ndarray, "pair"]
    covariance: Float[np.ndarray, "pair pair"]
    sd: Float[np.ndarray, "pair"]
    closing_speed: Float[np.ndarray, "pair"]
    owners: Float[np.ndarray, "pair number"]

    @classmethod
    def of(cls, fit: SharedFit, contacts: Sequence[FittedContacts]) -> "Rebounds":
        """Those that are known well enough."""
        own = OwnValues.of(fit, RESTITUTION.name)
        place = {body: k for k, body in enumerate(own.bodies)}
        owners, speeds = [], []
        for index, one in enumerate(contacts):
            for pair in np.unique(one.bodies, axis=0):
                row = np.zeros(len(own.values))
                row[[place[index, body] for body in pair.tolist() if (index, body) in place]] = 1.0
                owners.append(row)
                met = (one.bodies == pair).all(axis=1)
                speeds.append(float(np.exp(one.log_speed[met].mean())))
        rows = np.array(owners).reshape(len(owners), len(own.values))
        sd = np.sqrt(np.diag(rows @ own.given_shared @ rows.T))
        known = np.flatnonzero(sd < LARGEST_SD)
        rows = rows[known]
        return cls(rows @ own.values, rows @ own.covariance @ rows.T, sd[known], np.array(speeds)[known], rows)


@dataclass(frozen=True)
class FittedMasses:
    """Masses that nobody stated, as collisions tell them: up to one factor for all bodies that met each other.

    Parameters
    ----------
    groups
        Logarithms of the masses by video and body, for each group of bodies of which only ratios are known.
    """

    groups: tuple[Mapping[tuple[int, int], float], ...]

    @classmethod
    def of(cls, fit: SharedFit, contacts: Sequence[FittedContacts]) -> "FittedMasses":
        """Those whose ratios are known well enough."""
        own = OwnValues.of(fit, MASS.name)
        place = {body: k for k, body in enumerate(own.bodies)}
        groups = []
        for index, one in enumerate(contacts):
            count = len(one.motion.tracks.bodies)
            met = coo_array((np.ones(len(one)), tuple(one.bodies.T)), shape=(count, count))
            labels = connected_components(met, directed=False)[1]
            for label in np.unique(labels):
                members = [(index, int(k)) for k in np.flatnonzero(labels == label) if (index, int(k)) in place]
                places = [place[member] for member in members]
                centred = np.eye(len(members)) - 1 / max(len(members), 1)
                sd = np.sqrt(np.diag(centred @ own.covariance[np.ix_(places, places)] @ centred))
                known = {members[k]: float(own.values[places[k]]) for k in np.flatnonzero(sd < LARGEST_SD)}
                if len(known) > 1:
                    groups.append(known)
        return cls(tuple(groups))

    @property
    def logarithm(self) -> dict[tuple[int, int], float]:
        """Those of all groups together."""
        return {body: value for group in self.groups for body, value in group.items()}

    def membership(self, bodies: Sequence[tuple[int, int]]) -> Float[np.ndarray, "body group"]:
        """1 where a body is in a group, else 0."""
        found = np.array([[body in group for group in self.groups] for body in bodies], dtype=float)
        return found.reshape(len(bodies), len(self.groups))


@dataclass(frozen=True)
class BodyFrictions:
    """Frictions of single bodies, in units of what bodies of their kind share.

    Parameters
    ----------
    bodies
        The bodies.
    logarithm, covariance
        Logarithms of their frictions.
    sd
        Their standard deviations given what videos share.
    log_mass
        Logarithms of their masses in kg, or in units of those that they met where nobody stated all; not a number
        where unknown.
    weighed_together
        1 where only the ratio of a body's mass to those of a group is known, a column for each group.
    """

    bodies: tuple[Body, ...]
    logarithm: Float[np.ndarray, "body"]
    covariance: Float[np.ndarray, "body body"]
    sd: Float[np.ndarray, "body"]
    log_mass: Float[np.ndarray, "body"]
    weighed_together: Float[np.ndarray, "body group"]

    @classmethod
    def of(cls, fit: SharedFit, contacts: Sequence[FittedContacts]) -> "BodyFrictions":
        """Those that are known well enough."""
        own = OwnValues.of(fit, FRICTION)
        keep = np.flatnonzero(own.sd < LARGEST_SD)
        owners = [own.bodies[k] for k in keep]
        bodies = tuple(contacts[video].motion.tracks.bodies[body] for video, body in owners)
        if all(body.mass is not None for body in bodies):
            log_mass, groups = np.log([body.mass or 1.0 for body in bodies]), np.zeros((len(bodies), 0))
        else:
            masses = FittedMasses.of(fit, contacts)
            log_mass = np.array([masses.logarithm.get(one, np.nan) for one in owners])
            groups = masses.membership(owners)
        covariance = own.covariance[np.ix_(keep, keep)]
        return cls(bodies, own.values[keep], covariance, own.sd[keep], log_mass, groups)

    @property
    def largest_mass_ratio(self) -> float:
        """The heaviest body's mass in those of the lightest, where their ratio is known; 1 where none is."""
        known = np.isfinite(self.log_mass)
        groups = self.weighed_together.T > 0 if self.weighed_together.shape[1] else np.ones((1, len(known)), dtype=bool)
        spreads = [np.ptp(self.log_mass[known & group]) for group in groups if (known & group).any()]
        return float(np.exp(max(spreads, default=0.0)))
