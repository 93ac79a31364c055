"""Geometry of the static figures."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vrdp_prob.report.figures import path_data, still_figure
from vrdp_prob.scene import Wall


@given(st.integers(0, 2**32 - 1))
def test_thinned_paths_stay_close(seed):
    points = np.cumsum(np.random.default_rng(seed).normal(size=(60, 2)), axis=0)
    kept = np.array([[float(x) for x in pair.split()] for pair in path_data(points)[1:].split("L")])
    starts, chords = kept[:-1], np.diff(kept, axis=0)
    offsets = points[:, None] - starts
    along = np.clip((offsets * chords).sum(-1) / np.maximum((chords**2).sum(-1), 1e-12), 0, 1)
    distances = np.linalg.norm(offsets - along[..., None] * chords, axis=-1).min(axis=1)
    assert distances.max() < 0.35 + 0.1


def test_straight_path_needs_two_points():
    line = np.linspace([0.0, 0.0], [100.0, 50.0], 200)
    assert path_data(line) == "M0.0 0.0L100.0 50.0"
    assert path_data(line[:1]) == ""


def test_figure_lies_in_the_picture(content, plain_content):
    for case in (content, plain_content):
        figure = still_figure(case)
        dots = np.array([dot for track in figure.tracks for dot in track.dots])
        assert (dots >= -1).all()
        assert (dots <= [figure.width + 1, figure.height + 1]).all()


def test_future_of_the_rollouts_is_drawn(content):
    figure = still_figure(content)
    assert all(track.seen for track in figure.tracks)
    assert any(track.future and track.ends for track in figure.tracks)


def test_figure_without_worlds_shows_the_tracks(content):
    figure = still_figure(replace(content, worlds=()))
    assert all(track.dots and not track.seen for track in figure.tracks)


def test_walls_are_drawn(plain_content):
    walls = (Wall(-6.0, -4.0, 6.0, -4.0), Wall(6.0, -4.0, 6.0, 4.0))
    figure = still_figure(replace(plain_content, tracks=replace(plain_content.tracks, walls=walls)))
    ends = np.array([[float(x) for x in pair.split()] for wall in figure.walls for pair in wall[1:].split("L")])
    assert ends.shape == (4, 2)
    assert ((ends >= 0) & (ends <= [figure.width, figure.height])).all()
