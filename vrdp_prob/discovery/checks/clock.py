"""Whether the clock is what the model believes: frames that are missing, and frames at uneven times."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import chi2

from vrdp_prob.discovery.checks.false_discovery import SEEN
from vrdp_prob.discovery.checks.replications import sum_p_value
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.look_elsewhere import anywhere, independent_places
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.words import number, opposite

LOST_FRAMES, SINGLE_FRAMES = "time stamps: lost frames", "time stamps: single frames"


@dataclass(frozen=True)
class LateFrames:
    """What each of some frames of one video says of its own lateness, or of that from it on.

    Parameters
    ----------
    frames
        The frames.
    gradient, information
        Derivative of the log density by the lateness (1/s), for residuals of unit variance, and the information.
    pulls
        Derivatives that noise alone leaves.
    dispersion
        Mean square of the residuals.
    """

    frames: Int[np.ndarray, "place"]
    gradient: Float[np.ndarray, "place"]
    information: Float[np.ndarray, "place"]
    pulls: Float[np.ndarray, "place replica"]
    dispersion: float

    @classmethod
    def of(
        cls, model: ResidualModel, index: int, noise: Float[np.ndarray, "residual replica"], *, lasting: bool
    ) -> "LateFrames":
        """Those of a video that tell anything.

        Parameters
        ----------
        model, index
            The residuals, and which video.
        noise
            What noise leaves of it.
        lasting
            Whether all later frames are as late.
        """
        rows = model.videos[index].late_frames()
        if lasting:
            rows = rows @ np.tril(np.ones((rows.shape[1], rows.shape[1])))
        scores, blocks = model.linear.scores_in(index, rows[:, :, None])
        whole = (rows**2).sum(axis=0)
        information = np.array([float(score.information[0, 0]) for score in scores])
        shown = np.flatnonzero((whole > 0) & (information > 1e-3 * whole))
        gradient = np.array([float(scores[k].gradient[0]) for k in shown]) / np.sqrt(model.dispersion)
        return cls(shown, gradient, information[shown], blocks[:, shown, 0].T @ noise, model.dispersion)

    @property
    def statistic(self) -> Float[np.ndarray, "place"]:
        """Chi-square of each, with one degree of freedom."""
        return self.gradient**2 / self.information

    @property
    def replicas(self) -> Float[np.ndarray, "place replica"]:
        """The same of noise alone."""
        return self.pulls**2 / self.information[:, None]

    @property
    def lateness(self) -> Float[np.ndarray, "place"]:
        """Most probable lateness in s."""
        return np.sqrt(self.dispersion) * self.gradient / self.information

    @property
    def sd(self) -> Float[np.ndarray, "place"]:
        """Its standard deviation in s."""
        return np.sqrt(self.dispersion / self.information)


def clock_checks(model: ResidualModel, replicas: Sequence[Float[np.ndarray, "_ replica"]]) -> Iterator[Check]:
    """All checks of the clock.

    Parameters
    ----------
    model
        The residuals, where all that acts in free flight and at contacts may show.
    replicas
        What noise leaves of each video beside that.
    """
    largest, jitter_replicas = (np.zeros(replicas[0].shape[1]) for _ in range(2))
    places, jitter = 0, 0.0
    strongest, where = (0.0, 0.0), ""
    squares, weights = 0.0, 0.0
    for index, (video, noise) in enumerate(zip(model.videos, replicas, strict=True)):
        motion = video.motion
        late, single = (LateFrames.of(model, index, noise, lasting=lasting) for lasting in (True, False))
        places += len(late.frames)
        largest = np.maximum(largest, late.replicas.max(axis=0, initial=0.0))
        jitter += float(single.statistic.sum())
        jitter_replicas += single.replicas.sum(axis=0)
        squares += float((single.gradient**2 - single.information).sum())
        weights += float((single.information**2).sum()) / model.dispersion
        if len(late.statistic) and late.statistic.max() > strongest[0]:
            best = int(late.statistic.argmax())
            strongest = float(late.statistic[best]), float(late.lateness[best])
            where = f"video {video.linear.name} from {number(float(motion.times[late.frames[best]]))} s on"
    p_value = anywhere(float(chi2.sf(strongest[0], 1)), independent_places(largest, 1, places))
    sentence = (
        f"All bodies jump {opposite(strongest[1], 'back', 'ahead')} along their paths together, as if frames were "
        f"missing: most in {where}, by {number(abs(strongest[1]))} s."
        if p_value < SEEN
        else "No jump of all bodies along their paths was seen."
    )
    yield Check(LOST_FRAMES, abs(strongest[1]), p_value, False, sentence)
    p_value = sum_p_value(jitter, jitter_replicas)
    spread = float(np.sqrt(max(squares, 0.0) / weights)) if weights else 0.0
    sentence = (
        f"Single frames come too early or too late for all bodies, by {number(spread)} s (standard deviation)."
        if p_value < SEEN
        else "No frame comes too early or too late for all bodies."
    )
    yield Check(SINGLE_FRAMES, spread, p_value, False, sentence)
