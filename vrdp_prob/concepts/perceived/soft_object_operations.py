"""Soft forms of the operations on objects."""

import torch
from jaxtyping import Float
from torch import Tensor

from vrdp_prob.concepts.perceived.soft_forms import SoftRun, normalised, only, soft_form_of
from vrdp_prob.concepts.perceived.soft_values import SoftMoment, SoftObjectRef, SoftObjectSet
from vrdp_prob.reasoning import object_operations
from vrdp_prob.reasoning.values import Word


@soft_form_of(object_operations.objects)
def objects(run: SoftRun) -> SoftObjectSet:
    """All objects of the video."""
    return SoftObjectSet(torch.ones(run.facts.bodies, dtype=torch.double))


@soft_form_of(object_operations.filter_color)
def filter_color(run: SoftRun, chosen: SoftObjectSet, color: Word) -> SoftObjectSet:
    """Product with the probability of the colour."""
    return _with_attribute(run, chosen, "color", color)


@soft_form_of(object_operations.filter_material)
def filter_material(run: SoftRun, chosen: SoftObjectSet, material: Word) -> SoftObjectSet:
    """Product with the probability of the material."""
    return _with_attribute(run, chosen, "material", material)


@soft_form_of(object_operations.filter_shape)
def filter_shape(run: SoftRun, chosen: SoftObjectSet, shape: Word) -> SoftObjectSet:
    """Product with the probability of the shape."""
    return _with_attribute(run, chosen, "shape", shape)


@soft_form_of(object_operations.filter_moving)
def filter_moving(run: SoftRun, chosen: SoftObjectSet, moment: SoftMoment) -> SoftObjectSet:
    """Product with the probability to move at that moment."""
    return SoftObjectSet(chosen.probability * _at(run, moment, run.facts.motion.moving))


@soft_form_of(object_operations.filter_stationary)
def filter_stationary(run: SoftRun, chosen: SoftObjectSet, moment: SoftMoment) -> SoftObjectSet:
    """Product with the probability to be in view and not to move at that moment."""
    motion = run.facts.motion
    return SoftObjectSet(chosen.probability * _at(run, moment, motion.in_view - motion.moving))


@soft_form_of(object_operations.filter_ever_moving)
def filter_ever_moving(run: SoftRun, chosen: SoftObjectSet, any_frame: Word) -> SoftObjectSet:
    """Product with the highest probability to move in any frame: neighbouring frames are no independent looks."""
    del any_frame
    return SoftObjectSet(chosen.probability * run.facts.motion.moving.amax(dim=0))


@soft_form_of(object_operations.filter_never_moving)
def filter_never_moving(run: SoftRun, chosen: SoftObjectSet, any_frame: Word) -> SoftObjectSet:
    """Product with the probability to be in view at some time and to move at none."""
    del any_frame
    motion = run.facts.motion
    return SoftObjectSet(chosen.probability * motion.in_view.amax(dim=0) * (1 - motion.moving.amax(dim=0)))


@soft_form_of(object_operations.unique)
def unique_object(run: SoftRun, chosen: SoftObjectSet) -> SoftObjectRef:
    """The only object, given that there is exactly one: a softmax over the log odds to be in the set."""
    alone = only(chosen.probability)
    run.require(alone.sum())
    return SoftObjectRef(normalised(alone))


def _with_attribute(run: SoftRun, chosen: SoftObjectSet, name: str, word: Word) -> SoftObjectSet:
    return SoftObjectSet(chosen.probability * run.facts.attribute(name, word.text))


def _at(run: SoftRun, moment: SoftMoment, table: Float[Tensor, "frame body"]) -> Float[Tensor, "body"]:
    """What a table says at a moment that is not known for sure."""
    return moment.probability @ table[run.facts.motion.frames(moment.time)]
