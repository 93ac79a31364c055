"""How large something in the way may be that no body has met."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from tests.discovery.data_set import DataSet
from tests.discovery.hidden import hide
from tests.discovery.videos import Disc
from vrdp_prob.models.effects.unmet import CELLS, deepest_wall, largest_disc
from vrdp_prob.scene import Body, Shape, Tracks, Wall

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


@pytest.mark.parametrize("seed", range(1, 4))
@pytest.mark.parametrize("way", ["wall", "hidden_obstacle"])
def test_what_bodies_bounced_off_is_no_larger_than_what_fits(way: str, seed: int) -> None:
    data = hide([way], seed=seed)
    true = data.truth.videos[0]
    disc, wall = largest_disc(data.tracks), deepest_wall(data.tracks)
    assert all(one.radius <= disc.size for one in true.hidden_discs if enclosed(one, data))
    assert all(depth(one, data) <= wall.size for one in true.hidden_walls)
    assert disc.size < 0.3 * np.ptp(everywhere(data), axis=0).max()


def everywhere(data: DataSet) -> np.ndarray:
    """All places of bodies without noise."""
    return np.concatenate([one.motion.states[:, :, :2][one.in_view] for one in data.truth.videos])


def enclosed(disc: Disc, data: DataSet) -> bool:
    """Whether the middle of a disc lies among places of bodies."""
    return bool(Delaunay(everywhere(data)).find_simplex([[disc.x, disc.y]])[0] >= 0)


def depth(wall: Wall, data: DataSet) -> float:
    """How far within the region where bodies were an endless wall is."""
    normal = np.array([wall.y2 - wall.y1, wall.x1 - wall.x2])
    heights = (everywhere(data) - [wall.x1, wall.y1]) @ normal / np.linalg.norm(normal)
    return float(min(heights.max(), -heights.min()))
