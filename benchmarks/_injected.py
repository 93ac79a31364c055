"""Known effects, added to real tracks: real noise and real misfit, but a known truth."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.integrate import cumulative_trapezoid

from vrdp_prob.models.parameters import GRAVITY
from vrdp_prob.scene import Tracks

Paths = Float[np.ndarray, "time body 2"]


def injected(tracks: Tracks, way: str, strength: float) -> Tracks:
    """Tracks as they would have been with an effect.

    Parameters
    ----------
    tracks
        What was seen, in all frames. A drag asks for bodies that meet nothing. A slope may act on bodies that meet: all
        fall alike, and contacts see differences only; friction that follows the velocity would make it inexact.
    way
        A key of `WAYS`.
    strength
        Of the effect, in the unit of its parameter.
    """
    changed = WAYS[way](tracks.times, tracks.positions, strength)
    data = tracks.data.copy(deep=True)
    for axis, name in enumerate("xy"):
        data[name].values[:] = changed[..., axis]
    return replace(tracks, data=data)


def _tilted(times: Float[np.ndarray, "time"], paths: Paths, tilt: float) -> Paths:
    """On a table that falls along x by the sine `tilt`: the same acceleration at all times."""
    fallen = paths.copy()
    fallen[..., 0] += GRAVITY * tilt * (times**2 / 2)[:, None]
    return fallen


def _dragged(times: Float[np.ndarray, "time"], paths: Paths, drag: float) -> Paths:
    """With a deceleration of `drag` times the velocity: the displacement d obeys d' = -drag (d + way gone)."""
    growth = np.exp(drag * times)[:, None, None]
    return paths - drag / growth * cumulative_trapezoid(growth * (paths - paths[0]), times, axis=0, initial=0.0)


def _distorted(_: Float[np.ndarray, "time"], paths: Paths, distortion: float) -> Paths:
    """Through a lens above the origin."""
    return paths * (1 + distortion * (paths**2).sum(axis=-1, keepdims=True))


WAYS: Mapping[str, Callable[[Float[np.ndarray, "time"], Paths, float], Paths]] = {
    "surface_tilt": _tilted,
    "linear_drag": _dragged,
    "lens_distortion": _distorted,
}
