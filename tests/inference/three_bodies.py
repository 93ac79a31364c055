"""A small video in which most things happen that a posterior has to know of."""

import numpy as np

from tests.inference.generator import Scene, observe
from vrdp_prob.scene import Shape, Tracks

NOISE = 0.005


def tracks(*, angles: bool = False) -> Tracks:
    """A disc hits a cube; a third body enters late; some positions are missing; angles are measured if asked for."""
    scene = Scene(
        (Shape.CYLINDER, Shape.CUBE, Shape.SPHERE),
        np.array([[-1.2, 0.0], [-0.2, 0.05], [-1.0, 1.5]]),
        np.array([[1.8, 0.0], [0.0, 0.0], [0.9, 0.1]]),
        np.array([1.5, 0.8, 1.0]),
        np.array([0.9, 0.95, 0.8]),
        np.full(3, 0.2),
        np.array([0.4, 0.4, 0.05]),
        angle=np.array([0.0, 0.3, 0.0]),
        release=np.array([0.0, 0.0, 0.4]),
    )
    return observe(scene, noise=NOISE, dropout=0.1, frames=40, seed=2, angles=angles)
