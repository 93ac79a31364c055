"""What limits a finding by the tracks themselves."""

from dataclasses import replace

import numpy as np

from vrdp_prob.discovery.discover import _from_first_frames, _in_motion
from vrdp_prob.discovery.notes import limits, not_asked, not_explained
from vrdp_prob.inference import default_model
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.scene import Body, Shape, Tracks


def _tracks(video: str, step: float, *, start: float = 0.0) -> Tracks:
    times = start + step * np.arange(40.0)
    places = np.random.default_rng(1).normal(0, 1e-3, (40, 1, 2)) + 0.1 * np.arange(40.0)[:, None, None] * step
    return Tracks.from_arrays(video, (Body("a", Shape.CYLINDER, 0.1),), times, places)


def test_nothing_limits_ordinary_tracks() -> None:
    assert limits([_tracks("v", 0.04), _tracks("w", 0.04)]) == []


def test_what_is_true_of_some_videos_is_told_of_these() -> None:
    (sentence,) = limits([_tracks("v", 0.04), _tracks("w", 33.0)])
    assert sentence.startswith("w: Frames are 33 s apart")
    assert "see whether times are in s" in sentence


def test_what_is_true_of_all_is_told_once() -> None:
    assert limits([_tracks("v", 0.04, start=1.7e9), _tracks("w", 0.04, start=1.8e9)]) == [
        "Times are counted from the first frame, since they began long after their zero."
    ]


def test_of_a_limit_that_many_videos_have_one_is_told() -> None:
    (sentence,) = limits([_tracks("u", 2.0), _tracks("v", 0.04), _tracks("w", 33.0), _tracks("x", 0.5)])
    assert sentence.startswith("u (and two other videos alike): Frames are 2 s apart")


def test_videos_in_which_nothing_moves_are_left_out_where_enough_are_left() -> None:
    moving = [_tracks(name, 0.04) for name in "uvw"]
    noise = np.random.default_rng(2).normal(0, 1e-3, (40, 1, 2))
    rest = Tracks.from_arrays("rest", moving[0].bodies, moving[0].times, noise)
    assert _in_motion(moving) == (moving, [])
    seen, still = _in_motion([moving[0], rest, *moving[1:]])
    assert [one.video for one in seen] == ["u", "v", "w"]
    assert still == ["rest"]
    assert _in_motion([rest, *moving[1:]])[1] == []


def test_times_of_clips_of_one_recording_are_counted_from_their_first_frames() -> None:
    clips = [_tracks("v", 0.04), _tracks("w", 0.04, start=1.0)]
    assert _from_first_frames(clips) is clips
    for one in _from_first_frames([*clips, _tracks("x", 0.04, start=60.0)]):
        np.testing.assert_allclose(one.times, 0.04 * np.arange(40.0), atol=1e-9)


def _fit(video: str, residual_sd: float) -> MapFit:
    """A fit that is off by so much (m), where the noise is 1 mm."""
    fit = fit_map(_tracks(video, 0.04), default_model(), np.random.default_rng(0))
    return replace(fit, misfit=replace(fit.misfit, residual_sd=residual_sd, noise_sd=1e-3))


def test_videos_that_are_not_explained_are_told_of() -> None:
    fine, off, worst = _fit("u", 1.2e-3), _fit("v", 4e-3), _fit("w", 0.25)
    assert not_explained([fine]) == []
    (sentence,) = not_explained([fine, off])
    assert sentence.startswith(
        "What is seen in v is not explained: after the best fit positions are off by 0.004 m, 4 "
    )
    (sentence,) = not_explained([fine, off, worst])
    assert sentence.startswith(
        "What is seen in 2 of the 3 videos is not explained: after the best fit positions are off "
    )
    assert "by 0.25 m in w, the worst, 250 times the noise." in sentence


def test_what_only_some_videos_tell_is_not_asked_and_that_is_told() -> None:
    plain, other = _tracks("v", 0.04), _tracks("w", 0.04)
    assert not_asked([plain, other]) == []
    angles = np.zeros((40, 1))
    turning = Tracks.from_arrays("x", plain.bodies, plain.times, plain.positions, angles=angles)
    (sentence,) = not_asked([plain, turning])
    assert sentence.startswith("Whether the motion depends on spin is not asked, since v does not tell the angles")
    heavy = replace(plain, bodies=(replace(plain.bodies[0], mass=1.0),))
    (sentence,) = not_asked([heavy, other])
    assert "the masses of some bodies only are stated" in sentence
