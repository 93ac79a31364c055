"""How right concepts are about the objects and the questions of videos whose truth is known."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from _clevrer_truth import true_facts
from scipy.optimize import linear_sum_assignment

from vrdp_prob.datasets.clevrer import read_annotation
from vrdp_prob.evaluation.judgement import judge
from vrdp_prob.perception import SeenObjects
from vrdp_prob.reasoning.facts import TableFacts
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.sight import Sight
from vrdp_prob.scene import Question, Tracks

ATTRIBUTES = ("color", "material", "shape")
DRAWS = 400
MATCHED = 0.5
"""Metres of mean distance within which a track belongs to an annotated object."""


@dataclass
class Score:
    """What was right, by name, and half the summed squared errors of the answers' probabilities."""

    right: dict[str, list[bool]] = field(default_factory=lambda: defaultdict(list))
    squared_errors: list[float] = field(default_factory=list)
    sure_of_material: list[bool] = field(default_factory=list)

    def share(self, name: str) -> float:
        """Share that is right."""
        return float(np.mean(self.right[name]))

    @property
    def brier(self) -> float:
        """Mean Brier score of the questions."""
        return float(np.mean(self.squared_errors))


def tracks_facts(tracks: Tracks) -> TableFacts:
    """A video with the attributes of its bodies, and events and motion as its tracks tell them."""
    video = SeenVideo(Sight(tracks), DRAWS)
    return TableFacts(tracks.bodies, video.events, video.motion, effective_draws=DRAWS)


@dataclass(frozen=True)
class Case:
    """A test video: folder of the data, number of the scene, what perception saw, and what is asked."""

    data: Path
    scene: int
    seen: SeenObjects
    asked: Sequence[Question]


def add_video(score: Score, case: Case, facts: TableFacts) -> None:
    """Compare the objects, the motion and the answers of one video with the truth."""
    truth = true_facts(case.data, case.scene)
    for place, true_place in _pairs(case):
        body, true = facts.bodies[place], truth.bodies[true_place]
        for name in ATTRIBUTES:
            shares = body.probabilities(name)
            best = max(shares, key=lambda value: shares[value])
            score.right[name].append(best == str(getattr(true, name)))
            if name == "material" and shares[best] >= 0.9:
                score.sure_of_material.append(best == true.material)
        there = np.asarray(facts.motion().in_view.all(axis=0))
        both = truth.motion().in_view[0, :, true_place] & there[:, place]
        moves = facts.motion().moving.mean(axis=0)[:, place] > 0.5
        score.right["moving"] += (moves[both] == truth.motion().moving[0, both, true_place]).tolist()
    for question in case.asked:
        judged = judge(case.seen.tracks.video, facts, question)
        score.right[judged.kind.value].append(judged.right)
        score.squared_errors.append(judged.squared_error)


def _pairs(case: Case) -> list[tuple[int, int]]:
    """Places of the objects of the tracks and of those of the annotation that they are, by their distance."""
    true = read_annotation(case.data / "annotations" / f"annotation_{case.scene:05d}.json")
    distance = np.linalg.norm(case.seen.tracks.positions[:, :, None] - true.positions[:, None], axis=-1)
    known = np.isfinite(distance)
    mean = np.where(known, distance, 0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    mean[~known.any(axis=0)] = np.inf
    rows, columns = linear_sum_assignment(np.minimum(mean, 10 * MATCHED))
    ids = [int(body.id) for body in true.bodies]
    return [(int(row), ids[column]) for row, column in zip(rows, columns, strict=True) if mean[row, column] < MATCHED]
