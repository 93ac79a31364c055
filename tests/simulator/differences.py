"""Derivatives of simulations against central differences that state their own error.

A derivative is taken along one random direction in all inputs, or in those of one name. Differences of fourth order on
a ladder of steps, each half the one before, give values whose disagreement says how exact they are.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from tests.simulator.scenes import tensor
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import EventTable
from vrdp_prob.models.simulator.outcome import Outcome
from vrdp_prob.models.simulator.rollout import Rollout, simulate
from vrdp_prob.models.simulator.worlds import Worlds

FIELDS = (
    "position",
    "velocity",
    "angle",
    "spin",
    "release_time",
    "mass",
    "restitution",
    "radius",
    "walls",
    "wall_restitution",
)
STEPS = 0.5 ** np.arange(18)
LARGEST = 1e-3
"""First step of the ladder for derivatives up to USUAL; larger ones belong to motion that soon bends."""
USUAL = 100.0
SMALL = 1e-3
"""Derivative that counts as nothing, beside typical ones of 10 to 1000."""
Inputs = Mapping[str, Tensor]


@dataclass(frozen=True)
class Slope:
    """A derivative along a direction by both ways; sizes are what the direction's components add up to in square.

    Parameters
    ----------
    exact
        Directional derivative by the backward pass.
    difference, uncertainty
        The same by differences, and how far those of neighbouring steps are from it; NaN where events change order.
    size
        Typical size of the derivative along such a direction.
    finite
        Whether all derivatives are finite.
    """

    exact: float
    difference: float
    uncertainty: float
    size: float
    finite: bool

    @property
    def error(self) -> float:
        """Relative deviation of both."""
        return abs(self.difference - self.exact) / self.size

    @property
    def order_changes(self) -> bool:
        """Whether no step was short enough to keep the order of events."""
        return bool(np.isnan(self.difference))

    @property
    def inexact(self) -> bool:
        """Whether the differences of neighbouring steps deviate from each other as much as from the derivative."""
        return self.uncertainty > abs(self.difference - self.exact) / 3


class Scene:
    """One world whose inputs can be shifted."""

    def __init__(self, worlds: Worlds, times: Tensor, model: PhysicsModel, seed: int) -> None:
        generator = np.random.default_rng(seed)
        self.worlds, self.model = worlds, model
        fields = {name: getattr(worlds, name) for name in FIELDS if getattr(worlds, name).numel()}
        self.inputs: Inputs = {**fields, **worlds.parameters, "times": times}
        self.direction = {name: tensor(generator.normal(size=value.shape)) for name, value in self.inputs.items()}
        self.weight = tensor(generator.normal(size=(len(worlds), len(times), len(worlds.shapes), 3)))

    def rollout(self, inputs: Inputs) -> Rollout:
        fields = {name: inputs[name] for name in FIELDS if name in inputs}
        parameters = {name: inputs[name] for name in self.worlds.parameters}
        return simulate(replace(self.worlds, **fields, parameters=parameters), inputs["times"], self.model)

    def gradient(self) -> tuple[dict[str, Tensor], Rollout]:
        """Derivative of a random combination of the trajectories by every input."""
        leaves = {name: value.clone().requires_grad_() for name, value in self.inputs.items()}
        rollout = self.rollout(leaves)
        (rollout.trajectory * self.weight).sum().backward()
        return {name: leaf.grad for name, leaf in leaves.items() if leaf.grad is not None}, rollout

    def shifted(self, names: set[str], step: float) -> tuple[float, object]:
        """The combination after a shift of the named inputs, and its sequence of events."""
        moved = {
            name: value + step * self.direction[name] if name in names else value for name, value in self.inputs.items()
        }
        rollout = self.rollout(moved)
        return float((rollout.trajectory * self.weight).sum()), sequences(rollout)

    def slopes(self, *groups: set[str]) -> list[Slope]:
        """Slopes along the direction, one for each group of inputs (an empty one stands for all)."""
        gradient, rollout = self.gradient()
        finite = all(bool(torch.isfinite(value).all()) for value in gradient.values())
        return [self._slope(group or set(gradient), gradient, sequences(rollout), finite=finite) for group in groups]

    def _slope(self, names: set[str], gradient: Inputs, order: object, *, finite: bool) -> Slope:
        parts = torch.cat([(self.direction[name] * gradient[name]).flatten() for name in names if name in gradient])
        size = float((parts**2).sum().sqrt()) + SMALL
        difference, uncertainty = self._difference(names, order, LARGEST * STEPS * min(1.0, USUAL / size) ** 0.5)
        return Slope(float(parts.sum()), difference, uncertainty, size, finite)

    def _difference(self, names: set[str], order: object, ladder: np.ndarray) -> tuple[float, float]:
        """The fourth-order difference that deviates least from those of both neighbouring steps, and how far."""
        central = []
        for step in ladder:
            (plus, order_plus), (minus, order_minus) = (self.shifted(names, sign * step) for sign in (1, -1))
            same = order_plus == order == order_minus
            central.append((plus - minus) / (2 * step) if same else np.nan)
        values = (4 * np.array(central[1:]) - np.array(central[:-1])) / 3
        steps = np.abs(np.diff(values))
        deviation = np.maximum(steps[:-1], steps[1:])
        if np.isnan(deviation).all():
            return np.nan, np.nan
        best = int(np.nanargmin(deviation))
        return float(values[best + 1]), float(deviation[best])


def sequences(rollout: Rollout) -> object:
    """For each body its events in order; the order of events of different bodies does not matter."""
    events = rollout.events
    if len(rollout.outcome) != 1:
        raise ValueError("one world at a time")
    bodies = rollout.exists.shape[-1]
    return rollout.outcome, [_of_body(events, body) for body in range(bodies)]


def _of_body(events: EventTable, body: int) -> list[tuple[int, int, int]]:
    rows = zip(events.kind.tolist(), events.first.tolist(), events.second.tolist(), strict=True)
    return [row for row in rows if row[1] == body or (row[0] == 0 and row[2] == body)]


def off_frames(worlds: Worlds, seed: int) -> Worlds:
    """The worlds with release times between frames: at one, a body has a derivative from each side only."""
    release = tensor(np.random.default_rng(seed).uniform(0.012, 0.028, worlds.release_time.shape))
    return worlds.released_at(worlds.release_time + release)


def slopes(worlds: Worlds, seed: int, times: Tensor, model: PhysicsModel) -> list[Slope]:
    """Slopes of one world along a random direction of everything, and along that of one kind of input in turn."""
    scene = Scene(off_frames(worlds, seed), times, model, seed)
    alone = sorted(scene.inputs)[seed % len(scene.inputs)]
    return scene.slopes(set(), {alone})


def is_fair(worlds: Worlds, times: Tensor, model: PhysicsModel, seed: int) -> bool:
    """Whether a world is one to differentiate: nothing overlaps when it appears."""
    return simulate(off_frames(worlds, seed), times, model).outcome != (Outcome.OVERLAP,)
