"""How the most probable values are looked for: in which stages, and by which optimiser."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from vrdp_prob.scene import Tracks


class Optimiser(StrEnum):
    """How a cost is lowered from a start."""

    GAUSS_NEWTON = "gauss_newton"
    """Levenberg-Marquardt on the residuals; one batch of worlds gives their derivative."""
    LBFGS = "lbfgs"
    """Quasi-Newton steps along the exact gradient, one world after the other."""


@dataclass(frozen=True)
class FitPlan:
    """Stages on the way to the most probable values. Source: Ding et al., NeurIPS 2021 (VRDP), section 3.4.

    Parameters
    ----------
    optimiser
        What refines a start in every stage.
    free_first
        Whether release states and friction are found first, from the frames before each body's first contact.
    windows
        Frames in which windows end before the whole video (the paper's curriculum is 40, 80), or a single number of
        frames by which they grow; no window but the whole video where empty.
    alternatives
        Whether several starts are tried: worlds drawn where a window brings something new, other explanations of
        contacts, fits grown anew where there was doubt. Without them there is one start and one mode.
    attempts
        Times that a fit is grown anew at most, where the first met several open yaws at once or is not plausible.
    yaws
        Whether, beside alternatives, other yaws and spins are looked for of cubes whose yaw nobody measured. Under a
        model that lacks something a wrong yaw may take its place.
    like_noise
        Residuals in units of the noise up to which no further yaws are looked for.
    """

    optimiser: Optimiser = Optimiser.GAUSS_NEWTON
    free_first: bool = False
    windows: int | tuple[int, ...] = 8
    alternatives: bool = True
    attempts: int = 5
    yaws: bool = True
    like_noise: float = 1.15

    def ends(self, tracks: Tracks) -> list[int]:
        """Frame counts of the windows, the whole video last."""
        count = len(tracks.times)
        first = int(np.argmax(tracks.seen.any(axis=1)))
        steps = range(self.windows, count, self.windows) if isinstance(self.windows, int) else self.windows
        return [*(first + step for step in steps if first + step < count), count]


ALL_AT_ONCE = FitPlan(windows=(), alternatives=False)
FREE_FIRST = FitPlan(free_first=True, windows=(), alternatives=False)
CURRICULUM = FitPlan(free_first=True, windows=(40, 80), alternatives=False)
GROWING = FitPlan(free_first=True, windows=8, alternatives=False)
IN_DOUBT = FitPlan(attempts=1, yaws=False)
"""For one of several videos under a model that may lack something: other videos show what, more attempts do not."""
TURNING = FitPlan(attempts=1)
"""For one of several videos under a model that explains the others."""
