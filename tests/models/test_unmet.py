"""How large something in the way may be that no body has met."""

import numpy as np
import pytest

from vrdp_prob.models.effects.unmet import CELLS, deepest_wall, largest_disc
from vrdp_prob.scene import Body, Shape, Tracks

RADIUS = 0.1


def tracks(*paths: np.ndarray, radius: float | None = RADIUS, video: str = "one") -> Tracks:
    """Bodies along some paths, each of places in a row."""
    bodies = tuple(Body(str(k), Shape.CYLINDER, radius) for k in range(len(paths)))
    positions = np.stack(paths, axis=1).astype(float)
    return Tracks.from_arrays(video, bodies, np.linspace(0.0, 4.0, len(positions)), positions)


def along(first: tuple[float, float], last: tuple[float, float], frames: int = 101) -> np.ndarray:
    """A straight path."""
    share = np.linspace(0.0, 1.0, frames)[:, None]
    return np.asarray(first) + share * (np.asarray(last) - np.asarray(first))


def square() -> list[np.ndarray]:
    """Bodies along the sides of a square, 2 m wide."""
    corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    return [along(corners[k], corners[(k + 1) % 4]) for k in range(4)]


@pytest.mark.parametrize(("radius", "room"), [(RADIUS, 1 - RADIUS), (None, 1.0)])
def test_a_disc_may_fill_what_paths_leave_free(radius: float | None, room: float) -> None:
    cell = 2 / CELLS
    found = largest_disc([tracks(*square(), radius=radius)])
    assert room <= found.size <= room + cell


def test_few_pictures_hide_no_more_than_many() -> None:
    cell = 2 / CELLS
    few = [path[::20] for path in square()]
    assert largest_disc([tracks(*few)]).size == pytest.approx(largest_disc([tracks(*square())]).size, abs=cell)


def test_each_video_adds_to_what_is_known() -> None:
    videos = [tracks(*square()), tracks(along((-1, 0), (1, 0)), video="two")]
    assert largest_disc(videos).size == pytest.approx(0.5 - RADIUS, abs=2 / CELLS)


def test_small_bodies_leave_more_room_than_large_ones() -> None:
    large, small = (tracks(along((-1, y), (1, y)), radius=r, video=str(y)) for y, r in ((-1, 0.3), (1, 0.05)))
    assert largest_disc([large, small]).size == pytest.approx(1 - 0.35 / 2, abs=3 / CELLS)


def test_on_a_line_nothing_larger_than_gaps_between_bodies_fits() -> None:
    apart = [along((-1, 0), (-0.5, 0)), along((0.5, 0), (1, 0))]
    assert largest_disc([tracks(*apart)]).size == pytest.approx(0.5 - RADIUS, abs=3 / CELLS)
    assert deepest_wall([tracks(*apart)]).size == pytest.approx(1 + RADIUS, abs=0.01)
    assert largest_disc([tracks(along((-1, 0), (1, 0)))]).size <= 2 / CELLS


def test_bodies_at_rest_are_no_error() -> None:
    still = tracks(along((0.3, 0.2), (0.3, 0.2)))
    assert (largest_disc([still]).size, deepest_wall([still]).size) == (0.0, 0.0)


def test_a_wall_may_stand_between_paths_that_nobody_crosses() -> None:
    kept_apart = [along((-0.1, y), (0.1, y)) for y in (-0.5, 0.25)]
    assert deepest_wall([tracks(*kept_apart)]).size == pytest.approx(0.375 + RADIUS, abs=0.03)
    crossed = tracks(along((0, -0.5), (0, 0.25)), video="two")
    assert deepest_wall([tracks(*kept_apart), crossed]).size == 0.0
    assert deepest_wall([tracks(*square())]).size == 0.0


def test_an_outlier_is_no_place_where_a_body_was() -> None:
    wild = square()
    wild[0][50] = (0.0, 0.0)
    assert largest_disc([tracks(*wild)]).size == pytest.approx(largest_disc([tracks(*square())]).size)


def test_nobody_knows_where_a_body_went_that_was_not_seen() -> None:
    turns = np.pi * np.linspace(0, 1, 101)
    arc = np.stack([0.8 * np.cos(turns), 0.8 * np.sin(turns)], axis=1)
    hidden = arc.copy()
    hidden[20:80] = np.nan
    whole, gap = (largest_disc([tracks(along((-1, 0), (1, 0)), one)]).size for one in (arc, hidden))
    assert gap >= whole
    few = arc.copy()
    few[::10] = np.nan
    assert largest_disc([tracks(along((-1, 0), (1, 0)), few)]).size == pytest.approx(whole, abs=2 / CELLS)


@pytest.mark.parametrize("radius", [0.15, 0.4])
def test_a_disc_that_bodies_bounce_off_on_all_sides_fits_whatever_the_noise(radius: float) -> None:
    generator = np.random.default_rng(1)
    inwards = radius + RADIUS + np.abs(np.linspace(-1, 1, 101))
    turns = 2 * np.pi * np.arange(24) / 24
    paths = [inwards[:, None] * np.array([np.cos(turn), np.sin(turn)]) for turn in turns]
    noisy = [path + 0.003 * generator.standard_normal(path.shape) for path in paths]
    videos = [tracks(*noisy[k : k + 4], video=str(k)) for k in range(0, 24, 4)]
    assert radius <= largest_disc(videos).size <= radius + 0.06


def test_a_wall_that_bodies_touch_from_both_sides_is_not_ruled_out_by_the_noise() -> None:
    generator = np.random.default_rng(0)

    def bounce(side: float, y: float) -> np.ndarray:
        """A body that comes from one side, touches the wall at x = 0 and goes back."""
        x = side * (RADIUS + np.abs(np.linspace(-1, 1, 101)))
        path = np.stack([x, y + 0.2 * np.linspace(-1, 1, 101)], axis=1)
        return path + 0.003 * generator.standard_normal(path.shape)

    found = deepest_wall(
        [tracks(bounce(-1, -0.5), bounce(1, 0.5)), tracks(bounce(-1, 0.5), bounce(1, -0.5), video="two")]
    )
    assert found.size == pytest.approx(1 + 2 * RADIUS, abs=0.05)
