"""Tracks folders: what is read is what was written, and every mistake is told with its place."""

from pathlib import Path

import numpy as np
import pytest

from vrdp_prob.datasets import load, load_all, read_folder, video_names, write_folder
from vrdp_prob.errors import InputError
from vrdp_prob.scene import Body, Camera, Shape, Tracks, Wall

TRACKS = """video,object,time,x,y
a,1,0.00,0.0,0.0
a,1,0.04,0.1,0.0
a,1,0.12,0.3,0.0
a,2,0.04,1.0,1.0
a,2,0.08,1.0,1.1
b,1,0.00,0.0,0.0
b,1,0.04,0.0,0.5
"""
OBJECTS = """video,object,shape,radius,mass,material
a,1,sphere,0.2,1.5,metal
a,2,cube,0.2,,
b,1,cylinder,,,
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A tracks folder of two videos."""
    (tmp_path / "tracks.csv").write_text(TRACKS)
    (tmp_path / "objects.csv").write_text(OBJECTS)
    return tmp_path


def test_missing_rows_become_missing_positions(folder: Path) -> None:
    first, second = read_folder(folder)
    assert (first.video, second.video) == ("a", "b")
    np.testing.assert_allclose(first.times, [0, 0.04, 0.08, 0.12])
    np.testing.assert_array_equal(first.seen, [[1, 0], [1, 1], [0, 1], [1, 0]])
    np.testing.assert_allclose(first.first_seen, [0, 0.04])
    np.testing.assert_allclose(first.last_seen, [0.12, 0.08])
    assert first.bodies[0] == Body("1", Shape.SPHERE, 0.2, mass=1.5, material="metal")
    assert second.bodies[0].radius is None


def test_walls_belong_to_their_video_or_to_all(folder: Path) -> None:
    (folder / "walls.csv").write_text("video,x1,y1,x2,y2,restitution\n*,0,-1,5,-1,\nb,2,-1,2,5,0.8\n")
    first, second = read_folder(folder)
    assert first.walls == (Wall(0, -1, 5, -1),)
    assert second.walls == (Wall(0, -1, 5, -1), Wall(2, -1, 2, 5, 0.8))


def test_write_then_read_gives_the_same(tmp_path: Path) -> None:
    times = np.arange(5) / 25
    positions = np.random.default_rng(0).normal(size=(5, 2, 2))
    positions[1, 0] = np.nan
    angles = np.full((5, 2), np.nan)
    angles[:, 1] = times
    bodies = (Body("x", Shape.SPHERE, 0.2, color="red"), Body("y", Shape.CUBE, 0.3, mass=2.0))
    tracks = Tracks.from_arrays(
        "v", bodies, times, positions, angles=angles, walls=(Wall(5, 5, 6, 5, 0.5),), camera=Camera.clevrer()
    )
    write_folder(str(tmp_path), [tracks])
    again = load(tmp_path)
    np.testing.assert_allclose(again.positions, positions, rtol=1e-8)
    np.testing.assert_allclose(again.angles, angles, rtol=1e-8)
    assert (again.bodies, again.walls) == (bodies, tracks.walls)
    np.testing.assert_array_equal(again.camera.projection, Camera.clevrer().projection)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("tracks.csv", "video,object,time,x,y", "video,object,time,x", "column y missing"),
        ("tracks.csv", "a,1,0.04,0.1,0.0", "a,1,0.04,nan,0.0", "row 3: 'x' is 'nan'"),
        ("tracks.csv", "a,1,0.04,0.1,0.0", "a,1,0.04,inf,0.0", "row 3: 'x' is 'inf'"),
        ("tracks.csv", "a,1,0.04,0.1,0.0", "a,1,0.04,left,0.0", "row 3: 'x' is 'left'; give a number"),
        ("tracks.csv", "a,1,0.04,0.1,0.0", "a,1,0.04,,0.0", "row 3: 'x' is empty"),
        ("tracks.csv", "a,1,0.04,0.1,0.0", "a,1,0.04,0.1", "row 3: 4 cells where the header has 5"),
        ("tracks.csv", "a,1,0.04,", "a,1,0.00,", "row 3: time 0 of object 1 is there twice"),
        ("tracks.csv", "a,1,0.12,", "a,1,0.02,", "row 4: time 0.02 of object 1 comes after a later one"),
        ("tracks.csv", "b,1,0.04,0.0,0.5\n", "", "object 1 was seen in 1 frame;"),
        ("tracks.csv", "a,2,0.04,1.0,1.0", "a,2,0.04,0.2,0.0", "objects 1 and 2 overlap at 0.04 s"),
        ("tracks.csv", TRACKS, "", "the file is empty"),
        ("tracks.csv", TRACKS, "video,object,time,x,y\n", "there are 0 objects"),
        ("objects.csv", "a,2,cube", "a,2,pyramid", "row 3: shape 'pyramid' is not known"),
        ("objects.csv", "a,1,sphere,0.2", "a,1,sphere,-0.2", "row 2: object 1: radius is -0.2"),
        ("objects.csv", "a,2,cube,0.2,,\n", "", "object 2 of video a has tracks but no row"),
        ("objects.csv", "a,2,cube", "a,1,cube", "row 3: object 1 of video a is there twice"),
        ("objects.csv", "b,1,", "c,1,sphere,,,\nb,1,", "object 1 of video c has no row in tracks.csv"),
        ("objects.csv", "b,1,", "b,7,sphere,,,\nb,1,", "object 7 of video b has no row in tracks.csv"),
    ],
)
def test_a_mistake_is_one_sentence_with_its_place(folder: Path, name: str, old: str, new: str, message: str) -> None:
    path = folder / name
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(InputError) as caught:
        read_folder(folder)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_wall_mistakes_name_their_row(folder: Path) -> None:
    (folder / "walls.csv").write_text("video,x1,y1,x2,y2,restitution\n*,0,0,0,0,\n")
    with pytest.raises(InputError, match=r"row 2: wall .* are the same"):
        read_folder(folder)


def test_a_wall_of_an_unknown_video(folder: Path) -> None:
    (folder / "walls.csv").write_text("video,x1,y1,x2,y2,restitution\n*,0,-1,5,-1,\nc,0,-1,5,-1,\n")
    with pytest.raises(InputError, match=r"walls\.csv, row 3: tracks\.csv has no video 'c'; the videos are a, b"):
        read_folder(folder)


def test_a_folder_of_several_videos_needs_a_choice(folder: Path) -> None:
    with pytest.raises(InputError, match="holds 2 videos; choose one"):
        load(folder)
    assert load(folder, video="b").video == "b"
    assert [tracks.video for tracks in load_all(folder)] == ["a", "b"]
    with pytest.raises(InputError, match="there is no video 'c'; the videos are a, b"):
        load(folder, video="c")


def test_a_table_without_rows_has_no_videos(folder: Path) -> None:
    (folder / "tracks.csv").write_text(TRACKS.splitlines()[0] + "\n")
    with pytest.raises(InputError, match=r"tracks\.csv: there are 0 objects"):
        video_names(folder)


def test_times_long_after_their_zero_are_told_apart(tmp_path: Path) -> None:
    times = 1_700_000_000 + np.arange(4) / 25
    positions = np.zeros((4, 1, 2))
    write_folder(tmp_path, [Tracks.from_arrays("v", (Body("a", Shape.SPHERE, 0.1),), times, positions)])
    np.testing.assert_allclose(np.diff(load(tmp_path).times), 0.04, atol=1e-6)


def test_stamps_that_were_rounded_otherwise_are_one_frame(tmp_path: Path) -> None:
    rows = ["video,object,time,x,y"]
    for body, decimals in (("a", 7), ("b", 5)):
        rows += [f"v,{body},{round(frame / 30, decimals)},{frame},{0 if body == 'a' else 9}" for frame in range(10)]
    (tmp_path / "tracks.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "objects.csv").write_text("video,object,shape,radius\nv,a,sphere,0.1\nv,b,sphere,0.1\n")
    tracks = load(tmp_path)
    np.testing.assert_allclose(tracks.times, np.arange(10) / 30, atol=1e-5)
    np.testing.assert_array_equal(tracks.positions[:, :, 0], np.arange(10.0)[:, None] * np.ones(2))


def test_dialects_of_tables(folder: Path) -> None:
    text = (folder / "tracks.csv").read_text()
    (folder / "tracks.csv").write_text(text.replace(",", ";"))
    with pytest.raises(
        InputError, match=r"tracks\.csv: columns .* missing; cells are parted by ';', part them by commas"
    ):
        read_folder(folder)
    (folder / "tracks.csv").write_text(text.replace("time,x", "time,time,x", 1))
    with pytest.raises(InputError, match=r"tracks\.csv: the column time is there twice; keep one"):
        read_folder(folder)
    (folder / "tracks.csv").write_text(text + "," * text.splitlines()[0].count(",") + "\n")
    assert len(read_folder(folder)) == 2


def test_videos_of_one_name_are_told_apart(tmp_path: Path) -> None:
    for suffix in ("avi", "mp4"):
        (tmp_path / f"clip.{suffix}").write_bytes(b"")
    with pytest.raises(InputError, match=r"clip\.mp4: video 'clip' is in clip\.avi as well; rename one"):
        load_all(tmp_path)


def test_paths_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file or folder"):
        load(tmp_path / "nothing")
    with pytest.raises(InputError, match="the path cannot be followed"):
        load(tmp_path / ("a" * 300))
    with pytest.raises(InputError, match=r"holds no tracks\.csv, no video and no annotation"):
        load(tmp_path)


def test_a_video_needs_a_camera(tmp_path: Path) -> None:
    (tmp_path / "inner").mkdir()
    video = tmp_path / "inner" / "clip.mp4"
    video.write_bytes(b"")
    with pytest.raises(InputError, match=r"no camera; put camera\.json beside the video"):
        load(video)
    (tmp_path / "camera.json").write_text('{"projection": [[1, 2], [3, 4]], "width": 4, "height": 3}')
    with pytest.raises(InputError, match=r"camera\.json: 'projection' is \(2, 2\)"):
        load(video)


def test_a_tracks_folder_uses_no_camera_but_its_own(folder: Path) -> None:
    inner = folder / "inner"
    inner.mkdir()
    for name in ("tracks.csv", "objects.csv"):
        (folder / name).rename(inner / name)
    Camera.clevrer().write(folder / "camera.json")
    for path in (inner, inner / "tracks.csv"):
        assert load(path, video="a").camera is None
    assert load(inner, video="a", camera=folder / "camera.json").camera is not None
    (folder / "camera.json").rename(inner / "camera.json")
    assert load(inner / "tracks.csv", video="a").camera is not None


@pytest.mark.parametrize(
    "name",
    [
        "clevrer_bullet",
        "billiards_three_cushion",
        "puck_mass_pairs_2d",
        "puck_collisions_2d",
        "glider_free_1d",
        "glider_collisions_1d_rubber",
    ],
)
def test_the_data_sets_are_read(shared_data: Path, name: str) -> None:
    videos = load_all(shared_data / name)
    assert len(videos) >= 6
    assert all(tracks.seen.sum(axis=0).min() >= 2 for tracks in videos)
