"""Compiled motion between events: one Runge-Kutta step of a group of bodies, and its polynomial."""

import math
from typing import NamedTuple

import numpy as np

from vrdp_prob.models.simulator.laws_kernel import GROUP_SIZE, STATE_SIZE, compiled, external, motion
from vrdp_prob.models.simulator.tableau import DENSE, ERRORS, NODES, WEIGHTS

TOLERANCE = 1e-11
"""Error of one step, in m, m/s, rad and rad/s."""
SMALLEST_STEP = 1e-12
"""Step in s below which the motion counts as not solvable."""
VANISHED = 1e-7
"""Speed in m/s across the direction of motion below which a body at its turning point rests."""
SLOWEST = 1e-10
"""Speed in m/s below which a body counts as resting, and with which it starts when a force moves it."""

CONTINUES, STOPS, SPIN_STOPS, ENDS = 0, 1, 2, 3


class Scene(NamedTuple):
    """What does not change while one world is simulated."""

    shape: np.ndarray  # [body], 0 disc, 1 square, 2 straight wall
    fixed: np.ndarray  # [body]
    body: np.ndarray  # [body, constant]
    shared: np.ndarray  # [parameter]
    start: np.ndarray  # [body, state]
    release: np.ndarray  # [body]
    present: np.ndarray  # [body]


class Motion(NamedTuple):
    """Current piece of motion of every group of bodies."""

    phase: np.ndarray  # [body, (moving, reference x, reference y, spin sense)]
    alive: np.ndarray  # [body]
    origin: np.ndarray  # [group], s
    length: np.ndarray  # [group], s
    until: np.ndarray  # [group], s, end of the piece's validity
    ending: np.ndarray  # [group], how the piece ends
    ending_body: np.ndarray  # [group], for whom
    step: np.ndarray  # [group], s, suggestion for the next step
    polynomial: np.ndarray  # [group, power, slot, state], in the share of `length`
    stages: np.ndarray  # [stage, slot, state]
    work: np.ndarray  # [slot, state]


@compiled
def derivatives(scene, motion_state, group, t, y, out):
    """Time derivative of all bodies of a group."""
    first = group * GROUP_SIZE
    for slot in range(GROUP_SIZE):
        phase = motion_state.phase[first + slot]
        if phase[0] == 0.0 and phase[3] == 0.0:
            out[slot, :] = 0.0
        else:
            motion(t, y[slot], phase, scene.body[first + slot], scene.shared, out[slot])


@compiled
def stage_state(stages, stage, start, h, out):
    """State at which a stage is evaluated."""
    for slot in range(GROUP_SIZE):
        for c in range(STATE_SIZE):
            total = 0.0
            for earlier in range(stage):
                total += WEIGHTS[stage, earlier] * stages[earlier, slot, c]
            out[slot, c] = start[slot, c] + h * total


@compiled
def compute_stages(scene, motion_state, group, t, h, begin, end):
    """Stages `begin` to `end` of a step from the state in the polynomial's constant term."""
    start = motion_state.polynomial[group, 0]
    for stage in range(begin, end):
        stage_state(motion_state.stages, stage, start, h, motion_state.work)
        derivatives(scene, motion_state, group, t + NODES[stage] * h, motion_state.work, motion_state.stages[stage])


@compiled
def step_error(stages, h):
    """Error of a step relative to the tolerance (Hairer's combination of two estimates)."""
    worst = 0.0
    for slot in range(GROUP_SIZE):
        for c in range(STATE_SIZE):
            third = 0.0
            fifth = 0.0
            for stage in range(12):
                third += ERRORS[0, stage] * stages[stage, slot, c]
                fifth += ERRORS[1, stage] * stages[stage, slot, c]
            scale = math.sqrt(fifth * fifth + 0.01 * third * third)
            if not math.isfinite(scale):
                return math.inf
            if scale > 0.0:
                worst = max(worst, abs(h) * fifth * fifth / (scale * TOLERANCE))
    return worst


@compiled
def set_polynomial(motion_state, group, h):
    """Turn the stages of a step into the polynomial of its motion."""
    for power in range(1, DENSE.shape[0]):
        for slot in range(GROUP_SIZE):
            for c in range(STATE_SIZE):
                total = 0.0
                for stage in range(DENSE.shape[1]):
                    total += DENSE[power, stage] * motion_state.stages[stage, slot, c]
                motion_state.polynomial[group, power, slot, c] = h * total


@compiled
def evaluate(polynomial, slot, share, out):
    """State of one body at a share of the step."""
    for c in range(STATE_SIZE):
        total = 0.0
        for power in range(polynomial.shape[0] - 1, -1, -1):
            total = total * share + polynomial[power, slot, c]
        out[c] = total


@compiled
def evaluate_rate(polynomial, slot, share, length, out):
    """Time derivative of the state of one body at a share of the step."""
    for c in range(STATE_SIZE):
        total = 0.0
        for power in range(polynomial.shape[0] - 1, 0, -1):
            total = total * share + power * polynomial[power, slot, c]
        out[c] = total / length


@compiled
def along(polynomial, slot, phase, share):
    """What vanishes when a moving body stops: its velocity along the reference direction."""
    total = 0.0
    for power in range(polynomial.shape[0] - 1, -1, -1):
        total = total * share + polynomial[power, slot, 3] * phase[1] + polynomial[power, slot, 4] * phase[2]
    return total


@compiled
def spin_along(polynomial, slot, phase, share):
    """What vanishes when a spinning body stops to spin."""
    total = 0.0
    for power in range(polynomial.shape[0] - 1, -1, -1):
        total = total * share + polynomial[power, slot, 5] * phase[3]
    return total


@compiled
def vanishing_share(polynomial, slot, phase, of_spin):
    """Share of the step at which `along` (or `spin_along`) falls to zero, by bisection to the last digit."""
    low, high = 0.0, 1.0
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return high
        value = spin_along(polynomial, slot, phase, middle) if of_spin else along(polynomial, slot, phase, middle)
        if value > 0.0:
            low = middle
        else:
            high = middle


@compiled
def settle(scene, motion_state, body, t, y):
    """Set the phase of a body from its state; a resting body stays while friction can hold it."""
    phase = motion_state.phase[body]
    phase[:] = 0.0
    if scene.fixed[body]:
        return
    push = np.empty(4)
    external(t, y, phase, scene.body[body], scene.shared, push)
    # What no friction holds at rest counts as moving with speed 0: its derivative by the velocity does not vanish.
    if abs(y[5]) > SLOWEST or push[3] == 0.0:
        phase[3] = math.copysign(1.0, y[5])
    else:
        y[5] = 0.0
    phase[0] = 1.0
    if y[3] * y[3] + y[4] * y[4] > SLOWEST * SLOWEST:
        return
    y[3], y[4] = 0.0, 0.0
    external(t, y, phase, scene.body[body], scene.shared, push)
    size = math.sqrt(push[0] * push[0] + push[1] * push[1])
    if size > push[2]:
        y[3], y[4] = SLOWEST * push[0] / size, SLOWEST * push[1] / size
    elif push[2] > 0.0:
        phase[0] = 0.0


@compiled
def first_step(motion_state, group, h):
    """Limit a step to a little more than the time in which friction stops the first body."""
    for slot in range(GROUP_SIZE):
        phase = motion_state.phase[group * GROUP_SIZE + slot]
        speed = phase[1] * phase[1] + phase[2] * phase[2]
        braking = -(motion_state.stages[0, slot, 3] * phase[1] + motion_state.stages[0, slot, 4] * phase[2])
        if phase[0] != 0.0 and braking > 0.0 and h * braking > 1.25 * speed:
            h = 1.25 * speed / braking
    return h


@compiled
def find_ending(motion_state, group, t, h):
    """Cut a step where a body of the group stops to move or to spin; False where the step has to be shorter."""
    polynomial = motion_state.polynomial[group]
    share = 1.0
    motion_state.ending[group] = CONTINUES
    for slot in range(GROUP_SIZE):
        body = group * GROUP_SIZE + slot
        phase = motion_state.phase[body]
        if phase[3] != 0.0 and spin_along(polynomial, slot, phase, 1.0) <= 0.0:
            root = vanishing_share(polynomial, slot, phase, True)
            if root < share or motion_state.ending[group] == CONTINUES:
                share = root
                motion_state.ending[group], motion_state.ending_body[group] = SPIN_STOPS, body
        if phase[1] * phase[1] + phase[2] * phase[2] > 0.0 and along(polynomial, slot, phase, 1.0) <= 0.0:
            root = vanishing_share(polynomial, slot, phase, False)
            if root < share or motion_state.ending[group] == CONTINUES:
                share = root
                motion_state.ending[group], motion_state.ending_body[group] = STOPS, body
    if motion_state.ending[group] == STOPS:
        slot = motion_state.ending_body[group] - group * GROUP_SIZE
        evaluate(polynomial, slot, share, motion_state.work[slot])
        across = math.sqrt(motion_state.work[slot, 3] ** 2 + motion_state.work[slot, 4] ** 2)
        if across > VANISHED:
            return share
    motion_state.until[group] = t + share * h
    return 0.0


@compiled
def set_references(motion_state, group):
    """Take the velocities at the start of a piece as reference directions."""
    for slot in range(GROUP_SIZE):
        phase = motion_state.phase[group * GROUP_SIZE + slot]
        if phase[0] != 0.0:
            phase[1] = motion_state.polynomial[group, 0, slot, 3]
            phase[2] = motion_state.polynomial[group, 0, slot, 4]


@compiled
def still(motion_state, group):
    """Whether no body of a group moves or spins."""
    for slot in range(GROUP_SIZE):
        phase = motion_state.phase[group * GROUP_SIZE + slot]
        if phase[0] != 0.0 or phase[3] != 0.0:
            return False
    return True


@compiled
def advance(scene, motion_state, group, t, horizon):
    """Compute the next piece of motion of a group from the state in its constant term; False where that fails."""
    motion_state.origin[group] = t
    if still(motion_state, group):
        motion_state.polynomial[group, 1:] = 0.0
        motion_state.length[group] = 1.0
        motion_state.until[group] = math.inf
        motion_state.ending[group] = ENDS
        return True
    set_references(motion_state, group)
    compute_stages(scene, motion_state, group, t, 0.0, 0, 1)
    h = first_step(motion_state, group, min(motion_state.step[group], max(horizon - t, SMALLEST_STEP)))
    while True:
        compute_stages(scene, motion_state, group, t, h, 1, 12)
        error = step_error(motion_state.stages, h)
        if error <= 1.0:
            compute_stages(scene, motion_state, group, t, h, 12, DENSE.shape[1])
            set_polynomial(motion_state, group, h)
            too_far = find_ending(motion_state, group, t, h)
            if too_far == 0.0:
                break
            h *= 0.5 * max(too_far, 0.1)
        else:
            h *= max(0.1, 0.9 * error ** (-1.0 / 8.0)) if math.isfinite(error) else 0.1
        if h < SMALLEST_STEP:
            return False
    motion_state.length[group] = h
    motion_state.step[group] = h * min(5.0, 0.9 * max(error, 1e-9) ** (-1.0 / 8.0))
    return True
