"""How open a distribution is."""

import numpy as np


def entropy(probabilities: np.ndarray) -> float:
    """Entropy in nats of a distribution given as an array of probabilities."""
    positive = probabilities[probabilities > 0]
    return float(max(0.0, -(positive * np.log(positive)).sum()))
