"""How far a measured position may be off: the covariance that later stages use."""

import numpy as np
from jaxtyping import Float

from vrdp_prob.perception.placing import Sighting
from vrdp_prob.perception.solids import Solid
from vrdp_prob.scene.body import Shape
from vrdp_prob.scene.camera import Camera

_SHARED_EDGES = 2.0
"""Neighbouring edges of an outline share their errors: so many count as one."""
_COMMON_SHARE = {Shape.SPHERE: 0.65, Shape.CYLINDER: 0.35, Shape.CUBE: 0.35}
"""How much of the edges' scatter an outline is off by as a whole: shading near the rim, the shadow where it touches the
floor. A sphere suffers most. Measured on the development videos of benchmarks/perception.py."""
_LEAST_USED = 0.1
_LEAST_SHIFT = 0.05
"""Pixels by which an outline is off as a whole at least."""


def position_covariance(
    camera: Camera, solid: Solid, sighting: Sighting, typical_scatter: float = 0.0
) -> Float[np.ndarray, "2 2"] | None:
    """Covariance in m^2 of a sighting's position; None where its outline could not be fitted.

    Three independent parts: scatter of the edges about the outline; what shifts the outline as a whole, the more the
    less of it is seen; and the camera's reprojection error. A few edges of a hidden object may agree by chance, so that
    their scatter counts as at least the object's typical one (pixels).
    """
    contour = sighting.contour
    if contour is None:
        return None
    scatter = max(contour.scale, typical_scatter)
    count = 3 if solid.shape is Shape.CUBE else 2
    information = contour.information[:count, :count]
    if np.linalg.cond(information) > 1e12:
        return None
    fitted = _SHARED_EDGES * scatter**2 * np.linalg.inv(information)[:2, :2]
    common = max(_LEAST_SHIFT, _COMMON_SHARE[solid.shape] * scatter) / max(contour.used, _LEAST_USED)
    shift = common**2 + camera.pixel_sd**2
    to_plane = camera.plane_jacobian(np.array([sighting.pose.x, sighting.pose.y]), solid.radius)
    total: Float[np.ndarray, "2 2"] = fitted + shift * to_plane @ to_plane.T
    return (total + total.T) / 2
