"""How far a measured position may be off: the covariance that later stages use."""

import numpy as np
from jaxtyping import Float

from vrdp_prob.perception.placing import Sighting
from vrdp_prob.perception.solids import Solid
from vrdp_prob.scene.body import Shape
from vrdp_prob.scene.camera import Camera

_SHARED_EDGES = 6.0
"""Neighbouring edges of an outline share their errors: so many count as one."""
_SYSTEMATIC_SD = {Shape.SPHERE: 0.35, Shape.CYLINDER: 0.1, Shape.CUBE: 0.05}
"""Pixels by which a shape's outline is off as a whole (shading near the rim, the contact's shadow), measured."""
_SCALE_SHARE = 0.35
"""The part of the edges' scatter that does not average out along the outline."""


def position_covariance(camera: Camera, solid: Solid, sighting: Sighting) -> Float[np.ndarray, "2 2"] | None:
    """Covariance in m^2 of a sighting's position; None where its outline could not be fitted.

    Three independent parts: scatter of the edges about the outline, what shifts the outline as a whole, and the
    camera's reprojection error.
    """
    contour = sighting.contour
    if contour is None:
        return None
    count = 3 if solid.shape is Shape.CUBE else 2
    information = contour.information[:count, :count]
    if np.linalg.cond(information) > 1e12:
        return None
    fitted = _SHARED_EDGES * contour.scale**2 * np.linalg.inv(information)[:2, :2]
    shift = _SYSTEMATIC_SD[solid.shape] ** 2 + (_SCALE_SHARE * contour.scale) ** 2 + camera.pixel_sd**2
    to_plane = camera.plane_jacobian(np.array([sighting.pose.x, sighting.pose.y]), solid.radius)
    total: Float[np.ndarray, "2 2"] = fitted + shift * to_plane @ to_plane.T
    return (total + total.T) / 2
