"""From how far the examples agree to a posterior over everything that a word may mean.

An answer is what the simulation of a draw says, except for a share of answers (the lapse) that are guessed: the
physics is not exact, and who answers errs. With a guessed answer right by chance in half of the cases, a draw that
disagrees with k of the n answers about its video has the likelihood (1 - lapse/2)^(n-k) (lapse/2)^k; that of the video
is its mean over the posterior draws. The lapse is unknown, the same for all videos, and integrated out by Gauss-Jacobi
quadrature, which is exact here up to 127 answers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp, roots_sh_jacobi

from vrdp_prob.concepts.physical.agreement import GROUPS, Agreement
from vrdp_prob.concepts.physical.hypotheses import meaning_prior

LAPSE_PRIOR = (1.0, 4.0)
"""Beta prior of the share of guessed answers: a fifth is expected, so that a tenth are otherwise than simulated."""

QUADRATURE_POINTS = 64


@dataclass(frozen=True)
class Weighing:
    """A posterior over meanings and lapse.

    Parameters
    ----------
    probability
        Posterior probability of every meaning.
    log_evidence
        Logarithm of the probability of all answers under every meaning, the lapse integrated out, less that of
        guessing.
    lapse, lapse_probability
        Shares of guessed answers, and their posterior probabilities.
    """

    probability: Float[np.ndarray, "meaning"]
    log_evidence: Float[np.ndarray, "meaning"]
    lapse: Float[np.ndarray, "lapse"]
    lapse_probability: Float[np.ndarray, "lapse"]

    @property
    def log_gain(self) -> float:
        """How much more probable (logarithm, nats) the answers are with the word than if all were guessed."""
        return float(logsumexp(self.log_evidence, b=meaning_prior()))


def weigh(agreements: Sequence[Agreement], *, without: int | None = None) -> Weighing:
    """The posterior.

    Parameters
    ----------
    agreements
        How far the answers about each video agree; without any the posterior is the prior.
    without
        A group of draws to leave out.
    """
    lapse, weights = _lapse_quadrature()
    groups = [group for group in range(GROUPS) if group != without]
    prior = meaning_prior()
    gain = np.zeros((len(prior), len(lapse)))
    for agreement in agreements:
        gain += _log_likelihood(agreement, groups, lapse) + agreement.answers * np.log(2)
    joint = gain + np.log(weights)
    log_evidence = logsumexp(joint, axis=1)
    posterior = _normalised(joint + np.log(prior)[:, None])
    return Weighing(posterior.sum(axis=1), log_evidence, lapse, posterior.sum(axis=0))


def jackknife_error(values: Sequence[float]) -> float:
    """Monte Carlo standard error of a number, from its values with one group of draws left out after the other."""
    left_out = np.asarray(values)
    return float(np.sqrt((len(left_out) - 1) * left_out.var()))


def _log_likelihood(
    agreement: Agreement, groups: list[int], lapse: Float[np.ndarray, "lapse"]
) -> Float[np.ndarray, "meaning lapse"]:
    draws, everywhere = agreement.draws[:, groups].sum(axis=1), agreement.draws.sum(axis=1)
    # a question that makes sense in few draws may make sense in one group alone
    draws = np.where(draws.sum(axis=1, keepdims=True) > 0, draws, everywhere)
    wrong = np.arange(agreement.answers + 1)[:, None]
    of_draw = (1 - lapse / 2) ** (agreement.answers - wrong) * (lapse / 2) ** wrong
    sensible = draws.sum(axis=1, keepdims=True)
    # where it makes sense in none, its answers can only have been guessed
    likelihood = np.where(sensible > 0, (draws / np.maximum(sensible, 1)) @ of_draw, 0.5**agreement.answers)
    return np.log(likelihood)


@cache
def _lapse_quadrature() -> tuple[Float[np.ndarray, "lapse"], Float[np.ndarray, "lapse"]]:
    """Nodes of the lapse, and their prior probabilities."""
    alpha, beta = LAPSE_PRIOR
    nodes, weights = roots_sh_jacobi(QUADRATURE_POINTS, alpha + beta - 1, alpha)
    return nodes, weights / weights.sum()


def _normalised(log_weights: Float[np.ndarray, "meaning lapse"]) -> Float[np.ndarray, "meaning lapse"]:
    return np.exp(log_weights - logsumexp(log_weights))
