"""How much of an answer's doubt comes from where: parameters, doubtful events, the model, the motion, or chaos."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Int

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.chance import Purpose
from vrdp_prob.reasoning.explanation.explanation import PRECISER, Shares
from vrdp_prob.reasoning.prepared import PreparedQuestion
from vrdp_prob.reasoning.verdict import Verdict, verdicts
from vrdp_prob.reasoning.worlds import PosteriorWorlds

_PARAMETERS: Mapping[Purpose, float] = {
    Purpose.FRICTION: 1.0,
    Purpose.LAST_FRICTION: 1.0,
    Purpose.MEANING: 1.0,
    Purpose.DEVIATION_SCALES: 1.0,
    Purpose.FORETOLD: 1.0,
}
_EVENTS: Mapping[Purpose, float] = {
    **_PARAMETERS,
    Purpose.CONTACTS: 1.0,
    Purpose.RESTS: 1.0,
    Purpose.ATTRIBUTES: 1.0,
}
_MODEL: Mapping[Purpose, float] = {**_EVENTS, Purpose.COURSES: 1.0}
_NEAR = 1 - PRECISER**-2
_MOTION: Mapping[Purpose, float] = {
    **_MODEL,
    **dict.fromkeys((Purpose.CONTACT_TIMES, Purpose.MOTION, Purpose.LAST_FLIGHT), _NEAR),
}
"""What twins share, more and more of it. Two draws of a normal quantity that is known k times as exactly as now have a
correlation of 1 - 1/k^2."""


DOUBTFUL = 0.02
"""An event of the video is in doubt if it happens in more than this share of the draws, and fails to in as many."""
FEWEST = 20
"""Draws that both twins answer, at least."""


class Twins:
    """The same worlds with more and more of what twins share; each is simulated when it is looked at.

    Parameters
    ----------
    worlds
        The worlds.
    asked
        The question.
    """

    def __init__(self, worlds: PosteriorWorlds, asked: PreparedQuestion) -> None:
        self._draws = worlds.effective_draws
        happens = worlds.events().happens.mean(axis=0)
        self._doubtful = bool(((happens > DOUBTFUL) & (happens < 1 - DOUBTFUL)).any())
        self._verdicts: list[Sequence[Verdict]] = [
            _verdicts(worlds.coupled(kept), asked) for kept in (_PARAMETERS, _EVENTS, _MODEL, _MOTION)
        ]

    def shares(self, place: int, codes: Int[np.ndarray, "draw"], valid: Bool[np.ndarray, "draw"]) -> Shares | None:
        """Shares of the doubt of an open question (place 0) or of a choice; None where hardly a twin could answer it.

        By pick-freeze (Sobol', Sensitivity estimates for nonlinear mathematical models, 1993; with the pooled mean of
        Janon et al., 2014): the answers of two draws that share one part of their causes and have the rest anew agree
        more often than by chance just as the shared part explains the answer's variance. For an answer of several
        values the variance is that of the vector of its indicators, 1 - sum of p^2, and the share is Cohen's kappa.

        Parameters
        ----------
        place
            Which choice.
        codes, valid
            Its answers, and where they make sense.
        """
        found, words = [], set[str]()
        for verdict_of_twins in self._verdicts:
            if not verdict_of_twins:
                return None
            twin = verdict_of_twins[place]
            both = valid & twin.valid
            if both.sum() < FEWEST:
                return None
            found.append(_kappa(codes[both], twin.codes[both]))
            words |= _uncertain_words(twin)
        kappa = np.clip([one for one, _ in found], 0, 1)
        shared = np.maximum.accumulate(kappa)
        scale = np.sqrt(max(len(codes) / self._draws, 1.0))
        error = scale * max(error for _, error in found)
        parameters, events, model, motion, chaos = np.diff(shared, prepend=0.0, append=1.0).tolist()
        if self._doubtful:
            # Draws on their own course decide the event themselves, so the two cannot be told apart.
            events, model = events + model, 0.0
        return Shares(parameters, events, model, motion, chaos, error, tuple(sorted(words)))


def _verdicts(worlds: PosteriorWorlds, asked: PreparedQuestion) -> Sequence[Verdict]:
    try:
        return verdicts(worlds, asked)
    except InputError:
        return ()


def _uncertain_words(verdict: Verdict) -> set[str]:
    changes = [world[0] for world in verdict.run.looked_at if not isinstance(world, str)]
    return {str(change) for change in changes if change.is_uncertain}


def _kappa(codes: Int[np.ndarray, "draw"], twin: Int[np.ndarray, "draw"]) -> tuple[float, float]:
    """Agreement of twins above chance, and its Monte Carlo standard error for given shares of the answers."""
    shares = np.bincount(np.concatenate([codes, twin])) / (2 * len(codes))
    by_chance = float((shares**2).sum())
    if by_chance >= 1:
        return 1.0, 0.0
    agree = codes == twin
    return (float(agree.mean()) - by_chance) / (1 - by_chance), float(
        agree.std() / np.sqrt(len(agree)) / (1 - by_chance)
    )
