"""What is shown of the video itself."""

import base64

import cv2
import numpy as np
from example_content import make_tracks

from vrdp_prob.report.footage import FILM_FRAMES, film_data, footage
from vrdp_prob.scene import Camera


def moving_square(frames):
    video = np.full((frames, 80, 120, 3), 150, dtype=np.uint8)
    for frame in range(frames):
        video[frame, 30:45, frame // 2 : frame // 2 + 15] = (200, 30, 30)
    return video


def test_still_shows_as_many_objects_as_any_frame():
    tracks = make_tracks(Camera.clevrer())
    video = moving_square(128)
    shown = footage(video, tracks)
    frame = round(shown.time * 25)
    assert np.array_equal(shown.still, video[frame])
    counts = tracks.seen.sum(axis=1)
    assert counts[frame] == counts.max()
    assert (counts[frame + 1 :] < counts.max()).all()


def test_floor_has_no_object():
    shown = footage(moving_square(128), make_tracks(Camera.clevrer()))
    assert np.abs(shown.floor.astype(int) - 150).max() <= 3


def test_film_is_short_and_in_step():
    video = moving_square(128)
    shown = footage(video, make_tracks(Camera.clevrer()))
    assert len(shown.film) <= FILM_FRAMES
    assert np.allclose(shown.film_times * 25, np.rint(shown.film_times * 25))
    assert np.array_equal(shown.film[10], video[round(shown.film_times[10] * 25)])


def test_colours_survive_the_way_into_the_page():
    shown = footage(moving_square(128), make_tracks(Camera.clevrer()))
    picture = np.frombuffer(base64.b64decode(film_data(shown)["pictures"][20]), dtype=np.uint8)
    decoded = cv2.imdecode(picture, cv2.IMREAD_COLOR)[..., ::-1].astype(int)
    assert np.abs(decoded - shown.film[20]).mean() < 4
