"""Compiled event loop: the earliest of releases, piece ends and contacts, one after the other."""

import math
from typing import NamedTuple

import numpy as np

from vrdp_prob.models.simulator.detection_kernel import CRAWL, SLACK
from vrdp_prob.models.simulator.laws_kernel import GROUP_SIZE, STATE_SIZE, compiled, contact_law
from vrdp_prob.models.simulator.motion_kernel import (
    CONTINUES,
    STOPS,
    advance,
    evaluate,
    settle,
)
from vrdp_prob.models.simulator.search_kernel import depth, search
from vrdp_prob.models.simulator.tape_kernel import (
    CONTACT,
    CONTINUE,
    RELEASE,
    SPIN_STOP,
    STOP,
    add_piece,
    add_row,
)

OK, OVERLAP, EVENT_LIMIT, NOT_SOLVED, NOT_FINITE, TAPE_FULL = 0, 1, 2, 3, 4, 5
RESULT_SIZE = 16


class Track(NamedTuple):
    """Where the output goes, and the rows of the tape that are current."""

    times: np.ndarray  # [time]
    states: np.ndarray  # [time, body, state]
    frame: np.ndarray  # [body], next frame to write
    row: np.ndarray  # [group], row of the current piece
    result: np.ndarray  # [RESULT_SIZE], of the last contact
    ya: np.ndarray  # [state]
    yb: np.ndarray  # [state]


@compiled
def write_frames(motion_state, tape, track, group, until, last):
    """Write the frames that the current piece of a group covers, up to a time (the last piece: all)."""
    h = motion_state.length[group]
    row = track.row[group]
    for slot in range(GROUP_SIZE):
        body = group * GROUP_SIZE + slot
        if not motion_state.alive[body]:
            continue
        frame = track.frame[body]
        tape.integers[row, 5] = frame
        while frame < track.times.shape[0] and (last or track.times[frame] < until):
            share = (track.times[frame] - motion_state.origin[group]) / h
            evaluate(motion_state.polynomial[group], slot, share, track.states[frame, body])
            frame += 1
        track.frame[body] = frame
        tape.integers[row, 6] = frame


@compiled
def leave_piece(motion_state, tape, track, group, t):
    """Finish the current piece of a group at a time and put its state there into the constant term."""
    write_frames(motion_state, tape, track, group, t, False)
    share = (t - motion_state.origin[group]) / motion_state.length[group]
    for slot in range(GROUP_SIZE):
        evaluate(motion_state.polynomial[group], slot, share, motion_state.work[slot])
    for slot in range(GROUP_SIZE):
        phase = motion_state.phase[group * GROUP_SIZE + slot]
        for c in range(STATE_SIZE):
            motion_state.polynomial[group, 0, slot, c] = motion_state.work[slot, c]
        if phase[0] == 0.0:
            motion_state.polynomial[group, 0, slot, 3:5] = 0.0
        if phase[3] == 0.0:
            motion_state.polynomial[group, 0, slot, 5] = 0.0


@compiled
def begin_piece(scene, motion_state, pairs, tape, track, group, t, horizon):
    """Start a piece of a group from its constant term and look for the contacts of its bodies."""
    if not advance(scene, motion_state, group, t, horizon):
        return False
    track.row[group] = add_piece(tape, motion_state, group)
    search_group(scene, motion_state, pairs, group, t, horizon)
    return True


@compiled
def search_group(scene, motion_state, pairs, group, t, horizon):
    """Search the contacts of all bodies of a group with all others from a time on."""
    for body in range(group * GROUP_SIZE, (group + 1) * GROUP_SIZE):
        for other in range(scene.shape.shape[0]):
            if other != body and (other // GROUP_SIZE != group or other > body):
                search_pair(scene, motion_state, pairs, body, other, t, horizon)


@compiled
def search_pair(scene, motion_state, pairs, body, other, t, horizon):
    """Search the next contact of two bodies while both current pieces hold."""
    i, j = min(body, other), max(body, other)
    pairs.time[i, j] = math.inf
    if not (motion_state.alive[i] and motion_state.alive[j]):
        return
    first, second = motion_state.phase[i], motion_state.phase[j]
    if first[0] == 0.0 and second[0] == 0.0 and first[3] == 0.0 and second[3] == 0.0:
        return
    end = min(motion_state.until[i // GROUP_SIZE], motion_state.until[j // GROUP_SIZE], horizon)
    search(scene, motion_state, pairs, i, j, t, end)


@compiled
def release(scene, motion_state, pairs, tape, track, body, horizon):
    """Let a body into the world; returns an outcome."""
    t = scene.release[body]
    group = body // GROUP_SIZE
    slot = body - group * GROUP_SIZE
    before = track.row[group]
    if before >= 0:
        leave_piece(motion_state, tape, track, group, t)
    for c in range(STATE_SIZE):
        motion_state.polynomial[group, 0, slot, c] = scene.start[body, c]
    motion_state.alive[body] = 1
    while track.frame[body] < track.times.shape[0] and track.times[track.frame[body]] < t:
        track.frame[body] += 1
    settle(scene, motion_state, body, t, motion_state.polynomial[group, 0, slot])
    motion_state.step[group] = horizon
    add_row(tape, RELEASE, body, -1, before, -1, t)
    outcome = OK
    motion_state.polynomial[group, 1:] = 0.0
    motion_state.origin[group], motion_state.length[group] = t, 1.0
    for other in range(scene.shape.shape[0]):
        if other != body and motion_state.alive[other] and not (scene.fixed[body] and scene.fixed[other]):
            i, j = min(body, other), max(body, other)
            if depth(scene, motion_state, pairs, i, j, t) < -SLACK:
                pairs.overlapping[i, j] = 1
                outcome = OVERLAP
    if not begin_piece(scene, motion_state, pairs, tape, track, group, t, horizon):
        return NOT_SOLVED
    return outcome


@compiled
def end_piece(scene, motion_state, pairs, tape, track, group, horizon):
    """Go on where a piece of motion ends: with the next piece, or with rest."""
    t = motion_state.until[group]
    ending, body = motion_state.ending[group], motion_state.ending_body[group]
    before = track.row[group]
    leave_piece(motion_state, tape, track, group, t)
    if ending == CONTINUES:
        add_row(tape, CONTINUE, group, -1, before, -1, t)
    else:
        y = motion_state.polynomial[group, 0, body - group * GROUP_SIZE]
        if ending == STOPS:
            y[3], y[4] = 0.0, 0.0
            add_row(tape, STOP, body, -1, before, -1, t)
        else:
            y[5] = 0.0
            add_row(tape, SPIN_STOP, body, -1, before, -1, t)
        tape.count[1] += 1
        settle(scene, motion_state, body, t, y)
    return OK if begin_piece(scene, motion_state, pairs, tape, track, group, t, horizon) else NOT_SOLVED


@compiled
def evaluate_at(motion_state, body, t, out):
    """State of a body at a time in its current piece."""
    group = body // GROUP_SIZE
    share = (t - motion_state.origin[group]) / motion_state.length[group]
    evaluate(motion_state.polynomial[group], body - group * GROUP_SIZE, share, out)


@compiled
def collide(scene, motion_state, pairs, tape, track, i, j, horizon):
    """Resolve the contact of a pair."""
    t = pairs.time[i, j]
    kind = pairs.kind[i, j]
    a = pairs.owner[i, j]
    b = i + j - a
    evaluate_at(motion_state, a, t, track.ya)
    evaluate_at(motion_state, b, t, track.yb)
    feature = pairs.feature[i, j]
    contact_law(kind, track.ya, track.yb, scene.body[a], scene.body[b], feature, scene.shared, track.result)
    if not track.result[6] > 0.0:
        search_pair(scene, motion_state, pairs, i, j, t + CRAWL, horizon)
        return OK
    group_a, group_b = a // GROUP_SIZE, b // GROUP_SIZE
    row = add_row(tape, CONTACT, a, b, track.row[group_a], track.row[group_b], t)
    tape.integers[row, 5] = kind
    tape.numbers[row, 1:7] = feature
    tape.numbers[row, 7:14] = track.result[6:13]
    tape.count[1] += 1
    if not scene.fixed[a]:
        leave_piece(motion_state, tape, track, group_a, t)
    if not scene.fixed[b] and group_b != group_a:
        leave_piece(motion_state, tape, track, group_b, t)
    for side in range(2):
        body = b if side else a
        if not scene.fixed[body]:
            group = body // GROUP_SIZE
            y = motion_state.polynomial[group, 0, body - group * GROUP_SIZE]
            for c in range(3):
                y[3 + c] = track.result[3 * side + c]
            settle(scene, motion_state, body, t, y)
    # Both groups are in their new state before either looks for contacts with the other.
    fine = True
    if not scene.fixed[a]:
        fine = advance(scene, motion_state, group_a, t, horizon)
        track.row[group_a] = add_piece(tape, motion_state, group_a)
    if not scene.fixed[b] and group_b != group_a:
        fine = advance(scene, motion_state, group_b, t, horizon) and fine
        track.row[group_b] = add_piece(tape, motion_state, group_b)
    if not scene.fixed[a]:
        search_group(scene, motion_state, pairs, group_a, t, horizon)
    if not scene.fixed[b] and group_b != group_a:
        search_group(scene, motion_state, pairs, group_b, t, horizon)
    return OK if fine else NOT_SOLVED


@compiled
def reset(scene, motion_state, pairs, tape, track):
    """Nothing released, nothing written; before its release a body shows the state it is released with."""
    motion_state.alive[:] = 0
    motion_state.phase[:] = 0.0
    motion_state.polynomial[:] = 0.0
    motion_state.length[:] = 1.0
    motion_state.until[:] = math.inf
    pairs.time[:] = math.inf
    pairs.overlapping[:] = 0
    tape.count[:] = 0
    track.row[:] = -1
    track.frame[:] = 0
    for frame in range(track.times.shape[0]):
        for body in range(scene.shape.shape[0]):
            for c in range(STATE_SIZE):
                track.states[frame, body, c] = scene.start[body, c]


@compiled
def next_event(scene, motion_state, pairs):
    """Time, kind (0 release, 1 piece end, 2 contact) and participants of the earliest event."""
    count = scene.shape.shape[0]
    time, kind, first, second = math.inf, -1, -1, -1
    for body in range(count):
        if scene.present[body] and not motion_state.alive[body] and scene.release[body] < time:
            time, kind, first = scene.release[body], 0, body
    for group in range(count // GROUP_SIZE):
        if motion_state.until[group] < time:
            time, kind, first = motion_state.until[group], 1, group
    for i in range(count):
        for j in range(i + 1, count):
            if pairs.time[i, j] < time:
                time, kind, first, second = pairs.time[i, j], 2, i, j
    return time, kind, first, second


@compiled
def rollout_world(scene, motion_state, pairs, tape, track, event_limit):
    """Simulate one world; returns an outcome."""
    reset(scene, motion_state, pairs, tape, track)
    horizon = track.times[-1]
    outcome, now = OK, horizon
    while True:
        time, kind, first, second = next_event(scene, motion_state, pairs)
        if not time <= horizon or (kind == 1 and time >= horizon):
            break
        if tape.count[0] + 8 > tape.integers.shape[0]:
            return TAPE_FULL
        if tape.count[1] >= event_limit:
            outcome, now = EVENT_LIMIT, time
            break
        if kind == 0:
            result = release(scene, motion_state, pairs, tape, track, first, horizon)
        elif kind == 1:
            result = end_piece(scene, motion_state, pairs, tape, track, first, horizon)
        else:
            result = collide(scene, motion_state, pairs, tape, track, first, second, horizon)
        if result == NOT_SOLVED:
            outcome, now = NOT_SOLVED, time
            break
        outcome = max(outcome, result)
    return finish(motion_state, tape, track, outcome, now)


@compiled
def finish(motion_state, tape, track, outcome, now):
    """Write the frames that are left; where the simulation broke off, bodies are shown where they were then."""
    broken = outcome in (EVENT_LIMIT, NOT_SOLVED)
    for group in range(track.row.shape[0]):
        if track.row[group] >= 0:
            write_frames(motion_state, tape, track, group, now, not broken)
    if broken:
        for body in range(track.frame.shape[0]):
            if motion_state.alive[body]:
                for frame in range(track.frame[body], track.times.shape[0]):
                    evaluate_at(motion_state, body, now, track.states[frame, body])
    return outcome
