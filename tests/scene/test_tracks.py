"""What tracks refuse."""

from dataclasses import replace

import numpy as np
import pytest

from vrdp_prob.errors import InputError
from vrdp_prob.scene import Body, Shape, Tracks, Wall


@pytest.mark.parametrize(("value", "sentence"), [(1e300, "1e.300 m away, farther than 1e.06 m"), (np.inf, "infinite")])
def test_positions_that_are_none_are_refused(value: float, sentence: str) -> None:
    bodies = (Body("a", Shape.SPHERE, 0.1), Body("b", Shape.SPHERE, 0.1))
    positions = np.stack([np.zeros((4, 2)), np.ones((4, 2))], axis=1)
    positions[2, 1, 0] = value
    with pytest.raises(InputError, match=f"the position of object b at 2 s is {sentence}"):
        Tracks.from_arrays("v", bodies, np.arange(4.0), positions)


@pytest.mark.parametrize(
    ("wall", "distance"),
    [
        (Wall(-1.0, 0.05, 1.0, 0.05), 0.05),
        (Wall(0.0, 1.0, 0.0, 0.03), 0.03),
        (Wall(0.0, 1.0, 0.0, 0.08), None),
        (Wall(1.0, 0.05, 2.0, 0.05), None),
    ],
    ids=["through it", "an end in it", "as near as noise may put it", "beside it"],
)
def test_a_body_that_begins_in_a_wall_is_refused(wall: Wall, distance: float | None) -> None:
    places = np.stack([np.linspace(0.0, -1.0, 5), np.zeros(5)], axis=1)[:, None]
    arguments = ("v", (Body("a", Shape.CYLINDER, 0.1),), np.arange(5) * 0.04, places)
    if distance is None:
        assert Tracks.from_arrays(*arguments, walls=(wall,)).walls
        return
    with pytest.raises(InputError, match=rf"v: object a overlaps the wall .* \(centre {distance:g} m from it"):
        Tracks.from_arrays(*arguments, walls=(wall,))


def test_noise_of_half_a_radius_is_no_overlap() -> None:
    generator = np.random.default_rng(0)
    bodies = (Body("a", Shape.CYLINDER, 0.025), Body("b", Shape.CYLINDER, 0.025))
    for _ in range(100):
        positions = np.zeros((30, 2, 2)) + np.array([[0.0, 0.0], [0.05, 0.0]]) + generator.normal(0, 0.0125, (30, 2, 2))
        assert Tracks.from_arrays("v", bodies, np.arange(30) / 25, positions).bodies
    with pytest.raises(InputError, match="objects a and b overlap at 0 s"):
        Tracks.from_arrays("v", bodies, np.arange(30) / 25, np.zeros((30, 2, 2)))


@pytest.mark.parametrize("low", [-np.pi, 0.0])
def test_angles_that_wrap_are_refused(low: float) -> None:
    angles = 0.3 * np.arange(60.0)[:, None]
    wrapped = np.mod(angles - low, 2 * np.pi) + low
    arguments = ("v", (Body("a", Shape.CUBE, 0.1),), np.arange(60) / 25, np.zeros((60, 1, 2)))
    with pytest.raises(
        InputError, match=r"the angle of object a jumps by 5\.98 rad at .* s; give angles in rad that do not wrap"
    ):
        Tracks.from_arrays(*arguments, angles=wrapped)
    assert Tracks.from_arrays(*arguments, angles=np.unwrap(wrapped, axis=0)).angles is not None


def _turning(angles: np.ndarray, shown: np.ndarray | slice = slice(None)) -> Tracks:
    times = np.arange(len(angles))[shown] / 25
    return Tracks.from_arrays(
        "v", (Body("a", Shape.CUBE, 0.1),), times, np.zeros((len(times), 1, 2)), angles=angles[shown][:, None]
    )


@pytest.mark.parametrize("frame", [0, 1, 30, 58, 59])
def test_a_gross_error_of_an_angle_is_no_wrapping(frame: int) -> None:
    angles = 0.1 * np.arange(60.0)
    angles[frame] += 5.0
    tracks = _turning(angles)
    assert tracks.until(tracks.times[max(frame, 5)]).angles is not None


def test_fast_turning_and_gaps_are_no_wrapping() -> None:
    assert _turning(4.0 * np.arange(60.0)).angles is not None
    angles = 0.2 * np.arange(90.0)
    assert _turning(angles, np.r_[0:20, 51:90]).angles is not None
    angles[20:51] = np.nan
    assert _turning(angles).angles is not None


def test_times_of_day_are_counted_from_the_first_frame() -> None:
    arguments = ("v", (Body("a", Shape.CYLINDER, 0.1),))
    tracks = Tracks.from_arrays(*arguments, 1.7e9 + np.arange(5) / 25, np.zeros((5, 1, 2)))
    np.testing.assert_allclose(tracks.times, np.arange(5) / 25, atol=1e-6)
    assert tracks.until(0.1).data.attrs["time_origin"] == 1.7e9
    later = replace(tracks, data=tracks.data.assign_coords(time=tracks.times + 2.0)).from_first_frame()
    np.testing.assert_allclose(later.times, tracks.times)
    assert later.data.attrs["time_origin"] == 1.7e9 + 2.0
    assert Tracks.from_arrays(*arguments, 3.0 + np.arange(5) / 25, np.zeros((5, 1, 2))).times[0] == 3.0


def test_noise_along_a_line_is_no_overlap() -> None:
    generator = np.random.default_rng(1)
    bodies = (Body("a", Shape.CYLINDER, 0.025), Body("b", Shape.CYLINDER, 0.025))
    for _ in range(100):
        positions = np.zeros((30, 2, 2)) + np.array([[0.0, 0.0], [0.05, 0.0]])
        positions[..., 0] += generator.normal(0, 0.0125, (30, 2))
        assert Tracks.from_arrays("v", bodies, np.arange(30) / 25, positions).bodies


def test_whose_turning_is_told() -> None:
    bodies = (Body("a", Shape.CUBE, 0.1), Body("b", Shape.CUBE, 0.1), Body("c", Shape.SPHERE, 0.1))
    positions = np.zeros((5, 3, 2)) + np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    for told in ([True, True, False], [True, False, True], [False, False, False]):
        angles = np.where(told, 0.0, np.nan) + np.zeros((5, 3))
        tracks = Tracks.from_arrays("v", bodies, np.arange(5.0), positions, angles=angles)
        assert tracks.angles_told.tolist() == told
        assert tracks.turning_told is (told[0] and told[1])
    without = Tracks.from_arrays("v", bodies[2:], np.arange(5.0), positions[:, 2:])
    assert not without.angles_told.any()
    assert not without.turning_told
