"""From a posterior and its answers to the content of a report."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import UInt8

from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.inference.prior_sensitivity import prior_sensitivity
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.vocabulary import ChangeWord, Vocabulary
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.report.asked import world_of
from vrdp_prob.report.content import AnswerContent, ReportContent
from vrdp_prob.report.footage import footage
from vrdp_prob.report.rollouts import player_worlds
from vrdp_prob.version import __version__

PLAYER_DRAWS = 30
"""Posterior draws that the player shows."""


def build(
    posterior: Posterior,
    answers: Sequence[Answer],
    *,
    worlds: PosteriorWorlds | None = None,
    frames: UInt8[np.ndarray, "frame height width 3"] | None = None,
    draws: int = PLAYER_DRAWS,
    words: Sequence[ChangeWord] = (),
    progress: ProgressDisplay | None = None,
) -> ReportContent:
    """Collect what a report says.

    Parameters
    ----------
    posterior
        What was learned.
    answers
        The answers, in the order asked.
    worlds
        The worlds that the answers were counted in; the player then shows the same ones.
    frames
        Pictures of the video (red, green, blue) at the tracks' frame rate from time 0, where there is a video.
    draws
        Number of posterior draws that the player shows, evenly spaced over the posterior.
    words
        Learned words; the player shows each body as they say, too.
    progress
        Told how far the work is.
    """
    tracks, vocabulary = posterior.tracks, Vocabulary.of(words)
    asked = tuple(AnswerContent.of(answer, world_of(answer, tracks.bodies, vocabulary)) for answer in answers)
    led_to = {item.world for item in asked if item.world is not None}
    few = PosteriorWorlds(posterior, draws=draws, progress=progress)
    return ReportContent(
        tracks=tracks,
        objects=tuple(posterior.object_summary(body.id) for body in tracks.bodies),
        mass_ratios=posterior.mass_ratios(),
        restitution_pairs=posterior.restitution_pairs(),
        convergence=posterior.convergence,
        warnings=posterior.warnings,
        answers=asked,
        worlds=player_worlds(few, asked=led_to, many=worlds, words=words),
        model=posterior.model.name,
        effects=tuple(effect.name for effect in posterior.model.effects),
        seed=posterior.seed,
        version=__version__,
        footage=None if frames is None else footage(frames, tracks),
        groups=posterior.groups,
        misfit=posterior.misfit,
        sensitivities=prior_sensitivity(posterior) if "log_prior" in posterior.data.children else (),
    )
