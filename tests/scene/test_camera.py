"""The camera: projection and its inverse on a plane."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrdp_prob.errors import InputError
from vrdp_prob.scene import Camera

coordinate = st.floats(-3, 3)


@given(x=coordinate, y=coordinate, height=st.floats(0, 0.5))
def test_the_plane_position_of_a_projection_is_the_point(x: float, y: float, height: float) -> None:
    camera = Camera.clevrer()
    pixels = camera.project(np.array([x, y, height]))
    np.testing.assert_allclose(camera.to_plane(pixels, height), [x, y], atol=1e-9)


@given(x=coordinate, y=coordinate)
def test_the_jacobian_is_the_derivative_of_the_plane_position(x: float, y: float) -> None:
    camera, step = Camera.clevrer(), 1e-4
    pixels = camera.project(np.array([x, y, 0.2]))
    moved = [
        camera.to_plane(pixels + step * axis, 0.2) - camera.to_plane(pixels - step * axis, 0.2) for axis in np.eye(2)
    ]
    expected = np.stack(moved, axis=-1) / (2 * step)
    np.testing.assert_allclose(camera.plane_jacobian(np.array([x, y]), 0.2), expected, rtol=1e-5, atol=1e-9)


def test_a_point_behind_the_camera_is_not_in_view() -> None:
    camera = Camera.clevrer()
    assert camera.in_view(np.array([0.0, 0.0]))
    assert not camera.in_view(np.array([30.0, 0.0]))


def test_write_then_read_gives_the_same(tmp_path: Path) -> None:
    camera = Camera(Camera.clevrer().projection, 480, 320, 25.0, 0.7)
    camera.write(tmp_path / "camera.json")
    again = Camera.read(tmp_path / "camera.json")
    np.testing.assert_array_equal(again.projection, camera.projection)
    assert (again.width, again.height, again.frame_rate, again.pixel_sd) == (480, 320, 25.0, 0.7)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"projection": [[1, 2, 3, 4], [2, 4, 6, 8], [0, 0, 1, 5]]}, "singular matrix"),
        ({"projection": [[1, 2, 3], [2, 4, 6], [0, 0, 1]]}, r"\(3, 3\), not 3 rows of 4"),
        ({"projection": [[1, 2, 3, float("nan")], [2, 4, 7, 8], [0, 1, 1, 5]]}, "not finite"),
        ({"width": 0}, "positive numbers of pixels"),
        ({"width": "wide"}, "not a camera file"),
        ({"width": float("inf")}, "not a camera file"),
        ({"fps": -25}, "'fps' is -25; give frames per second"),
        ({"fps": float("nan")}, "'fps' is nan"),
        ({"pixel_sd": float("nan")}, "'pixel_sd' is nan; give a number of pixels"),
    ],
)
def test_camera_file_mistakes(tmp_path: Path, change: dict[str, object], message: str) -> None:
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(Camera.clevrer().to_document() | change))
    with pytest.raises(InputError, match=message) as caught:
        Camera.read(path)
    assert str(path) in str(caught.value)
