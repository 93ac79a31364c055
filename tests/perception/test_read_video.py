from pathlib import Path

import numpy as np
import pytest
from drawing import COLORS, FRAME_RATE, RADIUS, Stage, Thing, line, resting

from vrdp_prob.errors import InputError
from vrdp_prob.perception import SeenObjects, read_video, see_video
from vrdp_prob.scene import Body, Camera, Shape, Tracks

FRAMES = 45


def camera_of(stage: Stage, pixel_sd: float = 0.0) -> Camera:
    return Camera(stage.projection(), stage.width, stage.height, FRAME_RATE, pixel_sd)


def full_stage() -> Stage:
    """A gray cube at rest behind a passing sphere, an entry, an exit, and two objects that hide each other."""
    return Stage(
        [
            Thing("cube", "gray", resting((-0.6, 0.9), FRAMES), 0.4),
            Thing("sphere", "red", line((-3.2, -0.9), (1.2, -0.6), FRAMES), highlight=True),
            Thing("cylinder", "yellow", resting((0.6, -0.3), FRAMES)),
            Thing("cube", "blue", line((0.2, 0.2), (3.6, 2.2), FRAMES), np.linspace(0, 1.2, FRAMES)),
            Thing("sphere", "green", line((-0.2, -1.0), (-0.9, 2.2), FRAMES)),
            Thing("sphere", "purple", line((2.4, -2.6), (1.3, 1.4), FRAMES)),
        ]
    )


@pytest.fixture(scope="module")
def stage() -> Stage:
    return full_stage()


@pytest.fixture(scope="module")
def drawn(stage: Stage, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return stage.write(tmp_path_factory.mktemp("video") / "drawn.mp4")


@pytest.fixture(scope="module")
def seen(stage: Stage, drawn: Path) -> SeenObjects:
    return see_video(drawn, camera_of(stage))


@pytest.fixture(scope="module")
def tracks(seen: SeenObjects) -> Tracks:
    return seen.tracks


def find(tracks: Tracks, color: str, shape: str) -> tuple[int, Body]:
    matches = [
        (index, body) for index, body in enumerate(tracks.bodies) if body.color == color and body.shape is Shape(shape)
    ]
    assert len(matches) == 1, f"{color} {shape} in {[(body.color, body.shape) for body in tracks.bodies]}"
    return matches[0]


def test_every_object_is_found_once_with_its_color_and_shape(tracks: Tracks, stage: Stage) -> None:
    assert len(tracks.bodies) == len(stage.things)
    for thing in stage.things:
        find(tracks, thing.color, thing.shape)
    assert {body.radius for body in tracks.bodies} == {RADIUS}


def test_positions_are_right_in_every_row(tracks: Tracks, stage: Stage) -> None:
    for thing in stage.things:
        index, _ = find(tracks, thing.color, thing.shape)
        error = np.linalg.norm(tracks.positions[:, index] - thing.path, axis=1)
        assert np.nanmedian(error) < 0.02, thing
        assert np.nanmax(error) < 0.08, thing


def test_rows_are_the_frames_with_the_centre_in_view(tracks: Tracks, stage: Stage) -> None:
    camera = camera_of(stage)
    for thing in stage.things:
        index, _ = find(tracks, thing.color, thing.shape)
        in_view = camera.in_view(thing.path, RADIUS)
        assert abs(int(in_view.argmax()) - int(tracks.seen[:, index].argmax())) <= 1, thing
        assert (tracks.seen[:, index] & ~in_view).sum() <= 1, thing
        if thing.color != "green":
            assert tracks.seen[in_view, index].mean() > 0.9, thing


def test_an_object_behind_another_has_missing_rows_and_comes_back_as_itself(tracks: Tracks) -> None:
    index, _ = find(tracks, "green", "sphere")
    seen = tracks.seen[:, index]
    missing = np.nonzero(~seen)[0]
    assert 1 <= len(missing) <= 10
    assert seen[: missing[0]].all()
    assert seen[missing[-1] + 1 :].all()


def test_the_camera_s_times_are_used(tracks: Tracks) -> None:
    np.testing.assert_allclose(tracks.times, np.arange(FRAMES) / FRAME_RATE)


def test_yaw_of_a_cube_is_followed(tracks: Tracks, stage: Stage) -> None:
    thing = stage.things[3]
    index, _ = find(tracks, thing.color, thing.shape)
    assert tracks.angles is not None
    seen = np.isfinite(tracks.angles[:, index])
    turned = tracks.angles[seen, index] - np.broadcast_to(thing.yaw, FRAMES)[seen]
    assert np.ptp(turned) < 0.1
    quarter = np.pi / 2
    assert abs((np.median(turned) + quarter / 2) % quarter - quarter / 2) < 0.05
    sphere, _ = find(tracks, "red", "sphere")
    assert np.isnan(tracks.angles[:, sphere]).all()


def test_a_highlight_tells_metal(tracks: Tracks) -> None:
    _, shiny = find(tracks, "red", "sphere")
    assert shiny.material == "metal"
    _, matt = find(tracks, "purple", "sphere")
    assert matt.material == "rubber"


def test_a_cube_without_highlight_leaves_its_material_open(tracks: Tracks) -> None:
    _, body = find(tracks, "blue", "cube")
    assert max(body.probabilities("material").values()) < 0.8


def test_every_row_has_a_covariance_that_covers_the_error(tracks: Tracks, stage: Stage) -> None:
    covariance = tracks.position_covariance
    assert covariance is not None
    np.testing.assert_array_equal(np.isfinite(covariance).all(axis=(-1, -2)), tracks.seen)
    squared = []
    for thing in stage.things:
        index, _ = find(tracks, thing.color, thing.shape)
        seen = tracks.seen[:, index]
        error = tracks.positions[seen, index] - thing.path[seen]
        squared += np.einsum("ni,nij,nj->n", error, np.linalg.inv(covariance[seen, index]), error).tolist()
    assert np.mean(np.array(squared) < 13.8) > 0.9


def test_crops_show_each_object_in_its_color_and_shape(seen: SeenObjects) -> None:
    inside = {"cube": 0.0, "sphere": 0.0}
    for body, crops in zip(seen.tracks.bodies, seen.crops, strict=True):
        assert 1 <= len(crops) <= 16
        shows = crops.masks > 200
        chroma = crops.pictures[shows].mean(axis=0) / crops.pictures[shows].mean()
        true = np.array(COLORS[str(body.color)]) / np.mean(COLORS[str(body.color)])
        assert np.abs(chroma - true).max() < 0.35, body
        assert shows.mean(axis=(1, 2)).min() > 0.05, body
        # an object is in the middle, and what is around it is not the object
        assert crops.masks[:, 12:20, 12:20].mean() > 200, body
        assert crops.masks[:, 0].mean() < 60, body
        inside[str(body.shape)] = float(shows.mean())
    assert inside["cube"] > 1.15 * inside["sphere"]


def test_pictures_are_cut_without_another_measurement(seen: SeenObjects, stage: Stage, drawn: Path) -> None:
    again = read_video(drawn, camera_of(stage))
    np.testing.assert_array_equal(again.positions, seen.tracks.positions)
    assert again.bodies == seen.tracks.bodies


def test_same_video_same_numbers(stage: Stage, drawn: Path) -> None:
    first, second = (read_video(drawn, camera_of(stage), frames=5) for _ in range(2))
    np.testing.assert_array_equal(first.positions, second.positions)


def test_video_without_objects(tmp_path: Path) -> None:
    stage = Stage()
    with pytest.raises(InputError, match="no object can be seen"):
        read_video(stage.write(tmp_path / "floor.mp4"), camera_of(stage))


def test_video_without_moving_objects(tmp_path: Path) -> None:
    stage = Stage([Thing("cube", "red", resting((0.0, 0.0), 8)), Thing("sphere", "cyan", resting((0.8, 0.8), 8))])
    with pytest.raises(InputError, match="no object moves in the video"):
        read_video(stage.write(tmp_path / "rest.mp4"), camera_of(stage))


def test_video_of_another_size_than_the_camera_s_picture(stage: Stage, tmp_path: Path) -> None:
    path = Stage([Thing("cube", "red", resting((0.0, 0.0), 3))], width=160, height=120).write(tmp_path / "small.mp4")
    with pytest.raises(InputError, match="the video is 160x120 pixels but the camera's picture is 320x240"):
        read_video(path, camera_of(stage))


@pytest.mark.slow
@pytest.mark.parametrize("number", [2, 6])
def test_practice_videos(shared_data: Path, number: int) -> None:
    folder = shared_data / "clevrer_bullet"
    tracks = read_video(folder / f"videos/video_{number:05d}.mp4", Camera.read(folder / "camera.json"))
    assert len(tracks.bodies) == {2: 4, 6: 6}[number]
