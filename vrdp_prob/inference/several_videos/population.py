"""How far apart the bodies of all videos are in a quantity that each has of its own (empirical Bayes).

Source: Robbins, An empirical Bayes approach to statistics, Proc. Third Berkeley Symposium (1956); with errors of the
single estimates: Morris, Parametric empirical Bayes inference, JASA 78 (1983).
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar

from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.parameters import Parameter, Scope
from vrdp_prob.models.physics import PhysicsModel

FEWEST = 6
"""Bodies of which the tracks must tell the quantity, for their spread to be estimated."""
SMALLEST, LARGEST = 0.02, 2.0
"""Standard deviations that are looked at, as shares of the stated one (the smallest) and of itself."""
TELLING = 0.5
"""Share of the prior's variance below which the tracks tell a body's quantity."""


def with_learned_spreads(fit: SharedFit) -> PhysicsModel:
    """The model, believing that bodies differ in their own parameters as much as those of the videos do.

    A parameter of which too few bodies tell something keeps its prior.
    """
    model = fit.model
    beliefs = dict(model.beliefs)
    for parameter in model.parameters:
        if parameter.scope is Scope.BODY:
            beliefs[parameter.name] = _learned(fit, parameter)
    return replace(model, beliefs=beliefs)


def _learned(fit: SharedFit, parameter: Parameter) -> Parameter:
    values, variances = _estimates(fit, parameter)
    if len(values) < FEWEST:
        return parameter
    prior = parameter.prior

    def cost(log_sd: float) -> float:
        variance = np.exp(2 * log_sd) + variances
        return float((np.log(variance) + (values - prior.mean) ** 2 / variance).sum() / 2)

    bounds = (float(np.log(SMALLEST * prior.sd)), float(np.log(LARGEST * prior.sd)))
    found = minimize_scalar(cost, bounds=bounds, method="bounded").x
    return replace(parameter, prior=replace(prior, sd=float(np.exp(found))))


def _estimates(fit: SharedFit, parameter: Parameter) -> tuple[Float[np.ndarray, "body"], Float[np.ndarray, "body"]]:
    """What the tracks alone say of each body's value (in the inferred coordinate), and the variance of that."""
    values, variances = [], []
    joint, prior = fit.joint, parameter.prior
    for index, video in enumerate(joint.videos):
        entries, local = video.likelihood.coordinates.entries, joint.gaussian.locals[index]
        # Given the shared numbers: a shared friction that is not sharp shifts all bodies alike, which is no spread.
        own = (local.root**2).sum(axis=1)
        for number, place in enumerate(video.local_places):
            variance, value = float(own[number]), float(local.centre[number])
            if entries[place].field == parameter.name and variance < TELLING * prior.sd**2:
                alone = 1 / (1 / variance - prior.sd**-2)
                values.append(alone * (value / variance - prior.mean * prior.sd**-2))
                variances.append(alone)
    return np.array(values), np.array(variances)
