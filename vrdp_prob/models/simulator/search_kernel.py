"""Compiled search for the next contact of a pair of bodies."""

import math

import numpy as np

from vrdp_prob.models.simulator.detection_kernel import (
    CRAWL,
    DISC,
    SLACK,
    SLOW,
    TOUCHING,
    WALL,
    add_path,
    bound,
    box_box,
    box_disc,
    disc_disc,
    plane_bound,
    walk,
)
from vrdp_prob.models.simulator.laws_kernel import compiled

CLEARING = 1e-3
"""Time in s between two looks at bodies that overlap."""


@compiled
def outer_radius(scene, body):
    """Radius of a circle around the body's centre that holds it."""
    radius = scene.body[body, 4]
    return radius * math.sqrt(2.0) if scene.shape[body] == 1 else radius


@compiled
def set_path(scene, motion_state, pairs, i, j, t, duration):
    """Relative motion of two bodies as polynomials of the share of `duration`."""
    pairs.path[:] = 0.0
    for c in range(2):
        add_path(motion_state, j, t, duration, 1.0, c, pairs.path[c])
        add_path(motion_state, i, t, duration, -1.0, c, pairs.path[c])
    if scene.shape[i] != DISC:
        add_path(motion_state, i, t, duration, 1.0, 2, pairs.path[2])
    if scene.shape[j] != DISC:
        add_path(motion_state, j, t, duration, 1.0, 2, pairs.path[3])


@compiled
def set_curvature(scene, pairs, i, j, curvature):
    """Bounds on the fall of the rate of the gap, in the frames of both bodies."""
    path = pairs.path
    acceleration, velocity, distance = plane_bound(path, 2), plane_bound(path, 1), plane_bound(path, 0)
    for own in range(2):
        spin, other = bound(path[2 + own], 1), bound(path[3 - own], 1)
        change, other_change = bound(path[2 + own], 2), bound(path[3 - own], 2)
        reach = outer_radius(scene, j if own == 0 else i)
        curvature[own] = acceleration + 2.0 * spin * velocity + (spin * spin + change) * distance
        curvature[own] += reach * ((spin + other) ** 2 + change + other_change)


@compiled
def look(scene, pairs, i, j, s, half, flat, curvature):
    """Gap, rate, certain step and features of a pair at one place; returns 0 point-point, 1 line-point, +2 if swapped."""
    if scene.shape[i] == DISC and scene.shape[j] == DISC:
        return disc_disc(pairs, s, half[0] + half[1], curvature[0])
    if scene.shape[i] == DISC:
        return 2 + box_disc(pairs, s, half[1], flat[1], half[0], True, curvature[1])
    if scene.shape[j] == DISC:
        return box_disc(pairs, s, half[0], flat[0], half[1], False, curvature[0])
    return box_box(pairs, s, half, flat, curvature)


@compiled
def certain_step(scene, pairs, i, j, duration):
    """Step along the overlap that passes no contact."""
    gap, rate = pairs.found[0], pairs.found[1]
    touching = gap <= TOUCHING
    if scene.shape[i] != DISC and scene.shape[j] != DISC:
        step = pairs.found[2]
    else:
        step = walk(max(gap, 0.0) + SLACK if touching else gap, rate, pairs.found[2])
    return max(step, CRAWL / duration) if touching else step


@compiled
def search(scene, motion_state, pairs, i, j, t, end):
    """Find the next contact of bodies i < j in [t, end] and store it; infinity where there is none."""
    pairs.time[i, j] = math.inf
    duration = end - t
    if not duration > 0.0:
        return
    set_path(scene, motion_state, pairs, i, j, t, duration)
    reach = outer_radius(scene, i) + outer_radius(scene, j)
    if math.hypot(pairs.path[0, 0], pairs.path[1, 0]) - plane_bound(pairs.path, 1) > reach:
        pairs.overlapping[i, j] = 0
        return
    curvature, half, flat = np.empty(2), np.empty(2), np.empty(2, np.bool_)
    set_curvature(scene, pairs, i, j, curvature)
    half[0], half[1] = scene.body[i, 4], scene.body[j, 4]
    flat[0], flat[1] = scene.shape[i] == WALL, scene.shape[j] == WALL
    s = 0.0
    while s <= 1.0:
        code = look(scene, pairs, i, j, s, half, flat, curvature)
        gap, rate = pairs.found[0], pairs.found[1] / duration
        if pairs.overlapping[i, j]:
            if gap >= 0.0:
                pairs.overlapping[i, j] = 0
            else:
                s += CLEARING / duration
            continue
        if gap <= TOUCHING and (rate < -SLOW or (gap <= -SLACK and rate < 0.0)):
            pairs.time[i, j] = t + s * duration
            pairs.kind[i, j] = code % 2
            pairs.owner[i, j] = j if code >= 2 else i
            pairs.feature[i, j] = pairs.candidate
            return
        s += certain_step(scene, pairs, i, j, duration)


@compiled
def depth(scene, motion_state, pairs, i, j, t):
    """Gap of two bodies at one time."""
    set_path(scene, motion_state, pairs, i, j, t, 1.0)
    curvature, half, flat = np.zeros(2), np.empty(2), np.empty(2, np.bool_)
    half[0], half[1] = scene.body[i, 4], scene.body[j, 4]
    flat[0], flat[1] = scene.shape[i] == WALL, scene.shape[j] == WALL
    look(scene, pairs, i, j, 0.0, half, flat, curvature)
    return pairs.found[0]
