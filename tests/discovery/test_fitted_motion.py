"""Small changes that are carried through a fitted motion are those that the simulator makes of them."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.discovery.fitted import fitted
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion, Kicks
from vrdp_prob.inference.several_videos.parts import plain_likelihood
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.likelihood import Likelihood

STEP = 1e-6


def motions() -> list[tuple[Likelihood, np.ndarray, FittedMotion]]:
    _, fit = fitted(seed=1)
    parts = [(video.likelihood, fit.joint.point(k)) for k, video in enumerate(fit.joint.videos)]
    return [(likelihood, point, FittedMotion.of(likelihood, point)) for likelihood, point in parts]


def slope(likelihood: Likelihood, point: np.ndarray, place: int) -> np.ndarray:
    """Derivative of all measured numbers by one unknown."""
    move = STEP * np.eye(len(point))[place]
    ends = likelihood.predicted(torch.from_numpy(np.stack([point + move, point - move])))
    return (ends[0] - ends[1]) / (2 * STEP)


def off(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference, in units of the largest number."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize("video", range(3))
def test_a_kick_at_the_release_is_another_release_velocity(video: int) -> None:
    likelihood, point, motion = motions()[video]
    places = likelihood.coordinates.places
    moving = [body for body in range(3) if ("velocity_x", body) in places]
    kicks = Kicks.single(motion.tracks.first_seen[moving], np.array(moving))
    found = motion.kicked(kicks)
    for k, body in enumerate(moving):
        for axis, name in enumerate(("velocity_x", "velocity_y")):
            expected = slope(likelihood, point, places[name, body])
            assert off(found[..., :2, 2 * k + axis], expected[..., :2]) < 1e-3


@pytest.mark.parametrize("video", range(3))
def test_a_push_is_a_tilt_of_the_table(video: int) -> None:
    _, fit = fitted(seed=1)
    likelihood, point, motion = motions()[video]
    part = fit.fits[video]
    tilted = plain_likelihood(part.clues, fit.model.with_effect(SurfaceTilt()), fit.structures[video])
    names = {entry.field: place for place, entry in enumerate(tilted.coordinates.entries) if "tilt" in entry.field}
    start = likelihood.coordinates.carried(point, tilted.coordinates)
    for name, place in names.items():
        start[place] = 0.0
        expected = slope(tilted, start, place)
        axis = "xy".index(name[-1])
        push = np.broadcast_to(np.eye(2)[axis], motion.velocity.shape)[..., None]
        scale = float(np.nansum(expected[..., axis] * motion.pushed(push)[..., axis, 0]))
        scale /= float(np.nansum(motion.pushed(push)[..., axis, 0] ** 2))
        assert abs(scale) == pytest.approx(9.81, rel=0.03)
        assert off(scale * motion.pushed(push)[..., :2, 0], expected[..., :2]) < 0.03


def test_where_nothing_is_asked_for_nothing_is_changed() -> None:
    """As of accelerations where frames lie too far apart for any stretch of a path to hold several of them."""
    motion = motions()[0][2]
    none = motion.pushed(np.zeros((*motion.velocity.shape, 0)))
    assert none.shape == (*motion.speed.shape, 3, 0)


def test_grown_radii_change_the_motion_as_larger_ones_do() -> None:
    for likelihood, point, motion in motions():
        ends = []
        for factor in (1 + STEP, 1 - STEP):
            bodies = tuple(replace(b, radius=factor * b.radius) for b in likelihood.tracks.bodies if b.radius)
            tracks = replace(likelihood.tracks, bodies=bodies)
            ends.append(replace(likelihood, tracks=tracks).predicted(torch.from_numpy(point[None]))[0])
        expected = (ends[0] - ends[1]) / (2 * STEP)
        assert off(motion.growth[..., :2], expected[..., :2]) < 1e-3


def test_a_contact_that_rebounds_more_is_one_with_more_restitution() -> None:
    for likelihood, point, motion in motions():
        contacts = FittedContacts.of(motion)
        pair = contacts.bodies[-1]
        place = likelihood.coordinates.places["restitution", int(pair[0])]
        mine = (contacts.bodies == pair[0]).any(axis=1)
        product = np.exp(sum(point[likelihood.coordinates.places["restitution", int(body)]] for body in pair))
        if mine.sum() > 1 or product > 0.95:
            continue
        size = contacts.events.impulse[-1] * product / (1 + product)
        push = np.zeros((len(contacts), 2, 1))
        push[-1, :, 0] = size * contacts.events.normal[-1]
        expected = slope(likelihood, point, place)
        assert off(contacts.pushed_apart(push)[..., :2, 0], expected[..., :2]) < 2e-3


def test_no_frame_next_to_a_contact_is_set_out_from() -> None:
    for _, _, motion in motions():
        apart = np.abs(motion.times[:, None] - motion.events.time[motion.events.kind == 0])
        assert (apart[motion.restart][1:] > 1e-3).all()
        assert (motion.nodes[1:] < np.arange(1, len(motion.times))).all()
