"""Everything that a joint fit can be asked about what it leaves unexplained."""

import numpy as np

from vrdp_prob.discovery.checks.bodies import body_checks
from vrdp_prob.discovery.checks.contacts import contact_checks
from vrdp_prob.discovery.checks.false_discovery import controlled
from vrdp_prob.discovery.checks.flight import free_flight_checks
from vrdp_prob.discovery.checks.measurement import measurement_checks
from vrdp_prob.discovery.checks.replications import REPLICATIONS
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.inference.several_videos.fitting import SharedFit


def run_checks(fit: SharedFit, *, seed: int) -> tuple[Check, ...]:
    """Test what a joint fit leaves unexplained, in free flight, at contacts, in single bodies and in the measurement.

    Parameters
    ----------
    fit
        The fit.
    seed
        Seed of the replications.

    Returns
    -------
    All checks that these videos allow, the most significant first. A p-value is that of replications of the fitted
    model: noise of the fitted family and scale, less what the fit absorbs of it. What is believed beforehand of shared
    numbers pulls at neither. Where a statistic is linear or quadratic in the residuals its law is known, which stands
    for endlessly many replications; elsewhere there are a few hundred, and beyond their reach the tail of a fitted
    normal or chi-square law. A check is significant by the false discovery rate over all of them (Benjamini and
    Hochberg, 5 %).
    """
    model = ResidualModel.of(fit).without_beliefs
    generator = np.random.default_rng(seed)
    flight = FreeFlight.of(model)
    replicas, beside = (one.replicas(REPLICATIONS, generator) for one in (model, flight.beside))
    return controlled(
        [
            *free_flight_checks(flight),
            *contact_checks(model, flight, beside),
            *body_checks(fit, model),
            *measurement_checks(model, replicas, flight, beside, generator),
        ]
    )
