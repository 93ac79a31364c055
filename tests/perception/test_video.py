from pathlib import Path

import cv2
import numpy as np
import pytest

from vrdp_prob.errors import InputError
from vrdp_prob.perception.video import read_frames, still


def write(path: Path, count: int) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), 25.0, (64, 48))
    for index in range(count):
        writer.write(np.full((48, 64, 3), (10, 20, 100 + 4 * index), np.uint8))
    writer.release()
    return path


def test_frames_come_as_rgb_in_order(tmp_path: Path) -> None:
    video = read_frames(write(tmp_path / "scene.mp4", 12))
    assert video.name == "scene"
    assert video.frames.shape == (12, 48, 64, 3)
    assert video.frame_rate == pytest.approx(25.0)
    red, _, blue = video.frames[0].mean(axis=(0, 1))
    assert red > 90 > blue
    assert (np.diff(video.frames[..., 0].mean(axis=(1, 2))) > 0).all()


def test_only_the_first_frames_are_read_where_asked(tmp_path: Path) -> None:
    assert len(read_frames(write(tmp_path / "scene.mp4", 12), frames=5).frames) == 5


def test_still_is_one_frame(tmp_path: Path) -> None:
    path = write(tmp_path / "scene.mp4", 4)
    np.testing.assert_array_equal(still(path, 2), read_frames(path).frames[2])


@pytest.mark.parametrize("frame", [4, -1])
def test_still_refuses_a_frame_that_is_not_there(tmp_path: Path, frame: int) -> None:
    with pytest.raises(InputError, match=f"there is no frame {frame}"):
        still(write(tmp_path / "scene.mp4", 4), frame)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no such video file"):
        read_frames(tmp_path / "none.mp4")


def test_folder_instead_of_a_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no such video file"):
        read_frames(tmp_path)


def test_empty_file(tmp_path: Path) -> None:
    path = tmp_path / "empty.mp4"
    path.touch()
    with pytest.raises(InputError, match="the video file is empty"):
        read_frames(path)


def test_file_that_is_no_video(tmp_path: Path) -> None:
    path = tmp_path / "letter.mp4"
    path.write_text("Dear reader, this is no video.\n" * 100)
    with pytest.raises(InputError, match="not a video that can be read"):
        read_frames(path)


def test_file_cut_short(tmp_path: Path) -> None:
    whole = write(tmp_path / "scene.mp4", 30).read_bytes()
    path = tmp_path / "cut.mp4"
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="cut short"):
        read_frames(path)


def test_file_whose_last_frames_are_missing(tmp_path: Path) -> None:
    """A damaged stream whose index is whole."""
    content = bytearray(write(tmp_path / "scene.mp4", 60).read_bytes())
    start = content.index(b"mdat") + 4
    end = content.index(b"moov") - 4
    middle = start + (end - start) // 3
    content[middle:end] = bytes(end - middle)
    path = tmp_path / "damaged.mp4"
    path.write_bytes(content)
    with pytest.raises(InputError, match="cut short"):
        read_frames(path)


def test_video_of_one_frame(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the video has 1 frame; at least two are needed"):
        read_frames(write(tmp_path / "short.mp4", 1))


def test_each_message_is_one_sentence_with_the_path(tmp_path: Path) -> None:
    path = tmp_path / "empty.mp4"
    path.touch()
    with pytest.raises(InputError) as raised:
        read_frames(path)
    assert str(raised.value).startswith(str(path))
    assert "\n" not in str(raised.value)
