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
    told = [one for index in range(len(fit.joint.videos)) if (one := _Told.of(fit, index, parameter)) is not None]
    believed = fit.model.believed(parameter)
    prior = believed.prior
    if sum(one.count for one in told) < FEWEST:
        return believed

    def cost(log_sd: float) -> float:
        middle = _middle(told, log_sd, prior) if mean else None
        return -sum(one.log_evidence(middle, float(np.exp(log_sd))) for one in told)

    bounds = (float(np.log(SMALLEST * parameter.prior.sd)), float(np.log(LARGEST * parameter.prior.sd)))
    log_sd = float(minimize_scalar(cost, bounds=bounds, method="bounded").x)
    learned = replace(prior, sd=float(np.exp(log_sd)))
    if not mean:
        return replace(believed, prior=learned)
    middle = _middle(told, log_sd, prior)
    return replace(believed, prior=replace(learned, mean=middle), default=parameter.transform.to_value(middle))


@dataclass(frozen=True)
class _Told:
    """What the tracks of one video alone say of the values of its bodies (in the inferred coordinate).

    Parameters
    ----------
    precision, pull
        The log likelihood of values v is -v' precision v / 2 + pull' v.
    expected
        What the prior expects of each.
    count
        Number of combinations of bodies of which the tracks tell something.
    """

    precision: Float[np.ndarray, "body body"]
    pull: Float[np.ndarray, "body"]
    expected: Float[np.ndarray, "body"]
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
        return cls(alone, both @ local.centre[chosen] - believed * expected, expected, count)

    def log_evidence(self, middle: float | None, sd: float) -> float:
        """Log probability (nats, up to a constant) of the tracks where values spread by `sd` around a middle."""
        expected = self.expected if middle is None else np.full(len(self.expected), middle)
        both = self.precision + np.eye(len(expected)) / sd**2
        pull = self.pull + expected / sd**2
        squares = float(expected @ expected) / sd**2 - float(pull @ np.linalg.solve(both, pull))
        return -len(expected) * float(np.log(sd)) - float(np.linalg.slogdet(both)[1]) / 2 - squares / 2


def _middle(told: Sequence[_Told], log_sd: float, prior: Prior) -> float:
    """Most probable middle of bodies that spread by a standard deviation around it."""
    variance = float(np.exp(2 * log_sd))
    weight = variance / prior.sd**2
    pull = weight * prior.mean
    for one in told:
        ones = np.ones(len(one.pull))
        shares = np.linalg.solve(one.precision + np.eye(len(ones)) / variance, np.stack([ones, one.pull], axis=1))
        weight += len(ones) - float(ones @ shares[:, 0]) / variance
        pull += float(ones @ shares[:, 1])
    return pull / weight
