"""Operations on objects: all objects, filters by attribute and motion, the only one, interventions on one."""

import numpy as np
from jaxtyping import Bool, Int

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.facts import NOT_STATED
from vrdp_prob.reasoning.naming import likely_name, number_word, uncertainties
from vrdp_prob.reasoning.operations import operation
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.tokens import ANY_FRAME, SHAPES
from vrdp_prob.reasoning.values import Moment, ObjectRef, ObjectSet, Word, noun_phrase
from vrdp_prob.scene.body import COLORS, MATERIALS


@operation("objects", gives=ObjectSet)
def objects(run: Run) -> ObjectSet:
    """All objects of the video."""
    return ObjectSet(np.ones((run.facts.draws, len(run.facts.bodies)), dtype=bool))


@operation("filter_color", ObjectSet, Word, gives=ObjectSet, words=COLORS)
def filter_color(run: Run, chosen: ObjectSet, color: Word) -> ObjectSet:
    """The objects of a colour."""
    return _with_attribute(run, chosen, "color", color)


@operation("filter_material", ObjectSet, Word, gives=ObjectSet, words=MATERIALS)
def filter_material(run: Run, chosen: ObjectSet, material: Word) -> ObjectSet:
    """The objects of a material."""
    return _with_attribute(run, chosen, "material", material)


@operation("filter_shape", ObjectSet, Word, gives=ObjectSet, words=SHAPES)
def filter_shape(run: Run, chosen: ObjectSet, shape: Word) -> ObjectSet:
    """The objects of a shape."""
    return _with_attribute(run, chosen, "shape", shape)


@operation("filter_moving", ObjectSet, Moment, gives=ObjectSet)
def filter_moving(run: Run, chosen: ObjectSet, moment: Moment) -> ObjectSet:
    """The objects that are in view and move at a frame."""
    in_view, moving = _motion_at(run, moment)
    return ObjectSet(chosen.mask & in_view & moving, ("moving", *chosen.words))


@operation("filter_moving", ObjectSet, Word, gives=ObjectSet, words=(ANY_FRAME,))
def filter_ever_moving(run: Run, chosen: ObjectSet, any_frame: Word) -> ObjectSet:
    """The objects that move in view at any time of the video."""
    del any_frame
    return ObjectSet(chosen.mask & run.facts.motion().moving.any(axis=1), ("moving", *chosen.words))


@operation("filter_stationary", ObjectSet, Moment, gives=ObjectSet)
def filter_stationary(run: Run, chosen: ObjectSet, moment: Moment) -> ObjectSet:
    """The objects that are in view and do not move at a frame."""
    in_view, moving = _motion_at(run, moment)
    return ObjectSet(chosen.mask & in_view & ~moving, ("stationary", *chosen.words))


@operation("filter_stationary", ObjectSet, Word, gives=ObjectSet, words=(ANY_FRAME,))
def filter_never_moving(run: Run, chosen: ObjectSet, any_frame: Word) -> ObjectSet:
    """The objects that are in view in the video and never move there."""
    del any_frame
    motion = run.facts.motion()
    mask = motion.in_view.any(axis=1) & ~motion.moving.any(axis=1)
    return ObjectSet(chosen.mask & mask, ("stationary", *chosen.words))


@operation("unique", ObjectSet, gives=ObjectRef)
def unique(run: Run, chosen: ObjectSet) -> ObjectRef:
    """The only object of a set; draws in which it does not have exactly one leave the question."""
    count = chosen.mask.sum(axis=1)
    run.require(
        count == 1,
        _refusal(run, chosen, count),
        _clauses(chosen, count),
        uncertainties(run.facts, chosen.mask[run.valid], chosen.words),
    )
    return ObjectRef(chosen.mask.argmax(axis=1), chosen.words)


def _with_attribute(run: Run, chosen: ObjectSet, name: str, word: Word) -> ObjectSet:
    labels = run.facts.attribute(name)
    for label in labels:
        if word.text not in label.names:
            told = ", ".join(value for value in label.names if value != NOT_STATED)
            raise InputError(f"nothing here tells which objects are {word.text}; the {name}s told are: {told}.")
    mask = np.stack([label.index == label.names.index(word.text) for label in labels], axis=1)
    return ObjectSet(chosen.mask & mask, (*chosen.words, word.text))


def _motion_at(run: Run, moment: Moment) -> tuple[Bool[np.ndarray, "draw body"], Bool[np.ndarray, "draw body"]]:
    motion = run.facts.motion()
    draws = np.arange(run.facts.draws)
    frame = motion.frame(np.where(np.isfinite(moment.time), moment.time, motion.times[0]))
    in_view: Bool[np.ndarray, "draw body"] = motion.in_view[draws % len(motion.in_view), frame]
    moving: Bool[np.ndarray, "draw body"] = motion.moving[draws % len(motion.moving), frame]
    return in_view, moving


def _refusal(run: Run, chosen: ObjectSet, count: Int[np.ndarray, "draw"]) -> str:
    """Why hardly a draw has exactly one object, by what is the matter in most of those that still make sense."""
    phrase, valid = noun_phrase(chosen.words), run.valid
    if np.sum(count[valid] == 0) >= np.sum(count[valid] > 1):
        names = ", ".join(likely_name(run.facts, place) for place in range(len(run.facts.bodies)))
        return f"there is no {phrase} in the video; its objects are: {names}."
    most = int(np.bincount(count[valid & (count > 1)]).argmax())
    fitting = np.flatnonzero(chosen.mask[np.flatnonzero(valid & (count == most))[0]])
    names = ", ".join(likely_name(run.facts, place) for place in fitting.tolist())
    return f"{number_word(most)} objects fit 'the {phrase}' ({names}); say which by its color, material or shape."


def _clauses(chosen: ObjectSet, count: Int[np.ndarray, "draw"]) -> list[tuple[Bool[np.ndarray, "draw"], str]]:
    phrase, several = noun_phrase(chosen.words), sorted(set(count[count > 1].tolist()))
    none = (count == 0, f"there is no {phrase}")
    return [none, *((count == number, f"there are {number_word(number)} {phrase}s") for number in several)]
