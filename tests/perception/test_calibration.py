from pathlib import Path

import numpy as np
import pytest
from drawing import FRAME_RATE, RADIUS, Stage, Thing, line, resting

from vrdp_prob.datasets.clevrer import read_annotation
from vrdp_prob.errors import InputError
from vrdp_prob.perception import PictureSize, calibrate_camera, calibrate_from_videos
from vrdp_prob.scene import Body, Camera, Shape, Tracks

FRAMES = 20


def true_camera(stage: Stage) -> Camera:
    return Camera(stage.projection(), stage.width, stage.height, FRAME_RATE)


def known_tracks(stage: Stage) -> Tracks:
    """True positions of the objects in view."""
    camera = true_camera(stage)
    positions = np.stack([thing.path for thing in stage.things], axis=1)
    positions = np.where(camera.in_view(positions, RADIUS)[..., None], positions, np.nan)
    bodies = tuple(Body(str(index), Shape(thing.shape), RADIUS) for index, thing in enumerate(stage.things))
    return Tracks.from_arrays("drawn", bodies, np.arange(len(positions)) / FRAME_RATE, positions)


def stages() -> list[Stage]:
    return [
        Stage(
            [
                Thing("sphere", "red", line((-2.4, -0.9), (1.0, 1.5), FRAMES)),
                Thing("cube", "blue", line((1.5, 0.9), (-1.2, -1.6), FRAMES), 0.4),
            ]
        ),
        Stage(
            [
                Thing("cylinder", "green", line((-1.8, 1.9), (1.8, 0.2), FRAMES)),
                Thing("cube", "yellow", resting((0.9, -1.1), FRAMES), 0.9),
                Thing("sphere", "purple", line((-0.4, 0.2), (0.2, -1.2), FRAMES)),
            ]
        ),
    ]


def worst_pixels(found: Camera, true: Camera, height: float) -> float:
    grid = np.array([(x, y, height) for x in np.linspace(-2, 2, 9) for y in np.linspace(-2, 2, 9)])
    inside = true.in_view(grid[:, :2], height)
    return float(np.linalg.norm(found.project(grid[inside]) - true.project(grid[inside]), axis=1).max())


@pytest.fixture(scope="module")
def videos(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("videos")
    return [stage.write(folder / f"{index}.mp4") for index, stage in enumerate(stages())]


def test_exact_points_give_the_exact_camera_also_off_their_plane() -> None:
    stage, rng = Stage(), np.random.default_rng(0)
    true = true_camera(stage)
    positions = rng.uniform(-1.5, 1.5, (12, 2))
    pixels = true.project(np.column_stack([positions, np.full(12, RADIUS)]))
    found = calibrate_camera(positions, pixels, RADIUS, PictureSize(stage.width, stage.height, 25.0))
    assert worst_pixels(found, true, RADIUS) < 1e-3
    assert worst_pixels(found, true, 0.0) < 1e-3
    assert found.pixel_sd < 1e-3
    assert (found.width, found.height, found.frame_rate) == (stage.width, stage.height, 25.0)


def test_wrong_points_do_little_harm_and_noise_is_reported() -> None:
    stage, rng = Stage(), np.random.default_rng(1)
    true = true_camera(stage)
    positions = rng.uniform(-1.5, 1.5, (200, 2))
    pixels = true.project(np.column_stack([positions, np.full(200, RADIUS)])) + rng.normal(0, 0.5, (200, 2))
    pixels[:6] += 15
    found = calibrate_camera(positions, pixels, RADIUS, PictureSize(stage.width, stage.height))
    assert worst_pixels(found, true, RADIUS) < 1.0
    assert found.pixel_sd == pytest.approx(0.5, rel=0.25)


@pytest.mark.parametrize(
    ("positions", "message"),
    [
        (np.zeros((0, 2)), "0 matched points do not determine a camera"),
        (np.column_stack([np.linspace(0, 1, 9), np.linspace(0, 2, 9)]), "do not lie on one line"),
    ],
)
def test_points_that_do_not_determine_a_camera(positions: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        calibrate_camera(positions, positions.copy(), RADIUS, PictureSize(320, 240))


def test_videos_with_known_positions_give_the_camera(videos: list[Path]) -> None:
    found = calibrate_from_videos(videos, [known_tracks(stage) for stage in stages()])
    true = true_camera(stages()[0])
    assert worst_pixels(found, true, RADIUS) < 1.0
    assert worst_pixels(found, true, 0.0) < 1.0
    assert 0 < found.pixel_sd < 0.6


def test_positions_of_other_videos_are_refused(videos: list[Path]) -> None:
    rng = np.random.default_rng(3)
    bodies = (Body("a", Shape.CUBE, RADIUS), Body("b", Shape.SPHERE, RADIUS))
    wrong = Tracks.from_arrays("wrong", bodies, np.arange(FRAMES) / FRAME_RATE, rng.uniform(-2, 2, (FRAMES, 2, 2)))
    with pytest.raises(InputError, match="calibration"):
        calibrate_from_videos(videos[:1], [wrong])


def test_as_many_positions_as_videos(videos: list[Path]) -> None:
    with pytest.raises(InputError, match="2 videos and 1 sets of positions"):
        calibrate_from_videos(videos, [known_tracks(stages()[0])])


def test_videos_of_different_size(videos: list[Path], tmp_path: Path) -> None:
    small = Stage(stages()[0].things, width=160, height=120).write(tmp_path / "small.mp4")
    known = known_tracks(stages()[0])
    with pytest.raises(InputError, match="calibrate with videos of one camera"):
        calibrate_from_videos([videos[0], small], [known, known])


def test_videos_without_objects(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no object stands out"):
        calibrate_from_videos([Stage().write(tmp_path / "floor.mp4")], [known_tracks(stages()[0])])


@pytest.mark.slow
def test_practice_camera_is_found(shared_data: Path) -> None:

    folder = shared_data / "clevrer_bullet"
    numbers = (4, 5, 6)
    found = calibrate_from_videos(
        [folder / f"videos/video_{number:05d}.mp4" for number in numbers],
        [read_annotation(folder / f"annotations/annotation_{number:05d}.json") for number in numbers],
    )
    true = Camera.read(folder / "camera.json")
    assert worst_pixels(found, true, RADIUS) < 0.5
    assert worst_pixels(found, true, 0.0) < 0.5
