"""Whether what the fit found of single bodies depends on what they are, or on how fast they met.

Restitution and friction of single bodies are unknowns of the fit. So a law that the model lacks hides in them: each
body's fitted value follows its speed, its material or its mass. The values are regressed on these; the bodies' own
scatter is estimated beside it, and the F test needs no replications.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.special import expit

from vrdp_prob.discovery.checks.flight import SEEN
from vrdp_prob.discovery.checks.scatter_regression import Dependence, dependence
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight import FRICTION, NORMAL_95
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.words import number, opposite
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.parameters import MASS, RESTITUTION, Prior
from vrdp_prob.scene import Body, Shape

REBOUND = "restitution against approach speed"
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
    values, covariance
        The most probable logarithms where next to nothing was believed of them, given what videos share.
    bodies
        Video and body that each belongs to.
    """

    values: Float[np.ndarray, "number"]
    covariance: Float[np.ndarray, "number number"]
    bodies: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, fit: SharedFit, field: str) -> "OwnValues":
        """Those of a fit."""
        values, blocks, bodies = [], [], []
        for index, video in enumerate(fit.joint.videos):
            local = fit.joint.gaussian.locals[index]
            entries = [video.likelihood.coordinates.entries[place] for place in video.local_places]
            mine = [k for k, entry in enumerate(entries) if entry.field == field and entry.owner is not None]
            root = local.root[mine]
            believed = np.array([1 / entries[k].prior.sd ** 2 for k in mine])
            expected = np.array([entries[k].prior.mean for k in mine])
            edge, curvature = _edges([entries[k].prior for k in mine], local.centre[mine])
            both = np.linalg.inv(root @ root.T) - np.diag(curvature)
            own, directions = np.linalg.eigh(both - np.diag(believed))
            alone = (directions / (np.maximum(own, 0.0) + 1 / OPEN**2)) @ directions.T
            pull = both @ (local.centre[mine] - expected) + edge
            values += (expected + alone @ pull).tolist()
            blocks.append(alone)
            bodies += [(index, int(entries[k].owner or 0)) for k in mine]
        covariance = np.zeros((len(values), len(values)))
        first = 0
        for block in blocks:
            covariance[first : first + len(block), first : first + len(block)] = block
            first += len(block)
        return cls(np.array(values), covariance, tuple(bodies))


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
    closing_speed
        Speeds in m/s at which they met; the geometric mean where they did so several times.
    owners
        Which bodies' factors are in which product.
    """

    logarithm: Float[np.ndarray, "pair"]
    covariance: Float[np.ndarray, "pair pair"]
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
        covariance = rows @ own.covariance @ rows.T
        known = np.flatnonzero(np.diag(covariance) < LARGEST_SD**2)
        return cls((rows @ own.values)[known], covariance[np.ix_(known, known)], np.array(speeds)[known], rows[known])


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


def friction_against(what: str) -> str:
    """Name of the check of what bodies rub by."""
    return f"friction of the bodies against {what}"


def body_checks(fit: SharedFit, model: ResidualModel) -> Iterator[Check]:
    """All checks of fitted values of single bodies."""
    contacts = [FittedContacts.of(video.motion) for video in model.videos]
    yield from _restitution_check(Rebounds.of(fit, contacts))
    yield from _friction_checks(fit, contacts)


def _restitution_check(rebounds: Rebounds) -> Iterator[Check]:
    speed = np.log(rebounds.closing_speed)
    known = np.ones((len(speed), 1))
    found = dependence(rebounds.logarithm, rebounds.covariance, rebounds.owners, known, speed[:, None])
    if found is None:
        return
    slope, sd = float(found.slope[0]), float(found.sd[0])
    slow, fast = np.exp(np.quantile(speed, [0.1, 0.9]))
    middle = float(np.exp(np.average(rebounds.logarithm)))
    low, high = (middle * (v / np.exp(speed.mean())) ** slope for v in (slow, fast))
    sentence = (
        f"Restitution {opposite(slope, 'falls', 'grows')} with the approach speed: {number(low)} at {number(slow)} "
        f"m/s, {number(high)} at {number(fast)} m/s."
        if found.p_value < SEEN
        else f"Nothing seen; a power of {number(NORMAL_95 * sd)} of the approach speed would have shown."
    )
    yield Check(REBOUND, slope, found.p_value, False, sentence)


def _friction_checks(fit: SharedFit, contacts: Sequence[FittedContacts]) -> Iterator[Check]:
    own = OwnValues.of(fit, FRICTION)
    keep = np.flatnonzero(np.diag(own.covariance) < LARGEST_SD**2)
    if not len(keep):
        return
    bodies = [contacts[video].motion.tracks.bodies[body] for video, body in (own.bodies[k] for k in keep)]
    rolls = np.array([body.shape is Shape.SPHERE for body in bodies])
    known = np.stack([rolls, ~rolls], axis=1).astype(float)
    known = known[:, known.any(axis=0)]

    covariance = own.covariance[np.ix_(keep, keep)]

    def asked(columns: Sequence[Float[np.ndarray, "number"]]) -> Dependence | None:
        return dependence(own.values[keep], covariance, np.eye(len(keep)), known, np.stack(columns, axis=1))

    materials = sorted({body.material for body in bodies if body.material is not None})
    if len(materials) > 1:
        found = asked([_indicator(bodies, material) for material in materials[1:]])
        yield from _friction_check("material", found, _material_words(found, materials))
    if {Shape.CUBE, Shape.CYLINDER} <= {body.shape for body in bodies}:
        found = asked([np.array([float(body.shape is Shape.CUBE) for body in bodies])])
        yield from _friction_check("shape", found, f"that of cubes is {_more(found)} than that of cylinders")
    if all(body.mass is not None for body in bodies):
        found = asked([np.log([body.mass or 1.0 for body in bodies])])
    else:
        masses = FittedMasses.of(fit, contacts)
        logarithm = masses.logarithm
        rows = [row for row, k in enumerate(keep) if own.bodies[k] in logarithm]
        chosen = [own.bodies[keep[row]] for row in rows]
        beside = np.concatenate([masses.membership(chosen), known[rows]], axis=1)
        found = dependence(
            own.values[keep[rows]],
            covariance[np.ix_(rows, rows)],
            np.eye(len(rows)),
            _independent_columns(beside),
            np.array([logarithm[one] for one in chosen]).reshape(-1, 1),
        )
    power = 0.0 if found is None else float(found.slope[0])
    visible = "" if found is None else f"a power of {number(NORMAL_95 * float(found.sd[0]))} of the mass"
    yield from _friction_check("mass", found, f"it goes with the mass to the power {number(power)}", visible)


def _friction_check(name: str, found: Dependence | None, words: str, visible: str = "") -> Iterator[Check]:
    if found is None:
        return
    visible = visible or f"{number(100 * NORMAL_95 * float(found.sd.max()))} %"
    sentence = (
        f"The fitted friction of the bodies depends on their {name}: {words}."
        if found.p_value < SEEN
        else f"Nothing seen; {visible} would have shown."
    )
    yield Check(friction_against(name), float(found.slope[0]), found.p_value, False, sentence)


def _independent_columns(columns: Float[np.ndarray, "number column"]) -> Float[np.ndarray, "number independent"]:
    """Columns without those that are sums of earlier ones."""
    rank = np.linalg.matrix_rank
    kept = [k for k in range(columns.shape[1]) if rank(columns[:, : k + 1]) > rank(columns[:, :k])]
    return columns[:, kept]


def _indicator(bodies: Sequence[Body], material: str) -> Float[np.ndarray, "number"]:
    return np.array([float(body.material == material) for body in bodies])


def _material_words(found: Dependence | None, materials: Sequence[str]) -> str:
    slopes = [] if found is None else found.slope.tolist()
    return ", ".join(
        f"that of {name} is {number(100 * abs(np.expm1(slope)))} % {opposite(slope, 'smaller', 'larger')} than that of "
        f"{materials[0]}"
        for name, slope in zip(materials[1:], slopes, strict=False)
    )


def _more(found: Dependence | None) -> str:
    slope = 0.0 if found is None else float(found.slope[0])
    return f"{number(100 * abs(float(np.expm1(slope))))} % {opposite(slope, 'smaller', 'larger')}"
