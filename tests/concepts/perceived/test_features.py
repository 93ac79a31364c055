"""What the encoders are given: statistics of crops and slides, trajectories, windows."""

import numpy as np
import pytest
import torch
from toys import crop

from vrdp_prob.concepts.perceived.crop_statistics import STATISTICS, crop_statistics
from vrdp_prob.concepts.perceived.lighting import relit
from vrdp_prob.concepts.perceived.slides import _DECELERATIONS, SLIDE_STATISTICS, slide_statistics
from vrdp_prob.concepts.perceived.trajectories import (
    WINDOW,
    in_sight,
    pair_features,
    trajectories,
    window_features,
    window_of_frame,
)
from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.events import EventUniverse
from vrdp_prob.reasoning.sight import Sight
from vrdp_prob.scene import Body, Camera, Shape, Tracks

FRAMES = 60
TIMES = np.arange(FRAMES) / 25


def tracks(camera: Camera | None, frames: int = FRAMES) -> Tracks:
    """One body slows down by 1 m/s^2 and is not seen in a few frames; another lies still and comes into sight late."""
    noise = np.random.default_rng(0).normal(0, 0.003, (frames, 2, 2))
    positions = np.zeros((frames, 2, 2)) + noise
    time = TIMES[:frames]
    positions[:, 0, 0] += -2 + 2.5 * time - time**2 / 2
    positions[:, 1, 1] += 1.5
    positions[20:23, 0] = np.nan
    positions[: min(10, frames - 2), 1] = np.nan
    bodies = tuple(Body(name, Shape.CYLINDER, 0.2) for name in "ab")
    return Tracks.from_arrays("v", bodies, time, positions, camera=camera)


def crops(*things: tuple[str, str, str]) -> torch.Tensor:
    noise = np.random.default_rng(0)
    return torch.from_numpy(np.stack([crop(thing, noise) for thing in things])).float() / 255


def test_statistics_hardly_change_with_the_light_and_do_with_the_color() -> None:
    looked = crops(("red", "rubber", "cube"), ("blue", "rubber", "cube"))
    dark = torch.cat([0.7 * looked[:, :3], looked[:, 3:]], dim=1)
    plain, shaded = crop_statistics(looked), crop_statistics(dark)
    assert plain.shape == (2, STATISTICS)
    assert (plain - shaded).norm(dim=1).max() < 0.1 * (plain[0] - plain[1]).norm()


def test_statistics_tell_shapes_and_highlights() -> None:
    disc, square, shining = crop_statistics(
        crops(("red", "rubber", "sphere"), ("red", "rubber", "cube"), ("red", "metal", "sphere"))
    )
    again = crop_statistics(crops(("red", "rubber", "sphere")))[0]
    for other in (square, shining):
        assert (disc - other).norm() > 3 * (disc - again).norm()


def test_a_crop_without_any_pixel_of_the_object_has_finite_statistics() -> None:
    assert torch.isfinite(crop_statistics(torch.zeros(1, 4, 32, 32))).all()


def test_other_lights_leave_the_mask() -> None:
    looked = crops(("red", "metal", "cube"), ("gray", "rubber", "sphere"))[None].movedim(0, 1)
    lit = relit(looked, torch.Generator().manual_seed(0))
    mask, mirrored = looked[:, :, 3], looked[:, :, 3].flip(-1)
    assert torch.equal(lit[:, :, 3], mask) or torch.equal(lit[:, :, 3], mirrored)
    assert not torch.allclose(lit[:, :, :3], looked[:, :, :3], atol=0.02)


def test_trajectories_are_filled_where_an_object_is_hidden_and_zero_where_it_is_not_there() -> None:
    camera = Camera.clevrer()
    seen = tracks(camera)
    table = trajectories(seen)
    assert table.shape == (FRAMES, 2, 4)
    assert (table[:10, 1] == 0).all()
    np.testing.assert_allclose(table[21, 0, 2], (-2 + 2.5 * TIMES[21] - TIMES[21] ** 2 / 2) / 3, atol=0.01)
    pixels = camera.project(np.array([*seen.positions[40, 0], 0.2]))
    np.testing.assert_allclose(table[40, 0, :2], pixels / (np.array([camera.width, camera.height]) / 2) - 1)
    sight = in_sight(seen)
    assert sight[:, 0].all()
    assert sight[:, 1].tolist() == [frame >= 10 for frame in range(FRAMES)]


def test_tracks_without_a_picture_or_with_too_few_frames() -> None:
    with pytest.raises(InputError, match="no camera"):
        trajectories(tracks(None))
    with pytest.raises(InputError, match="has 8 frames; concepts need at least 10"):
        trajectories(tracks(Camera.clevrer(), frames=8))


def test_windows_hold_all_coordinates_and_their_length() -> None:
    trajectory = torch.from_numpy(trajectories(tracks(Camera.clevrer()))).float()
    windows = window_features(trajectory)
    assert windows.shape == (FRAMES - WINDOW + 1, 2, 4 * WINDOW)
    # the transform only turns the axes
    torch.testing.assert_close(windows[3].norm(dim=1), trajectory[3 : 3 + WINDOW].norm(dim=(0, 2)))
    pairs = pair_features(trajectory, EventUniverse(("a", "b")))
    assert pairs.shape == (2, FRAMES - WINDOW + 1, 1, 12 * WINDOW)
    torch.testing.assert_close(pairs[0, ..., 80:], pairs[1, ..., 80:])
    torch.testing.assert_close(pairs[0, ..., :40], pairs[1, ..., 40:80])


def test_every_frame_has_a_window_around_it() -> None:
    windows = window_of_frame(FRAMES)
    frames = torch.arange(FRAMES)
    assert ((windows <= frames) & (frames < windows + WINDOW)).all()
    assert windows.max() == FRAMES - WINDOW


def test_slides_tell_the_deceleration() -> None:
    statistics = slide_statistics(Sight(tracks(Camera.clevrer())))
    assert statistics.shape == (2, SLIDE_STATISTICS)
    assert _DECELERATIONS[statistics[0, :-1].argmax()] == pytest.approx(1.0, abs=0.15)
    assert statistics[0, -1] > 0.9
    assert statistics[1].max() < 0.2
