"""How residuals bend around a mode, and by how much other coordinates have to give way to keep them small."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from vrdp_prob.inference.search.least_squares import Residuals

STEP = 0.5
"""Step of the second differences in standard deviations: large enough to see past kinks at contacts."""
BATCH = 200


@dataclass(frozen=True)
class SecondDifferences:
    """How residuals bend.

    Parameters
    ----------
    first_derivative
        Derivative along each coordinate.
    second_derivative
        Second derivative along each pair of coordinates.
    first, second
        The coordinates of each pair.
    """

    first_derivative: Float[np.ndarray, "coordinate residual"]
    second_derivative: Float[np.ndarray, "pair residual"]
    first: Int[np.ndarray, "pair"]
    second: Int[np.ndarray, "pair"]

    def displacement(
        self, along: Float[np.ndarray, "moving residual"]
    ) -> Float[np.ndarray, "coordinate coordinate moving"]:
        """Displacement of some coordinates, per product of any two, that keeps the residuals small.

        With J the derivative of the residuals along the moving coordinates, whitened so that J'J is the unit matrix,
        and H their second derivative along the two, it is -J'H.
        """
        count = len(self.first_derivative)
        tensor = np.zeros((count, count, len(along)))
        values = np.nan_to_num(-(self.second_derivative @ along.T))
        tensor[self.first, self.second] = tensor[self.second, self.first] = values
        return tensor


def second_differences(residuals: Residuals, count: int) -> SecondDifferences:
    """First and second derivatives of residuals along whitened coordinates, at their origin."""
    unit = np.eye(count)
    first, second = np.triu_indices(count)
    steps = np.concatenate([np.zeros((1, count)), STEP * unit, STEP * (unit[first] + unit[second])])
    batches = [steps[begin : begin + BATCH] for begin in range(0, len(steps), BATCH)]
    ahead, behind = (np.concatenate([residuals(sign * batch) for batch in batches]) for sign in (1.0, -1.0))
    even = (ahead + behind) / 2
    single, double = even[1 : count + 1], even[count + 1 :]
    return SecondDifferences(
        (ahead[1 : count + 1] - behind[1 : count + 1]) / (2 * STEP),
        (double - single[first] - single[second] + even[0]) / STEP**2,
        first,
        second,
    )
