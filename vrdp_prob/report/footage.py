"""What the report shows of the video itself: a still, the empty floor, and a short film under the rollouts."""

import base64

import cv2
import numpy as np
from jaxtyping import UInt8

from vrdp_prob.perception.background import estimate_background
from vrdp_prob.report.content import Footage
from vrdp_prob.scene import Tracks

FILM_FRAMES = 64
"""Most frames of the film that travels inside the page."""

_STILL_QUALITY, _FILM_QUALITY = 90, 70


def footage(frames: UInt8[np.ndarray, "frame height width 3"], tracks: Tracks) -> Footage:
    """Choose what to show of a video.

    Parameters
    ----------
    frames
        All pictures of the video; channels red, green, blue. They run at the tracks' frame rate from time 0.
    tracks
        Where the objects were seen: the still is the last frame that shows as many of them as any.
    """
    times = np.arange(len(frames)) / tracks.frame_rate
    counts = tracks.seen.sum(axis=1)
    best = tracks.times[len(counts) - 1 - int(counts[::-1].argmax())]
    index = int(np.abs(times - best).argmin())
    kept = slice(None, None, -(-len(frames) // FILM_FRAMES))
    floor = estimate_background(frames).rounded
    return Footage(frames[index], float(times[index]), floor, frames[kept], times[kept])


def still_uri(image: UInt8[np.ndarray, "height width 3"]) -> str:
    """A picture as the address of itself, to stand in a page."""
    return "data:image/jpeg;base64," + _jpeg(image, _STILL_QUALITY)


def film_data(shown: Footage) -> dict[str, list[float] | list[str]]:
    """The film for the player: times in s and JPEG pictures in base64."""
    return {
        "times": [round(float(time), 4) for time in shown.film_times],
        "pictures": [_jpeg(picture, _FILM_QUALITY) for picture in shown.film],
    }


def _jpeg(image: UInt8[np.ndarray, "height width 3"], quality: int) -> str:
    encoded, data = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not encoded:
        raise ValueError("a picture of the video could not be encoded as JPEG")
    return base64.b64encode(data.tobytes()).decode("ascii")
