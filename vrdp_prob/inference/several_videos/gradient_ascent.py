"""The way up to the most probable values of several videos by L-BFGS along the exact gradient.

Source: Ding et al., NeurIPS 2021 (VRDP), section 3.4, where friction and drag are found from K videos at once. All
numbers move together, in units of the Gaussian around the start; videos are derived one by one, so that memory holds
the graph of one video per processor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from vrdp_prob.inference.draws.samples import evaluate_with_gradient
from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.search.descent import FAILED
from vrdp_prob.inference.several_videos.arrow import ArrowGaussian
from vrdp_prob.inference.several_videos.ascent import smooth
from vrdp_prob.inference.several_videos.climb_state import EXPECTED, TOLERANCE, State
from vrdp_prob.inference.several_videos.joint_fit import JointFit, expand_all
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers

ROUNDS = 8
"""Searches, each in units of the Gaussian around the end of the one before, until one gains next to nothing..."""
ITERATIONS, MEMORY = 100, 20
"""...of so many steps at most, which remember so many before them..."""
LAST_STEP = TOLERANCE / 10
"""...and end with one that gains less than so many nats."""


@dataclass(frozen=True)
class _Whitened:
    """All numbers in units of a Gaussian, and the negative log density there.

    Parameters
    ----------
    numbers, videos
        What is fitted.
    gaussian
        The Gaussian; own numbers follow the shared ones in straight lines here.
    failed
        Cost (nats) of worlds one of which fails.
    """

    numbers: SharedNumbers
    videos: Sequence[LinkedVideo]
    gaussian: ArrowGaussian
    failed: float

    def places(
        self, whitened: Float[np.ndarray, "dimension"]
    ) -> tuple[Float[np.ndarray, "shared"], list[Float[np.ndarray, "_"]]]:
        """Shared numbers, and those of each video."""
        shared, *own = self._parts(whitened)
        departure = self.gaussian.root @ shared
        return self.gaussian.mean + departure, [
            local.centre + local.slope @ departure + local.root @ part
            for local, part in zip(self.gaussian.locals, own, strict=True)
        ]

    def cost(self, whitened: Float[np.ndarray, "dimension"]) -> tuple[float, Float[np.ndarray, "dimension"]]:
        """Negative log density (nats) and its gradient."""
        shared, locals_ = self.places(whitened)

        def derived(index: int) -> tuple[float, Float[np.ndarray, "dimension"]]:
            video = self.videos[index]
            values, gradients = evaluate_with_gradient(
                video.data.log_density, video.points(shared, locals_[index])[None]
            )
            return float(values[0]), gradients[0]

        found = in_parallel(derived, range(len(self.videos)))
        prior, slope = evaluate_with_gradient(self.numbers.log_density, shared[None])
        value = float(prior[0]) + sum(one for one, _ in found)
        if not np.isfinite(value):
            return self.failed, np.zeros_like(whitened)
        pull, rows = slope[0], []
        for video, local, (_, gradient) in zip(self.videos, self.gaussian.locals, found, strict=True):
            own = gradient[video.local_places]
            pull[video.shared_columns] += gradient[video.shared_places]
            pull += local.slope.T @ own
            rows.append(local.root.T @ own)
        return -value, -np.concatenate([self.gaussian.root.T @ pull, *rows])

    def _parts(self, whitened: Float[np.ndarray, "dimension"]) -> list[Float[np.ndarray, "_"]]:
        ends = np.cumsum([len(self.numbers), *(len(local.centre) for local in self.gaussian.locals)])
        return np.split(whitened, ends[:-1])


def climb_by_gradient(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    shared: Float[np.ndarray, "shared"],
    locals_: Sequence[Float[np.ndarray, "_"]],
) -> JointFit:
    """Climb the joint log posterior by L-BFGS; never ends lower than it began.

    Parameters
    ----------
    numbers, videos
        What is fitted.
    shared, locals_
        Where to begin.

    Raises
    ------
    ImpossibleStartError
        If a video has no world at the start.
    """
    state = State.at(videos, shared, locals_)
    value = state.total(numbers)
    if not np.isfinite(value):
        raise state.impossible(videos)
    slopes, ended = expand_all(numbers, videos, shared, locals_), False
    for _ in range(ROUNDS):
        gaussian = slopes.gaussian(shared, locals_, numbers.logarithms)
        units = _Whitened(numbers, videos, gaussian, FAILED - value)
        result = minimize(
            units.cost,
            np.zeros(gaussian.dimension),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": ITERATIONS, "maxcor": MEMORY, "ftol": LAST_STEP / max(abs(value), 1.0)},
        )
        gained = -float(result.fun) - value
        if gained > 0:
            value += gained
            shared, locals_ = units.places(result.x)
            slopes = expand_all(numbers, videos, shared, locals_)
        ended = gained < TOLERANCE
        if ended:
            break
    gaussian = slopes.gaussian(shared, locals_, numbers.logarithms)
    return JointFit(numbers, tuple(videos), gaussian, value, ended and smooth(slopes).expected_gain < EXPECTED)
