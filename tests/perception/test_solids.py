import cv2
import numpy as np
import pytest
from drawing import RADIUS, Stage
from hypothesis import given, settings
from hypothesis import strategies as st

from vrdp_prob.perception.region import apparent_radius, paint, polygon_area
from vrdp_prob.perception.solids import Pose, Solid
from vrdp_prob.scene import Camera, Shape

STAGE = Stage()
CAMERA = Camera(STAGE.projection(), STAGE.width, STAGE.height)
place = st.floats(-1.5, 1.5)


@settings(max_examples=25, deadline=None)
@given(x=place, y=place)
def test_the_outline_of_a_sphere_is_where_lines_of_sight_graze_it(x: float, y: float) -> None:
    pixels = Solid(Shape.SPHERE, RADIUS).outline(CAMERA, Pose(x, y), 40).pixels
    eye = np.array(STAGE.eye)
    rays = np.column_stack([pixels, np.ones(40)]) @ np.linalg.inv(CAMERA.projection[:, :3]).T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    towards = np.array([x, y, RADIUS]) - eye
    distance = np.sqrt(towards @ towards - (rays @ towards) ** 2)
    np.testing.assert_allclose(distance, RADIUS, rtol=0.01)


@settings(max_examples=25, deadline=None)
@given(x=place, y=place, yaw=st.floats(0, 1.5), shape=st.sampled_from(list(Shape)))
def test_the_outline_moves_as_its_sensitivity_says(x: float, y: float, yaw: float, shape: Shape) -> None:
    solid, pose, small = Solid(shape, RADIUS), Pose(x, y, yaw), 1e-4
    outline = solid.outline(CAMERA, pose, 48)
    sensitivity = outline.sensitivity(CAMERA, pose)
    for parameter, step in enumerate(((small, 0, 0), (0, small, 0))):
        moved = solid.polygon(CAMERA, pose.moved(*step))
        signed = [
            -cv2.pointPolygonTest(moved.astype(np.float32), (float(u), float(v)), measureDist=True)
            for u, v in outline.pixels
        ]
        still = [
            -cv2.pointPolygonTest(
                solid.polygon(CAMERA, pose).astype(np.float32), (float(u), float(v)), measureDist=True
            )
            for u, v in outline.pixels
        ]
        change = -(np.array(signed) - np.array(still)) / small
        # single precision in OpenCV and corners, where the distance has no derivative
        assert np.median(np.abs(change - sensitivity[:, parameter])) < 8


@pytest.mark.parametrize("shape", list(Shape))
def test_normals_point_outward(shape: Shape) -> None:
    outline = Solid(shape, RADIUS).outline(CAMERA, Pose(0.3, -0.2, 0.5), 48)
    assert (((outline.pixels - outline.pixels.mean(axis=0)) * outline.normals).sum(axis=1) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(outline.normals, axis=1), 1)


def test_a_cube_looks_the_same_after_a_quarter_turn() -> None:
    cube = Solid(Shape.CUBE, RADIUS)
    first, second = (cube.polygon(CAMERA, Pose(0.1, 0.2, yaw)) for yaw in (0.3, 0.3 + np.pi / 2))
    assert polygon_area(first) == pytest.approx(polygon_area(second), rel=1e-5)
    np.testing.assert_allclose(np.sort(first, axis=0), np.sort(second, axis=0), atol=1e-3)


def test_painted_pixels_match_the_polygon_s_area() -> None:
    polygon = Solid(Shape.SPHERE, RADIUS).polygon(CAMERA, Pose(0.0, 0.0))
    window = paint(polygon, STAGE.height, STAGE.width)
    size = apparent_radius(CAMERA, Solid(Shape.SPHERE, RADIUS), Pose(0.0, 0.0))
    assert polygon_area(polygon) == pytest.approx(np.pi * size**2, rel=0.06)
    assert window.area == pytest.approx(polygon_area(polygon), rel=0.12)


def test_what_lies_outside_the_picture_has_no_pixels() -> None:
    assert paint(np.array([[-30.0, -30.0], [-10.0, -30.0], [-10.0, -12.0]]), 100, 100).area == 0
    assert paint(np.array([[300.0, 50.0], [320.0, 50.0], [310.0, 70.0]]), 100, 100).area == 0
