"""What the modes of a fit propose: one curved cloud each, weighted by the evidence under it."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.samplers.contact_ridges import ContactRidge
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.mixture import Mixture
from vrdp_prob.inference.samplers.straightening import Rates, Straightening, straight_gaussian
from vrdp_prob.inference.search.least_squares import Residuals

HOPELESS = 12.0
"""A mode whose evidence (nats) is so much lower than the best one's is left out."""
MOST_MODES = 6
"""So many of the best modes at most, since each has to be explored."""
LEAST_WEIGHT = 0.02
"""Weight that every other mode is proposed with at least, since the evidence of a Gaussian is a guess."""


Ridges = Callable[[Float[np.ndarray, "dimension"]], Sequence[ContactRidge]]
"""Ridges of the contacts in the world of a mode; see `contact_ridges`."""


def proposals(
    modes: Sequence[Mode], residuals: Residuals, rates: Rates | None = None, ridges: Ridges | None = None
) -> Mixture:
    """A curved Gaussian around every mode, weighted by Laplace evidence, its ridges straightened.

    Only the best modes; see `share_left_out`.

    Parameters
    ----------
    modes
        The modes.
    residuals
        What falls off around them.
    rates
        Rates of slowing down, along which ridges are made straight; None for none.
    ridges
        Ridges of contacts that are made straight where that helps; None for none.
    """
    ranked, evidence = _ranked(modes)
    kept = [mode for mode, share in zip(ranked[:MOST_MODES], evidence, strict=False) if share > np.exp(-HOPELESS)]
    clouds = [_cloud(mode, residuals, rates, ridges) for mode in kept]
    shares = evidence[: len(kept)] / evidence[: len(kept)].sum()
    return Mixture.of(*clouds, log_weights=np.log(np.maximum(shares, LEAST_WEIGHT)))


def share_left_out(modes: Sequence[Mode]) -> float:
    """Share of the Laplace evidence under modes that nothing is proposed from, since there are too many."""
    _, evidence = _ranked(modes)
    return float(evidence[MOST_MODES:].sum() / evidence.sum())


def _ranked(modes: Sequence[Mode]) -> tuple[list[Mode], Float[np.ndarray, "mode"]]:
    """Modes, the best first, and their evidence in units of the best one's."""
    ranked = sorted(modes, key=lambda mode: -mode.log_evidence)
    return ranked, np.exp([mode.log_evidence - ranked[0].log_evidence for mode in ranked])


def _cloud(mode: Mode, residuals: Residuals, rates: Rates | None, ridges: Ridges | None) -> CurvedGaussian:
    gaussian, straightening = Gaussian.from_precision(mode.point, mode.precision), None
    if rates is not None:
        gaussian = straight_gaussian(mode, rates, np.random.default_rng(0))
        straightening = Straightening.of(mode, rates)
    found = () if ridges is None else ridges(mode.point)
    helpful = [ridge for ridge in found if ridge.helps(gaussian, residuals)]
    return CurvedGaussian.around(gaussian, residuals, straightening, helpful)
