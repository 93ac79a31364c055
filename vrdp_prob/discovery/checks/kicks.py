"""Kicks without a partner: sudden changes of a velocity away from contacts, looked for at every frame of every body."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.stats import chi2

from vrdp_prob.discovery.checks.false_discovery import SEEN
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.fitted_motion import REACH, FittedMotion, Kicks
from vrdp_prob.discovery.residuals.linear import Score
from vrdp_prob.discovery.residuals.look_elsewhere import anywhere, independent_places
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.words import number

KICK = "sudden change of velocity without a partner"
FEWEST_FRAMES = 4
"""Frames of a body before and after a kick without which it does not show."""
PLACES_AT_ONCE = 256
"""Frames of bodies at which kicks are looked for in one go: each needs room for all residuals of its video."""


@dataclass(frozen=True)
class KickPlaces:
    """Some places of one video at which a kick would show.

    Parameters
    ----------
    video
        Number of the video.
    frames, bodies
        Where.
    change
        Most probable changes of the velocity in m/s.
    information
        What is known of them, where residuals have unit variance.
    directions
        What is left of the kicks when the fit absorbs what it can.
    statistic
        Chi-square of each, with two degrees of freedom.
    """

    video: int
    frames: Int[np.ndarray, "place"]
    bodies: Int[np.ndarray, "place"]
    change: Float[np.ndarray, "place 2"]
    information: Float[np.ndarray, "place 2 2"]
    directions: Float[np.ndarray, "residual place 2"]
    statistic: Float[np.ndarray, "place"]

    def largest(self, noise: Float[np.ndarray, "residual replica"]) -> Float[np.ndarray, "replica"]:
        """The largest statistic that noise alone leaves."""
        count = len(self.frames)
        pulls = (self.directions.reshape(len(noise), -1).T @ noise).reshape(count, 2, -1)
        found: np.ndarray = (pulls * (np.linalg.inv(self.information) @ pulls)).sum(axis=1).max(axis=0)
        return found


def kick_places(model: ResidualModel) -> Iterator[KickPlaces]:
    """All places at which a kick would show, some at a time."""
    for index, video in enumerate(model.videos):
        frames, bodies = _allowed(video.motion)
        if not len(frames):
            continue
        for some in np.array_split(np.arange(len(frames)), math.ceil(len(frames) / PLACES_AT_ONCE)):
            kicks = Kicks.single(video.motion.times[frames[some]], bodies[some])
            rows = video.rows(video.motion.kicked(kicks)).reshape(video.linear.data, -1, 2)
            scores, blocks = model.linear.scores_in(index, rows)
            shown = [k for k, score in enumerate(scores) if score.degrees == 2 and _shows(score, rows[:, k])]
            if shown:
                yield KickPlaces(
                    index,
                    frames[some[shown]],
                    bodies[some[shown]],
                    np.array([scores[k].estimate for k in shown]),
                    np.array([scores[k].information for k in shown]),
                    blocks[:, shown],
                    np.array([scores[k].chi_square for k in shown]) / model.dispersion,
                )


_Told = tuple[Int[np.ndarray, "place"], Float[np.ndarray, "place 2"], Float[np.ndarray, "place 2 2"]]


@dataclass(frozen=True)
class KickScan:
    """How the velocity of one body would have to change at each frame, along its strongest change.

    Parameters
    ----------
    video, body
        Which body: that of the strongest change of all.
    times
        When, in s.
    change, sd
        Changes in m/s and their standard deviations.
    """

    video: int
    body: int
    times: Float[np.ndarray, "place"]
    change: Float[np.ndarray, "place"]
    sd: Float[np.ndarray, "place"]

    @classmethod
    def of(cls, model: ResidualModel) -> "KickScan | None":
        """That of the body that a kick explains best; None where no kick would show."""
        found: dict[tuple[int, int], list[_Told]] = {}
        strongest, owner, direction = -1.0, (0, 0), np.zeros(2)
        for places in kick_places(model):
            for body in np.unique(places.bodies).tolist():
                mine = places.bodies == body
                told = places.frames[mine], places.change[mine], places.information[mine]
                found.setdefault((places.video, body), []).append(told)
            best = int(places.statistic.argmax())
            if places.statistic[best] > strongest:
                strongest, owner = float(places.statistic[best]), (places.video, int(places.bodies[best]))
                direction = places.change[best] / max(float(np.linalg.norm(places.change[best])), 1e-300)
        if strongest < 0:
            return None
        video, body = owner
        frames, changes, information = (np.concatenate(parts) for parts in zip(*found[owner], strict=True))
        change = changes @ direction
        variance = np.einsum("i,pij,j->p", direction, np.linalg.inv(information), direction)
        sd = np.sqrt(model.dispersion * variance)
        return cls(video, body, model.videos[video].motion.times[frames], change, sd)


def kick_check(model: ResidualModel, replicas: Sequence[Float[np.ndarray, "_ replica"]]) -> Iterator[Check]:
    """The strongest sudden change of a velocity away from contacts.

    Parameters
    ----------
    model
        The residuals, where all that acts in free flight and at contacts may show.
    replicas
        What noise leaves of each video beside that.
    """
    best: tuple[float, KickPlaces, int] | None = None
    largest = np.zeros(replicas[0].shape[1])
    count = 0
    for places in kick_places(model):
        count += len(places.frames)
        strongest = int(places.statistic.argmax())
        if best is None or places.statistic[strongest] > best[0]:
            best = float(places.statistic[strongest]), places, strongest
        largest = np.maximum(largest, places.largest(replicas[places.video]))
    if best is None:
        return
    statistic, places, strongest = best
    p_value = anywhere(float(chi2.sf(statistic, 2)), independent_places(largest, 2, count))
    video = model.videos[places.video]
    size = float(np.linalg.norm(places.change[strongest]))
    name = video.motion.tracks.bodies[places.bodies[strongest]].id
    who = f"object {name} of video {video.linear.name}"
    when = f"at {video.motion.times[places.frames[strongest]]:.2f} s"
    sentence = (
        f"Without a partner in reach, {who} changes its velocity by {number(size)} m/s {when}."
        if p_value < SEEN
        else f"Nothing seen; the strongest was {number(size)} m/s, of {who} {when}."
    )
    yield Check(KICK, size, p_value, False, sentence)


def _allowed(motion: FittedMotion) -> tuple[Int[np.ndarray, "place"], Int[np.ndarray, "place"]]:
    """Frames and bodies at which a kick would show apart from contacts."""
    allowed = motion.moving & motion.tracks.seen & motion.restart[:, None]
    for body in range(allowed.shape[1]):
        seen = np.cumsum(motion.tracks.seen[:, body])
        allowed[:, body] &= (seen > FEWEST_FRAMES) & (seen <= seen[-1] - FEWEST_FRAMES)
        for time in motion.contact_times(body):
            allowed[np.abs(motion.times - time) < REACH * motion.frame_time, body] = False
    frames, bodies = np.nonzero(allowed)
    return frames, bodies


def _shows(score: Score, rows: Float[np.ndarray, "data 2"]) -> bool:
    """Whether a kick is not all but the same as something that the fit absorbs."""
    return bool(np.trace(score.information) > 1e-3 * float((rows**2).sum()))
