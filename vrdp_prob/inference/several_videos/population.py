"""How far apart the bodies of all videos are in a quantity that each has of its own (empirical Bayes).

Source: Robbins, An empirical Bayes approach to statistics, Proc. Third Berkeley Symposium (1956); with errors of the
single estimates: Morris, Parametric empirical Bayes inference, JASA 78 (1983).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar

from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.parameters import MASS, RESTITUTION, Parameter, Prior, Scope
from vrdp_prob.models.physics import PhysicsModel

FEWEST = 6
"""Bodies (or combinations of bodies) of which the tracks must tell the quantity, for their spread to be estimated."""
SMALLEST, LARGEST = 0.02, 2.0
"""Standard deviations that are looked at, as shares of the stated one..."""
TELLING = 0.5
"""...and the share of its variance below which the tracks tell a quantity."""


def with_learned_population(fit: SharedFit) -> PhysicsModel:
    """The model, believing of the bodies' own parameters that the bodies of any video are like those of all videos.

    It is learned how far apart bodies are, of restitutions their middle, too: that of masses cannot be seen, and that
    of other parameters is a shared one. A parameter of which too few bodies tell something keeps its prior.
    """
    beliefs = dict(fit.model.beliefs)
    for parameter in own_parameters(fit.model):
        beliefs[parameter.name] = with_learned_spread(fit, parameter, mean=parameter.name == RESTITUTION.name)
    return replace(fit.model, beliefs=beliefs)


def own_parameters(model: PhysicsModel) -> tuple[Parameter, ...]:
    """What each body has of its own, as it is stated before anything is learned."""
    stated = replace(model, beliefs={}).parameters
    return (MASS, RESTITUTION, *(one for one in stated if one.scope is Scope.BODY))


def with_learned_spread(fit: SharedFit, parameter: Parameter, *, mean: bool = False) -> Parameter:
    """A parameter of bodies whose prior is as wide as the bodies of all videos differ in it.

    Parameters
    ----------
    fit
        Fit of the videos.
    parameter
        The parameter as it is stated; a spread that was learned before is no limit to the new one.
    mean
        Whether the middle of the bodies is learned, too.
    """
    told = _told(fit, parameter)
    believed = fit.model.believed(parameter)
    if not told:
        return believed

    def cost(log_sd: float) -> float:
        sd = float(np.exp(log_sd))
        middle = _middle(told, sd, parameter.prior) if mean else None
        return -sum(one.log_evidence(middle, sd) for one in told)

    bounds = (float(np.log(SMALLEST * parameter.prior.sd)), float(np.log(LARGEST * parameter.prior.sd)))
    log_sd = float(minimize_scalar(cost, bounds=bounds, method="bounded").x)
    learned = replace(believed.prior, sd=float(np.exp(log_sd)))
    if not mean:
        return replace(believed, prior=learned)
    middle = float(_with_middle(fit, told, learned.sd, parameter.prior).mean[-1])
    return replace(believed, prior=replace(learned, mean=middle), default=parameter.transform.to_value(middle))


def shared_sd(fit: SharedFit) -> Float[np.ndarray, "shared"]:
    """Standard deviation of each number that videos share, where the middle of restitutions is unknown, too.

    A fit takes it to be what it has learned. What makes all bodies rebound more, or less, is known no better than it.
    """
    parameter = next(one for one in own_parameters(fit.model) if one.name == RESTITUTION.name)
    told = _told(fit, parameter)
    if not told:
        return fit.joint.gaussian.sd
    covariance = _with_middle(fit, told, fit.model.believed(parameter).prior.sd, parameter.prior).covariance
    moving = fit.joint.gaussian.root
    return np.sqrt(np.einsum("ij,jk,ik->i", moving, covariance[:-1, :-1], moving))


@dataclass(frozen=True)
class _Told:
    """What the tracks of one video alone say of the values of its bodies (in the inferred coordinate).

    Parameters
    ----------
    precision, pull
        Given the shared numbers, the log likelihood of values v is -v' precision v / 2 + pull' v.
    expected, believed
        What the prior of the fit expects of each, and with what precision.
    centre, slope
        Where the fit has them, and how that moves with standard normal coordinates of the shared numbers.
    count
        Number of combinations of bodies of which the tracks tell something.
    """

    precision: Float[np.ndarray, "body body"]
    pull: Float[np.ndarray, "body"]
    expected: Float[np.ndarray, "body"]
    believed: Float[np.ndarray, "body"]
    centre: Float[np.ndarray, "body"]
    slope: Float[np.ndarray, "body shared"]
    count: int

    @classmethod
    def of(cls, fit: SharedFit, index: int, parameter: Parameter) -> "_Told | None":
        """None where the video has no body with that unknown."""
        video, local = fit.joint.videos[index], fit.joint.gaussian.locals[index]
        entries = [video.likelihood.coordinates.entries[place] for place in video.local_places]
        chosen = [number for number, entry in enumerate(entries) if entry.field == parameter.name]
        if not chosen:
            return None
        # Given the shared numbers: a shared friction that is not sharp shifts all bodies alike, which is no spread.
        root = local.root[chosen]
        both = np.linalg.inv(root @ root.T)
        believed = np.array([1 / entries[number].prior.sd ** 2 for number in chosen])
        expected = np.array([entries[number].prior.mean for number in chosen])
        values, vectors = np.linalg.eigh(both - np.diag(believed))
        alone = (vectors * np.maximum(values, 0.0)) @ vectors.T
        count = int((values > (1 / TELLING - 1) / parameter.prior.sd**2).sum())
        pull = both @ local.centre[chosen] - believed * expected
        slope = local.slope[chosen] @ fit.joint.gaussian.root
        return cls(alone, pull, expected, believed, local.centre[chosen], slope, count)

    def log_evidence(self, middle: float | None, sd: float) -> float:
        """Log probability (nats, up to a constant) of the tracks where values spread by `sd` around a middle."""
        expected = self.expected if middle is None else np.full(len(self.expected), middle)
        both = self.precision + np.eye(len(expected)) / sd**2
        pull = self.pull + expected / sd**2
        squares = float(expected @ expected) / sd**2 - float(pull @ np.linalg.solve(both, pull))
        return -len(expected) * float(np.log(sd)) - float(np.linalg.slogdet(both)[1]) / 2 - squares / 2

    def of_middle(self, sd: float) -> tuple[float, float]:
        """Precision and pull of the middle around which values spread by `sd`, given the shared numbers."""
        ones = np.ones(len(self.pull))
        both = self.precision + np.eye(len(ones)) / sd**2
        precision, pull = ones @ np.linalg.solve(both, np.stack([self.precision @ ones, self.pull], axis=1)) / sd**2
        return float(precision), float(pull)


def _told(fit: SharedFit, parameter: Parameter) -> list[_Told]:
    """What each video tells of its bodies; nothing where too few bodies are told of."""
    told = [one for index in range(len(fit.joint.videos)) if (one := _Told.of(fit, index, parameter)) is not None]
    return told if sum(one.count for one in told) >= FEWEST else []


def _middle(told: Sequence[_Told], sd: float, prior: Prior) -> float:
    """Most probable middle of bodies that spread by a standard deviation around it, given the shared numbers."""
    tells = [(prior.sd**-2, prior.mean / prior.sd**2), *(one.of_middle(sd) for one in told)]
    return sum(pull for _, pull in tells) / sum(precision for precision, _ in tells)


@dataclass(frozen=True)
class _Joint:
    """The Gaussian of the shared numbers, as standard normal coordinates of the fit, and of a middle of bodies, last.

    Parameters
    ----------
    mean, covariance
        Its mean and covariance.
    """

    mean: Float[np.ndarray, "number"]
    covariance: Float[np.ndarray, "number number"]


def _with_middle(fit: SharedFit, told: Sequence[_Told], sd: float, prior: Prior) -> _Joint:
    """Shared numbers and the middle of bodies that spread by a standard deviation around it, all bodies integrated out.

    What all bodies share may do what the middle does: a restitution that falls from a higher speed on is a higher
    restitution. Given one the other is known far too well, and turn by turn they do not come to where both are best.
    """
    count = len(fit.joint.gaussian.mean)
    precision = np.diag(np.append(np.ones(count), prior.sd**-2))
    pull = np.append(np.zeros(count), prior.mean / prior.sd**2)
    for one in told:
        # A quadratic in the values, whose prior of the fit is replaced; written without differences of large numbers.
        width, alone = np.eye(len(one.pull)) / sd**2, one.of_middle(sd)
        narrower = width - np.diag(one.believed)
        moved = np.linalg.solve(one.precision + width, (one.precision + np.diag(one.believed)) @ one.slope)
        cross = -moved.sum(axis=0) / sd**2
        precision[:-1, :-1] += one.slope.T @ narrower @ moved
        precision[:-1, -1] += cross
        precision[-1, :-1] += cross
        precision[-1, -1] += alone[0]
        pull[:-1] -= moved.T @ (narrower @ one.centre + one.believed * one.expected)
        pull[-1] += alone[1]
    covariance = np.linalg.inv(precision)
    return _Joint(covariance @ pull, covariance)
