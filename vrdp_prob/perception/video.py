"""Read a video file into an array, or say in one sentence why it cannot be."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from vrdp_prob.errors import InputError
from vrdp_prob.progress import ProgressDisplay, SilentProgress

DEFAULT_FRAME_RATE = 25.0
"""Frames per second where neither the camera nor the file says it."""

_TRUNCATION_TOLERANCE = 2
"""Frames by which a container's count may exceed what can be decoded in a file that is whole."""

_FFMPEG_QUIET = "-8"


@dataclass(frozen=True)
class Video:
    """All frames of a video.

    Parameters
    ----------
    name
        Stem of the file name.
    frames
        RGB pictures.
    frame_rate
        Frames per second as the file says, None where it does not.
    """

    name: str
    frames: UInt8[np.ndarray, "frame height width 3"]
    frame_rate: float | None


def read_frames(path: Path, *, frames: int | None = None, progress: ProgressDisplay | None = None) -> Video:
    """Decode a video file.

    Parameters
    ----------
    path
        Video file that OpenCV can read, for example mp4.
    frames
        Read only so many frames from the start; None reads all.
    progress
        Where to tell how far it is.

    Raises
    ------
    InputError
        If the file is missing, empty, no video, cut short, or has fewer than two frames.
    """
    pictures: list[UInt8[np.ndarray, "height width 3"]] = []
    with _opened(path) as capture, (progress or SilentProgress()).stage("Reading the video", frames) as advance:
        expected = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        rate = float(capture.get(cv2.CAP_PROP_FPS))
        while frames is None or len(pictures) < frames:
            decoded, picture = capture.read()
            if not decoded:
                break
            pictures.append(np.ascontiguousarray(picture[..., ::-1]))
            advance(1)
    wanted = expected if frames is None else min(expected, frames)
    if len(pictures) < wanted - _TRUNCATION_TOLERANCE:
        raise InputError(
            f"{path}: the video is cut short (frame {len(pictures)} of {expected} cannot be decoded); copy it anew."
        )
    if not pictures:
        raise InputError(
            f"{path}: the video has no frame that can be decoded; encode it anew, for example as h264 mp4."
        )
    if len(pictures) == 1:
        raise InputError(f"{path}: the video has 1 frame; at least two are needed to see motion.")
    return Video(path.stem, np.stack(pictures), rate if np.isfinite(rate) and rate > 0 else None)


def still(path: Path, frame: int) -> UInt8[np.ndarray, "height width 3"]:
    """One frame of a video as an RGB picture; `frame` counts from 0.

    Raises
    ------
    InputError
        If the file cannot be read or has no such frame.
    """
    if frame < 0:
        raise InputError(f"{path}: there is no frame {frame}; frames count from 0.")
    with _opened(path) as capture:
        for index in range(frame + 1):
            decoded, picture = capture.read()
            if not decoded:
                raise InputError(f"{path}: there is no frame {frame}; {index} frames can be decoded.")
    return np.ascontiguousarray(picture[..., ::-1])


@contextmanager
def _opened(path: Path) -> Iterator[cv2.VideoCapture]:
    """Open a file whose first bytes are those of a video."""
    if not path.is_file():
        raise InputError(f"{path}: there is no such video file; check the path.")
    try:
        with path.open("rb") as file:
            head = file.read(1)
    except OSError as error:
        raise InputError(f"{path}: the video cannot be read ({error.strerror}); check its permissions.") from error
    if not head:
        raise InputError(f"{path}: the video file is empty; copy it anew.")
    with _quiet_decoder():
        capture = cv2.VideoCapture(str(path))
        try:
            if not capture.isOpened():
                raise InputError(f"{path}: not a video that can be read, or it is cut short; give for example an mp4.")
            yield capture
        finally:
            capture.release()


@contextmanager
def _quiet_decoder() -> Iterator[None]:
    """OpenCV's own complaints on standard error would stand beside our one sentence."""
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", _FFMPEG_QUIET)
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(level)
