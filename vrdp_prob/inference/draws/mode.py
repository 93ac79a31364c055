"""One mode of a posterior: a point at which the density is highest around, and how it falls off there."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Mode:
    """A local maximum of the log posterior.

    Parameters
    ----------
    point
        Where it is.
    precision
        Gauss-Newton curvature of the negative log posterior there.
    log_density
        Log posterior (nats) there.
    """

    point: Float[np.ndarray, "dimension"]
    precision: Float[np.ndarray, "dimension dimension"]
    log_density: float

    @property
    def log_evidence(self) -> float:
        """Logarithm of the probability mass that the Gaussian of this curvature puts under the mode (Laplace).

        -inf where no world is possible.
        """
        if not np.isfinite(self.log_density):
            return -np.inf
        _, log_determinant = np.linalg.slogdet(self.precision)
        return self.log_density + (len(self.point) * np.log(2 * np.pi) - float(log_determinant)) / 2
