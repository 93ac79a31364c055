"""How much of a posterior's mass each mode holds, with the Monte Carlo error of that share.

A mode is the region in which its component is the most probable one of the mixture, so that draws can be sorted by it.
"""

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.draws.diagnostics import share_with_error
from vrdp_prob.inference.draws.samples import ModeWeight
from vrdp_prob.inference.samplers.mixture import Mixture

UNSURE = 0.05
"""Standard error of a mode's weight above which the weights count as unknown."""


def weights_from_importance(
    mixture: Mixture, points: Float[np.ndarray, "draw dimension"], weights: Float[np.ndarray, "draw"]
) -> tuple[ModeWeight, ...]:
    """Weights of the modes from weighted draws; nothing where there is only one."""
    if len(mixture.components) == 1:
        return ()
    member = _members(mixture, points)
    shares = weights @ member
    errors = np.sqrt(weights**2 @ (member - shares) ** 2)
    return tuple(ModeWeight(float(share), float(error)) for share, error in zip(shares, errors, strict=True))


def weights_from_chains(mixture: Mixture, points: Float[np.ndarray, "chain draw dimension"]) -> tuple[ModeWeight, ...]:
    """Weights of the modes from chains that go to and fro; nothing where there is only one."""
    if len(mixture.components) == 1:
        return ()
    member = _members(mixture, points.reshape(-1, points.shape[-1])).reshape(*points.shape[:2], -1)
    return tuple(ModeWeight(*share_with_error(member[..., index])) for index in range(member.shape[-1]))


def _members(mixture: Mixture, points: Float[np.ndarray, "draw dimension"]) -> Float[np.ndarray, "draw mode"]:
    """1 for the mode that a draw is in, else 0."""
    return np.eye(len(mixture.components))[mixture.regions(points)]


def doubts(modes: tuple[ModeWeight, ...]) -> tuple[str, ...]:
    """A sentence where the weights of modes are not known well enough."""
    if all(mode.error <= UNSURE for mode in modes):
        return ()
    listed = ", ".join(f"{mode.weight:.2f} +- {mode.error:.2f}" for mode in modes)
    return (f"The {len(modes)} modes could not be weighted well ({listed}): the draws seldom change between them.",)
