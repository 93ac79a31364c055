"""How models that were tried are compared: by what each predicts of videos that it is not fitted to."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.selection.trials import Trial

OUT_OF_REACH = 2.0
"""Gain, in those that are needed, by which a cause is ahead of others for none of them to be as probable as it is."""


def merit(trial: Trial, overdispersion: Float[np.ndarray, "video"] | None = None) -> float:
    """By which models are ordered: what they predict of left-out videos, less what their causes are believed less.

    Parameters
    ----------
    trial
        The model.
    overdispersion
        Of each video, by which what is predicted of it is divided; 1 where None.
    """
    predicted = trial.log_density if overdispersion is None else trial.log_density / overdispersion
    return float(predicted.sum()) + trial.log_prior


def gains(
    trial: Trial, base: Trial, overdispersion: Float[np.ndarray, "video"] | None = None
) -> Float[np.ndarray, "video"]:
    """Gain (nats) in the predictive density of each video, divided by its overdispersion."""
    difference = trial.log_density - base.log_density
    return difference if overdispersion is None else difference / overdispersion


def gain(trial: Trial, base: Trial, overdispersion: Float[np.ndarray, "video"] | None = None) -> tuple[float, float]:
    """Gain (nats) in the predictive density of all videos, and its standard error over videos.

    Parameters
    ----------
    trial, base
        The models.
    overdispersion
        Of each video; 1 where None.
    """
    difference = gains(trial, base, overdispersion)
    return float(difference.sum()), float(np.sqrt(len(difference)) * difference.std(ddof=1))


def weights(
    trials: Sequence[Trial],
    log_prior: Sequence[float],
    generator: np.random.Generator,
    *,
    overdispersion: Float[np.ndarray, "video"] | None = None,
    replications: int = 1000,
) -> Float[np.ndarray, "trial"]:
    """Probabilities of models by their predictive densities, with the videos drawn anew.

    Source: Yao, Vehtari, Simpson and Gelman, Using stacking to average Bayesian predictive distributions, Bayesian
    Analysis 13 (2018), pseudo-BMA+.
    """
    densities = np.array([trial.log_density for trial in trials])
    if overdispersion is not None:
        densities = densities / overdispersion
    shares = generator.dirichlet(np.ones(densities.shape[1]), size=replications) * densities.shape[1]
    totals = shares @ densities.T + np.asarray(log_prior)
    totals -= totals.max(axis=1, keepdims=True)
    found: np.ndarray = (np.exp(totals) / np.exp(totals).sum(axis=1, keepdims=True)).mean(axis=0)
    return found
