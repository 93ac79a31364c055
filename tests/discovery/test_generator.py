"""The integrator of the hidden-effect videos: closed forms, conservation laws, run back, and with finer steps."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.discovery.laws import GRAVITY, Laws
from tests.discovery.other_effects import ALL
from tests.discovery.refit_kernel import base_motion
from tests.discovery.scenes import Setting, draw_videos
from tests.discovery.videos import STEP, Disc, UnendingMotionError, Video, move, recorded
from vrdp_prob.scene import Shape, Wall

TIMES = np.linspace(0.0, 2.0, 21)
PRESSING = ("pair_force", "shaking")
"""Causes that press bodies together: they bounce ever less, and which bounce is the last hangs on the step."""


def sliding(
    *rows: tuple[float, float, float, float], friction: float = 0.0, shape: Shape = Shape.CYLINDER, **changes: Any
) -> Video:
    """A video of equal bodies at x, y with vx, vy."""
    count, states = len(rows), np.array(rows, dtype=float)
    video = Video(
        shapes=(shape,) * count,
        materials=("metal",) * count,
        position=states[:, :2],
        velocity=states[:, 2:],
        angle=np.zeros(count),
        spin=np.zeros(count),
        release=np.zeros(count),
        mass=np.linspace(1.0, 2.0, count),
        radius=np.full(count, 0.2),
        restitution=np.full(count, 0.9),
        friction=np.full(count, friction),
        frames=50,
    )
    return replace(video, **changes)


def states(video: Video, times: np.ndarray = TIMES) -> np.ndarray:
    return move(video, times).states


@pytest.mark.parametrize("drag", [pytest.param(0.01, marks=pytest.mark.slow), 0.4])
def test_friction_and_drag_stop_a_body_as_in_closed_form(drag: float) -> None:
    video = sliding((0, 0, 0.6, 0.8), friction=0.06, laws=Laws(drag=drag))
    expected = [base_motion(np.array([0, 0, 0.6, 0.8]), 0.06, drag, time) for time in TIMES]
    np.testing.assert_allclose(states(video)[:, 0, :4], expected, atol=1e-8)


@pytest.mark.parametrize(("slope", "slide"), [(0.019, 0.0), (0.03, 0.01)])
def test_a_resting_body_stays_until_the_slope_is_steeper_than_its_friction(slope: float, slide: float) -> None:
    video = sliding((0, 0, 0, 0), friction=0.02, laws=Laws(tilt_x=slope))
    np.testing.assert_allclose(states(video)[:, 0, 0], slide * GRAVITY * TIMES**2 / 2, atol=1e-9)


def test_a_body_that_slides_uphill_comes_to_rest_there() -> None:
    video = sliding((0, 0, -1, 0), friction=0.05, laws=Laws(tilt_x=0.03))
    assert states(video)[-1, 0, 0] == pytest.approx(-1 / (2 * 0.08 * GRAVITY), abs=1e-8)


def test_linear_and_cubic_drag() -> None:
    linear = states(sliding((0, 0, 1, 0), laws=Laws(linear_drag=0.7)))
    cubic = states(sliding((0, 0, 1, 0), laws=Laws(cubic_drag=0.7)))
    np.testing.assert_allclose(linear[:, 0, 2], np.exp(-0.7 * TIMES), atol=1e-9)
    np.testing.assert_allclose(cubic[:, 0, 2], 1 / np.sqrt(1 + 1.4 * TIMES), atol=1e-9)


def test_a_body_in_the_wind_is_dragged_as_if_it_moved_in_still_air() -> None:
    windy = states(sliding((0, 0, 1, 0.5), laws=Laws(drag=0.3, wind_x=-1.0, wind_y=2.0)))
    still = states(sliding((0, 0, 2, -1.5), laws=Laws(drag=0.3)))
    np.testing.assert_allclose(windy[:, 0, 2:4] - (-1.0, 2.0), still[:, 0, 2:4], atol=1e-9)


def test_curl_bends_the_path_of_a_spinning_body_to_a_circle() -> None:
    found = states(sliding((0, 0, 1, 0), spin=np.array([4.0]), laws=Laws(curl=0.2)))
    np.testing.assert_allclose(found[:, 0, 2:4], np.column_stack([np.cos(0.8 * TIMES), np.sin(0.8 * TIMES)]), atol=1e-9)


def test_a_bowl_swings() -> None:
    found = states(sliding((1.3, 0.2, 0, 0), laws=Laws(bowl=4.0, bowl_x=0.3, bowl_y=0.2)))
    np.testing.assert_allclose(found[:, 0, 0], 0.3 + np.cos(2 * TIMES), atol=1e-9)


def test_seen_from_a_turning_table_a_free_body_goes_straight_in_the_room() -> None:
    rate, middle = 0.7, np.array([0.4, -0.1])
    found = states(sliding((1, 0, 0.3, 0.5), laws=Laws(rotation=rate, rotation_x=0.4, rotation_y=-0.1)))[:, 0]
    turn = np.exp(1j * rate * TIMES)
    room = (found[:, :2] - middle) @ (1, 1j) * turn
    velocity = (0.3 + 0.5j) + 1j * rate * ((1 - middle[0]) + (0 - middle[1]) * 1j)
    np.testing.assert_allclose(room, room[0] + velocity * TIMES, atol=1e-9)


def test_a_patch_takes_its_energy_on_the_way_across() -> None:
    laws = Laws(patch_friction=2.0, patch_x=1.0, patch_y=0.3, patch_radius=0.5)
    video = sliding((0, 0, 2, 0), friction=0.05, laws=laws)
    found = states(video)
    beyond = found[found[:, 0, 0] > 1.5][0, 0]
    lost = 2 * 0.05 * GRAVITY * (beyond[0] + 2 * 0.8)
    assert beyond[2] == pytest.approx(np.sqrt(4 - lost), abs=1e-8)


def test_friction_that_grows_with_time() -> None:
    found = states(sliding((0, 0, 3, 0), friction=0.05, laws=Laws(friction_trend=0.4)))
    np.testing.assert_allclose(found[:, 0, 2], 3 - 0.05 * GRAVITY * (TIMES + 0.2 * TIMES**2), atol=1e-9)


def test_a_sphere_slips_until_it_rolls_at_five_sevenths() -> None:
    video = sliding((0, 0, 1.4, 0), shape=Shape.SPHERE, laws=Laws(slip_friction=0.1))
    slipping = 2 * 1.4 / (7 * 0.1 * GRAVITY)
    found = states(video)[:, 0]
    expected = np.where(slipping > TIMES, 1.4 - 0.1 * GRAVITY * TIMES, 1.0)
    np.testing.assert_allclose(found[:, 2], expected, atol=1e-8)
    assert found[-1, 6] == pytest.approx(found[-1, 2])


def test_attraction_conserves_energy_and_momentum() -> None:
    video = sliding((-0.4, 0, 0, 0.3), (0.4, 0.1, 0, -0.3), laws=Laws(pair_strength=0.2, pair_softening=0.3))
    found = states(video)
    apart = np.linalg.norm(found[:, 0, :2] - found[:, 1, :2], axis=1)
    moving = (video.mass * (found[..., 2:4] ** 2).sum(axis=-1) / 2).sum(axis=1)
    energy = moving - 0.2 / np.sqrt(apart**2 + 0.09)
    assert np.ptp(energy) < 1e-9
    assert np.ptp(video.mass @ found[..., 2:4], axis=0).max() < 1e-9
    assert np.ptp(apart) > 0.04


def test_forces_square_to_the_velocity_do_no_work() -> None:
    found = states(sliding((0.2, 0.3, 0.9, 0.4), laws=Laws(field_x=1.5, field_y=-0.5)))
    speed = np.linalg.norm(found[:, 0, 2:4], axis=1)
    assert np.ptp(speed) < 1e-9
    assert np.ptp(found[:, 0, 3]) > 0.3


def test_a_shaken_table() -> None:
    found = states(sliding((0, 0, 0, 0), laws=Laws(shaking_x=2.0, shaking_rate=0.5)))
    np.testing.assert_allclose(found[:, 0, 2], 2 * (1 - np.cos(np.pi * TIMES)) / np.pi, atol=1e-5)


def test_a_kick_comes_at_its_time() -> None:
    laws = Laws(kick_time=0.5123, kick_body=0, kick_x=0.2, kick_y=-0.4)
    found = states(sliding((0, 0, 1, 0), laws=laws))
    np.testing.assert_allclose(found[:, 0, 1], -0.4 * np.maximum(TIMES - 0.5123, 0), atol=1e-12)


def test_a_body_that_is_not_released_waits() -> None:
    found = states(sliding((0, 0, 1, 0), release=np.array([0.737])))
    np.testing.assert_allclose(found[:, 0, 0], np.maximum(TIMES - 0.737, 0), atol=1e-12)


@pytest.mark.parametrize("shape", [Shape.SPHERE, Shape.CYLINDER])
def test_a_wall_throws_back_with_the_product_of_restitutions(shape: Shape) -> None:
    wall = Wall(1.0, -5.0, 1.0, 5.0, restitution=0.5)
    found = move(sliding((0, 0, 1, 0.3), shape=shape, hidden_walls=(wall,)), TIMES)
    np.testing.assert_allclose(found.states[-1, 0, 2:4], (-0.45, 0.3), atol=1e-12)
    np.testing.assert_allclose(found.contact_times, [0.8], atol=1e-9)


def test_a_square_that_hits_a_wall_with_a_corner_starts_to_spin() -> None:
    wall = Wall(1.0, -5.0, 1.0, 5.0, restitution=1.0)
    video = sliding((0, 0, 1, 0), shape=Shape.CUBE, angle=np.array([0.3]), restitution=np.ones(1), hidden_walls=(wall,))
    found = move(video, TIMES).states[:, 0]
    energy = found[:, 2] ** 2 / 2 + found[:, 5] ** 2 * (2 / 3 * 0.04) / 2
    np.testing.assert_allclose(energy, 0.5, atol=1e-12)
    assert abs(found[-1, 5]) > 1


def test_a_hidden_disc_is_a_heavy_body() -> None:
    disc = Disc(0.9, 0.0, 0.3, 0.5)
    found = move(sliding((0, 0, 1, 0), hidden_discs=(disc,)), TIMES)
    assert found.states[-1, 0, 2] == pytest.approx(-0.45)
    assert found.contact_times == pytest.approx([0.4])


def test_bodies_touch_where_they_are_told_to() -> None:
    found = move(sliding((0, 0, 1, 0), (1, 0, 0, 0), touching=1.1), TIMES)
    assert found.contact_times == pytest.approx([1 - 0.44])


def test_restitution_falls_with_the_closing_speed() -> None:
    laws = Laws(restitution_power=0.5, restitution_speed=0.5)
    found = states(sliding((0, 0, 1.5, 0), (1, 0, 0, 0), laws=laws))[-1]
    assert found[1, 2] - found[0, 2] == pytest.approx(1.5 * 0.81 * 4**-0.5)


def test_slow_contacts_stick_below_their_speed() -> None:
    found = states(sliding((0, 0, 0.9, 0), (1, 0, 0, 0), laws=Laws(sticking_speed=1.0)))[-1]
    assert found[1, 2] == pytest.approx(found[0, 2])


@pytest.mark.parametrize("coefficient", [0.1, 5.0])
def test_rubbing_is_limited_by_the_normal_impulse_and_by_sticking(coefficient: float) -> None:
    video = sliding((0, 0, 1, 0), (1, 0, 0, 0), spin=np.array([6.0, 0.0]), laws=Laws(contact_friction=coefficient))
    before, after = move(video, TIMES).around[0]
    normal, along = video.mass[1] * after[1, 2], video.mass[1] * after[1, 3]
    if coefficient == 0.1:
        assert along == pytest.approx(0.1 * normal)
    else:
        surface = after[:, 3] + np.array([0.2, -0.2]) * after[:, 5]
        assert surface[0] == pytest.approx(surface[1])
    turning = video.mass * 0.02 * after[:, 5] + video.mass * (after[:, 0] * after[:, 3] - after[:, 1] * after[:, 2])
    assert turning.sum() == pytest.approx(0.02 * before[0, 5])


def test_contacts_that_stick_spring_back_across() -> None:
    laws = Laws(contact_friction=5.0, tangential_restitution=0.6)
    video = sliding((0, 0, 1, 0), (1, 0, 0, 0), spin=np.array([6.0, 0.0]), laws=laws)
    before, after = (states[:, 3] + np.array([0.2, -0.2]) * states[:, 5] for states in move(video, TIMES).around[0])
    assert after[1] - after[0] == pytest.approx(-0.6 * (before[1] - before[0]))


def crowd(seed: int) -> Video:
    """Six bodies of all shapes that meet often, without friction or loss."""
    setting = Setting(videos=1, bodies=6, frames=60, late=0.0)
    (video,) = draw_videos(setting, np.random.default_rng(seed))
    walls = tuple(
        Wall(x1, y1, x2, y2, restitution=1.0)
        for x1, y1, x2, y2 in ((-3, -3, 3, -3), (3, -3, 3, 3), (3, 3, -3, 3), (-3, 3, -3, -3))
    )
    return replace(video, laws=Laws(), friction=np.zeros(6), restitution=np.ones(6), walls=walls)


@pytest.mark.parametrize("seed", range(3))
def test_without_friction_and_loss_energy_is_kept_and_the_motion_runs_back(seed: int) -> None:
    video = crowd(seed)
    found = video.motion.states
    inertia = video.mass * video.radius**2 * [{"sphere": 0.4, "cylinder": 0.5, "cube": 2 / 3}[s] for s in video.shapes]
    energy = (video.mass * (found[..., 2:4] ** 2).sum(axis=-1) + inertia * found[..., 5] ** 2).sum(axis=1)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)
    last = found[-1]
    back = replace(video, position=last[:, :2], velocity=-last[:, 2:4], angle=last[:, 4], spin=-last[:, 5])
    np.testing.assert_allclose(back.motion.states[::-1, :, :2], found[..., :2], atol=2e-4)
    assert len(video.motion.pairs) >= 3


@pytest.mark.parametrize("seed", range(3))
def test_contacts_keep_momentum_and_angular_momentum(seed: int) -> None:
    video = replace(crowd(seed), walls=(), restitution=np.full(6, 0.7), laws=Laws(contact_friction=0.3))
    found = video.motion.states
    inertia = video.mass * video.radius**2 * [{"sphere": 0.4, "cylinder": 0.5, "cube": 2 / 3}[s] for s in video.shapes]
    momentum = video.mass @ found[..., 2:4]
    orbit = found[..., 0] * found[..., 3] - found[..., 1] * found[..., 2]
    turning = orbit @ video.mass + found[..., 5] @ inertia
    np.testing.assert_allclose(momentum - momentum[0], 0, atol=1e-9)
    np.testing.assert_allclose(turning, turning[0], atol=1e-7)


@pytest.mark.parametrize("way", list(ALL))
def test_finer_steps_give_the_same_motion(way: str) -> None:
    cause, generator = ALL[way], np.random.default_rng(4)
    plain = draw_videos(Setting(videos=1, frames=40), generator)
    strength = cause.least + 0.3 * (cause.most - cause.least)
    (video,) = cause.hide(plain, strength, np.random.default_rng(0))
    coarse, fine = video.motion, move(video, step=STEP / 3)
    np.testing.assert_array_equal(coarse.pairs, fine.pairs)
    np.testing.assert_allclose(coarse.states[..., :2], fine.states[..., :2], atol=1e-3 if way in PRESSING else 5e-5)


def test_bodies_that_touch_without_end_are_reported() -> None:
    rows = [(0.4001 * k, 0.0, 0.0, 0.0) for k in range(3)]
    with pytest.raises(UnendingMotionError, match="without end"):
        states(sliding(*rows, friction=0.01, laws=Laws(pair_strength=80.0, pair_softening=0.05)))


def test_the_lens_moves_places_away_from_its_middle() -> None:
    video = sliding((0, 0, 0, 0), distortion=0.1, centre=(1.0, 0.0))
    np.testing.assert_allclose(recorded(video, np.array([[3.0, 0.0], [1.0, 0.0]])), [[3.8, 0.0], [1.0, 0.0]])
