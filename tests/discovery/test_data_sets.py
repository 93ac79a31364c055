"""Data sets with hidden causes: reproducible, silent about the truth, and of the size that is asked for."""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from tests.discovery.causes import CATALOGUE
from tests.discovery.data_set import DataSet, Wanted, Yardstick, draw
from tests.discovery.hidden import GLIDING, MET_OFTEN, hide
from tests.discovery.laws import GRAVITY, Laws
from tests.discovery.measurement import Measurement
from tests.discovery.other_effects import ALL
from tests.discovery.refit import Freedom, leftover
from tests.discovery.refit_kernel import base_motion
from tests.discovery.scenes import Setting, draw_videos
from tests.discovery.test_generator import sliding
from vrdp_prob.datasets import read_folder

SMALL = Setting(videos=4, frames=60)
ROUGH = Measurement(dropout=0.1, outliers=0.02, angles=True, camera=True)


def test_the_catalogue_is_whole() -> None:
    causes = {cause.name for cause in ALL.values() if cause.catalogued}
    assert len(causes) == 20
    assert sum(not cause.catalogued for cause in ALL.values()) >= 6


@pytest.mark.parametrize("way", list(ALL))
def test_every_cause_changes_what_is_recorded_and_its_details_do_not_change_with_its_strength(way: str) -> None:
    cause = ALL[way]
    plain = draw_videos(SMALL, np.random.default_rng(2))
    strong, weak = (cause.hide(plain, share * cause.most, np.random.default_rng(3)) for share in (0.5, 0.4))
    if way != "sticky_contacts":  # needs slow contacts
        assert leftover(strong, plain, 0.002, Freedom(own_friction=False, own_restitution=False)).size > 0.05
    for video, other in zip(strong, weak, strict=True):
        for name in ("patch_x", "bowl_x", "rotation_x", "kick_time", "kick_body", "vortex_x", "shaking_rate"):
            assert getattr(video.laws, name) == getattr(other.laws, name)


def same(first: DataSet, second: DataSet) -> bool:
    return all(
        np.array_equal(one.positions, other.positions, equal_nan=True)
        for one, other in zip(first.tracks, second.tracks, strict=True)
    )


def test_a_seed_gives_the_same_data_and_the_same_scenes_whatever_is_hidden() -> None:
    tilted = [Wanted("surface_tilt", strength=0.002)]
    first, again = (draw(tilted, seed=5, setting=SMALL, measurement=ROUGH) for _ in range(2))
    null, other = draw(seed=5, setting=SMALL, measurement=ROUGH), draw(seed=6, setting=SMALL, measurement=ROUGH)
    assert same(first, again)
    assert not same(null, other)
    np.testing.assert_array_equal(first.truth.videos[0].mass, null.truth.videos[0].mass)
    np.testing.assert_array_equal(first.tracks[0].seen, null.tracks[0].seen)


def test_the_folder_is_read_back_and_tells_nothing_of_the_truth(tmp_path: Path) -> None:
    hidden = draw([Wanted("wall", strength=0.3), Wanted("magnus_curl", strength=0.1)], seed=1, setting=SMALL)
    null = draw(seed=1, setting=SMALL)
    for name, data in (("hidden", hidden), ("null", null)):
        data.write(tmp_path / name)
        for tracks, read in zip(data.tracks, read_folder(tmp_path / name), strict=True):
            np.testing.assert_allclose(read.positions, tracks.positions, atol=1e-8)
    assert sorted(p.name for p in (tmp_path / "hidden").iterdir()) == ["objects.csv", "tracks.csv"]
    assert (tmp_path / "hidden/objects.csv").read_text() == (tmp_path / "null/objects.csv").read_text()


def test_walls_cameras_masses_and_angles_are_written_where_they_are_asked_for(tmp_path: Path) -> None:
    setting = Setting(videos=2, frames=60, arena=3.0, same_bodies=True)
    measurement = Measurement(masses=True, angles=True, camera=True, wall_restitution=False)
    truth = draw(seed=3, setting=setting, measurement=measurement).write(tmp_path)
    first, second = read_folder(tmp_path)
    assert [wall.restitution for wall in first.walls] == [None] * 4
    assert first.bodies == second.bodies
    np.testing.assert_allclose([body.mass or np.nan for body in first.bodies], truth.videos[0].mass, rtol=1e-9)
    assert first.angles is not None
    assert first.camera is not None
    middle = first.camera.project(np.array([*truth.videos[0].centre, 0.0]))
    np.testing.assert_allclose(middle, (400, 400))


def test_noise_missing_frames_and_outliers_have_their_shares() -> None:
    data = draw(seed=4, setting=Setting(videos=6), measurement=ROUGH)
    seen = np.concatenate([tracks.seen.ravel() for tracks in data.tracks])
    wrong = np.concatenate([outliers.ravel() for outliers in data.truth.outliers])
    errors = np.concatenate(
        [
            (tracks.positions - video.motion.states[..., :2]).reshape(-1, 2)
            for tracks, video in zip(data.tracks, data.truth.videos, strict=True)
        ]
    )
    assert 0.8 < seen.mean() < 0.95
    assert 0.01 < wrong.mean() < 0.03
    assert np.std(errors[seen & ~wrong]) == pytest.approx(0.002, rel=0.05)
    assert np.std(errors[wrong]) == pytest.approx(0.3, rel=0.3)


def test_bodies_that_come_in_late_are_not_seen_before() -> None:
    data = draw(seed=8, setting=Setting(videos=6, frames=60, late=1.0))
    for tracks, video in zip(data.tracks, data.truth.videos, strict=True):
        assert video.release[-1] > 0
        assert not tracks.seen[tracks.times < video.release[-1], -1].any()
        there = tracks.times > video.release[-1]
        np.testing.assert_array_equal(tracks.seen[there], video.in_view[there])


def test_nothing_is_left_where_nothing_is_hidden() -> None:
    for setting in (Setting(videos=6), Setting(videos=2, arena=2.5)):
        plain = draw_videos(setting, np.random.default_rng(0))
        assert leftover(plain, plain, 0.002).size < 1e-3


def test_what_a_slope_leaves_of_one_sliding_body_is_what_a_fit_leaves() -> None:
    plain = sliding((0, 0, 1.5, 0), friction=0.05, laws=Laws(drag=0.03))
    hidden = plain.governed_by(tilt_x=0.0002, tilt_y=0.0004)
    places = hidden.motion.states[:, 0, :2]

    def residuals(unknowns: np.ndarray) -> np.ndarray:
        friction, drag = 0.05 * np.exp(unknowns[4]), 0.03 * np.exp(unknowns[5])
        fitted = [base_motion(unknowns[:4], friction, drag, time)[:2] for time in plain.stamps]
        prior = unknowns[4:] / np.hypot(1.0, [0.5, 0.0])
        return np.concatenate([(fitted - places).ravel() / 0.0002, prior])

    fit = least_squares(residuals, [0, 0, 1.5, 0, 0, 0], x_scale="jac", xtol=1e-12, ftol=1e-12)
    expected = np.sqrt((fit.fun[:-2].reshape(-1, 2) ** 2).sum(axis=1).mean())
    assert expected > 0.5
    assert leftover([hidden], [plain], 0.0002).size == pytest.approx(expected, rel=0.1)
    assert GRAVITY * 0.0004 * plain.stamps[-1] ** 2 / 2 > 3 * expected * 0.0002


@pytest.mark.parametrize("way", ["surface_tilt", "wall", "contact_radius_error", "lens_distortion", "grain"])
def test_a_strength_is_found_for_an_effect_size(way: str) -> None:
    (cause,) = draw([Wanted(way, effect_size=3.0)], seed=2, setting=SMALL).truth.causes
    assert cause.effect_size == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize("place", ["wall", "hidden_obstacle", "friction_patch", "external_impulse"])
def test_what_is_put_where_bodies_go_is_met_though_another_cause_stops_them_early(place: str) -> None:
    wanted = [Wanted(place, effect_size=4.0), Wanted("linear_drag", effect_size=4.0)]
    causes = draw(wanted, seed=1, setting=Setting(videos=6, bodies=3)).truth.causes
    assert [one.way for one in causes] == [place, "linear_drag"]
    assert all(one.trace > 1 for one in causes)


@pytest.mark.parametrize("way", MET_OFTEN)
def test_hidden_things_that_are_to_be_met_often_are_met_more_than_once(way: str) -> None:
    cause, plain = ALL[way], draw_videos(Setting(videos=6, bodies=3, resistance=GLIDING), np.random.default_rng(2))
    videos = cause.hide(plain, cause.most, np.random.default_rng(3))
    met = [int((video.motion.pairs >= len(video.shapes)).any(axis=1).sum()) for video in videos]
    assert sum(met) >= 3
    assert sum(count > 0 for count in met) >= 2
    assert cause.name in CATALOGUE


def test_between_walls_there_are_more_contacts() -> None:
    few = Setting(videos=6, bodies=2)
    contacts = {
        way: sum(len(video.motion.pairs) for video in hide([way], seed=1, setting=few).truth.videos)
        for way in ("speed_dependent_restitution", "restitution_between_walls")
    }
    assert contacts["restitution_between_walls"] > 1.5 * contacts["speed_dependent_restitution"]
    (cause,) = hide(["restitution_between_walls"], seed=1, setting=few).truth.causes
    assert cause.effect_size == pytest.approx(3.0, rel=0.1)


def test_a_cause_that_no_body_feels_leaves_no_trace() -> None:
    (cause,) = draw([Wanted("wall", strength=0.0)], seed=1, setting=SMALL).truth.causes
    assert cause.trace == 0


def test_small_effects_grow_in_proportion_to_their_strength() -> None:
    plain = draw_videos(SMALL, np.random.default_rng(7))
    yardstick = Yardstick("rotating_table", plain, 0, Measurement())
    sizes = [yardstick.left_by(strength).size for strength in (0.0005, 0.001, 0.002)]
    np.testing.assert_allclose(np.divide(sizes, sizes[0]), [1, 2, 4], rtol=0.05)


def test_frictions_ordered_by_mass_leave_something_only_where_bodies_have_none_of_their_own() -> None:
    plain = draw_videos(SMALL, np.random.default_rng(7))
    hidden = ALL["mass_dependent_friction"].hide(plain, 0.05, np.random.default_rng(0))
    own, common = (leftover(hidden, plain, 0.002, Freedom(own_friction=own)).size for own in (True, False))
    assert own < 0.2 * common


@pytest.mark.parametrize("wish", [{}, {"strength": 1.0, "effect_size": 1.0}])
def test_a_wish_has_either_a_strength_or_an_effect_size(wish: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="either"):
        Wanted("wall", **wish)
