"""How far the simulation agrees, under every meaning of a word, with the answers about a video."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from vrdp_prob.concepts.physical.examples import prepared
from vrdp_prob.concepts.physical.hypotheses import MEANINGS
from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.chance import Seeded
from vrdp_prob.reasoning.changes import Change, Meaning, Shift
from vrdp_prob.reasoning.posterior_like import PosteriorLike
from vrdp_prob.reasoning.prepared import PreparedQuestion
from vrdp_prob.reasoning.timeline import WorldDraws
from vrdp_prob.reasoning.verdict import YES, verdicts
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.scene import Question
from vrdp_prob.scene.question import RIGHT

GROUPS = 10
"""Parts that the draws are counted in, so that leaving out one after the other tells the Monte Carlo error."""


@dataclass(frozen=True)
class Agreement:
    """How many answers about one video every meaning gets wrong; all its questions are asked of the same draws.

    Parameters
    ----------
    draws
        Number of posterior draws in which so many of the answers (the last axis, from none to all) are otherwise than
        was answered, for every meaning and in every group of draws.
    """

    draws: Int[np.ndarray, "meaning group wrong"]

    @property
    def answers(self) -> int:
        """Number of answers: one of a question, or one for each of its choices."""
        return self.draws.shape[2] - 1


class PassingWorlds(PosteriorWorlds):
    """Worlds of which only the latest change is kept: many are tried, each for a moment."""

    _latest: tuple[tuple[Change, int], WorldDraws] | None = None

    def counterfactual(self, change: Change, body: int) -> WorldDraws:
        """What happens when one object (by its place) is changed from the beginning."""
        if self._latest is None or self._latest[0] != (change, body):
            parts = [batch.simulated(change, body) for batch in self.batches]
            self._latest = (change, body), WorldDraws.joined(parts)
        return self._latest[1]


def agreements_of(
    word: str,
    posterior: PosteriorLike,
    lessons: Sequence[Sequence[Question]],
    *,
    draws: int,
    seed: int,
    advance: Callable[[float], None] | None = None,
) -> tuple[Agreement, ...]:
    """How far every meaning of a word agrees with the answers to questions about one video, for each of some lessons.

    All meanings are tried on the same draws with the same random numbers, so that they differ by what they mean alone.
    Masses and restitutions that a video does not tell are drawn from their prior: a default would be surer than the
    video.

    Parameters
    ----------
    word
        The word that the questions use.
    posterior
        What is known of the video.
    lessons
        Questions with their right answers; those of one lesson are taken together.
    draws
        Number of posterior draws.
    seed
        Seed of what the tracks leave open.
    advance
        Told of every meaning that was tried.

    Raises
    ------
    InputError
        If a question cannot be asked of this video; see `vrdp_prob.reasoning.ask`.
    """
    worlds = PassingWorlds(posterior, draws=draws, defaults="prior", chance=Seeded(seed))
    counted: list[list[Int[np.ndarray, "group wrong"]]] = [[] for _ in lessons]
    for shift in MEANINGS:
        for place, questions in enumerate(lessons):
            counted[place].append(_counts(worlds, questions, _change(word, shift)))
        if advance is not None:
            advance(1)
    return tuple(Agreement(np.stack(counts)) for counts in counted)


def _change(word: str, shift: Shift | None) -> Change:
    return Change(word, (Meaning(1.0, shift),))


def _counts(worlds: PosteriorWorlds, questions: Sequence[Question], change: Change) -> Int[np.ndarray, "group wrong"]:
    """Draws in which all questions make sense, by their group and by how many answers are otherwise."""
    parts = []
    for question in questions:
        try:
            parts.append(_disagreements(worlds, prepared(question, change)))
        except InputError as error:
            raise InputError(f"{worlds.posterior.tracks.video}, '{question.text}': {error}") from error
    disagree = np.concatenate([part for part, _ in parts], axis=1)
    valid = np.all([part for _, part in parts], axis=0)
    group = np.arange(len(valid)) * GROUPS // len(valid)
    counts = np.zeros((GROUPS, disagree.shape[1] + 1), dtype=np.int64)
    np.add.at(counts, (group[valid], disagree[valid].sum(axis=1)), 1)
    return counts


def _disagreements(
    worlds: PosteriorWorlds, asked: PreparedQuestion
) -> tuple[Bool[np.ndarray, "draw answer"], Bool[np.ndarray, "draw"]]:
    """Where the simulation answers otherwise than the example, and in which draws all its answers make sense."""
    judged = verdicts(worlds, asked)
    valid: Bool[np.ndarray, "draw"] = np.all([verdict.valid for verdict in judged], axis=0)
    if asked.options:
        right = [choice.answer == RIGHT for choice, _ in asked.options]
        wrong = [(verdict.codes == YES) != truth for verdict, truth in zip(judged, right, strict=True)]
        return np.stack(wrong, axis=1), valid
    (verdict,) = judged
    given = np.array(verdict.names)[verdict.codes]
    return (given != asked.question.answer)[:, None], valid
