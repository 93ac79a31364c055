"""From a posterior and its answers to the content of a report."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, UInt8

from vrdp_prob import __version__
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.values import MASS_FACTOR
from vrdp_prob.report.asked import world_of
from vrdp_prob.report.content import AnswerContent, ReportContent, WorldContent, WorldKind
from vrdp_prob.report.footage import footage
from vrdp_prob.report.rollouts import world_content

PLAYER_DRAWS = 30
"""Posterior draws that the player shows."""

MOST_FRAMES = 500
"""Most moments of a world that travel inside the page; longer recordings are thinned."""

FUTURE_SECONDS = 58 / 25
"""How long after the last frame the future is shown: the 58 frames that CLEVRER's predictive questions ask about."""


def build(
    posterior: Posterior,
    answers: Sequence[Answer],
    *,
    frames: UInt8[np.ndarray, "frame height width 3"] | None = None,
    draws: int = PLAYER_DRAWS,
) -> ReportContent:
    """Collect what a report says.

    Parameters
    ----------
    posterior
        What was learned.
    answers
        The answers, in the order asked.
    frames
        Pictures of the video (red, green, blue) at the tracks' frame rate from time 0, where there is a video.
    draws
        Number of posterior draws that the player shows, evenly spaced over the posterior.
    """
    tracks = posterior.tracks
    return ReportContent(
        tracks=tracks,
        objects=tuple(posterior.object_summary(body.id) for body in tracks.bodies),
        mass_ratios=posterior.mass_ratios(),
        restitution_pairs=posterior.restitution_pairs(),
        convergence=posterior.convergence,
        warnings=posterior.warnings,
        answers=tuple(AnswerContent(answer, world_of(answer, tracks.bodies)) for answer in answers),
        worlds=player_worlds(posterior, draws),
        model=posterior.model.name,
        effects=tuple(effect.name for effect in posterior.model.effects),
        seed=posterior.seed,
        version=__version__,
        footage=None if frames is None else footage(frames, tracks),
    )


def player_worlds(posterior: Posterior, draws: int = PLAYER_DRAWS) -> tuple[WorldContent, ...]:
    """The video, its future, and the video with each body removed, heavier and lighter, for some posterior draws."""
    worlds = posterior.worlds(draws)
    seen = _thinned(posterior.tracks.times)
    frame = float(np.median(np.diff(seen)))
    after = seen[-1] + frame * np.arange(1, round(FUTURE_SECONDS / frame) + 1)
    shown = [
        _shown(posterior, worlds, seen, WorldKind.FACTUAL),
        _shown(posterior, worlds, np.concatenate([seen, after]), WorldKind.FUTURE),
    ]
    for kind in (WorldKind.REMOVED, WorldKind.HEAVIER, WorldKind.LIGHTER):
        for index, body in enumerate(posterior.tracks.bodies):
            shown.append(_shown(posterior, _changed(worlds, kind, index), seen, kind, body.id))
    return tuple(world for world in shown if world is not None)


def _thinned(times: Float[np.ndarray, "time"]) -> Float[np.ndarray, "kept"]:
    """Evenly chosen times, the first and the last among them."""
    count = min(len(times), MOST_FRAMES)
    return times[np.linspace(0, len(times) - 1, count).round().astype(int)]


def _changed(worlds: Worlds, kind: WorldKind, body: int) -> Worlds:
    if kind is WorldKind.REMOVED:
        return worlds.without(body)
    return worlds.with_mass_factor(body, MASS_FACTOR if kind is WorldKind.HEAVIER else 1 / MASS_FACTOR)


def _shown(
    posterior: Posterior, worlds: Worlds, times: np.ndarray, kind: WorldKind, body: str | None = None
) -> WorldContent | None:
    with torch.no_grad():
        rollout = simulate(worlds, torch.from_numpy(times.copy()), posterior.model)
    return world_content(rollout, kind, body)
