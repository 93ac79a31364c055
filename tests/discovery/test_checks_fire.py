"""Checks fire on what they are for: the generator's change of the measured places, on top of what a null leaves."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from jaxtyping import Float

from tests.discovery.fitted import fitted, moved
from tests.discovery.test_checks import by_name
from tests.discovery.videos import Video, move, recorded
from vrdp_prob.discovery.checks.clock import LOST, SINGLE
from vrdp_prob.discovery.checks.contacts import DISTANCE, contact_checks
from vrdp_prob.discovery.checks.flight import free_flight_checks
from vrdp_prob.discovery.checks.kicks import KICK
from vrdp_prob.discovery.checks.measurement import DISTORTION, OUTLIERS, measurement_checks
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.scene import Body, Shape

REPLICAS = 60
FAINT = 1e-3
"""Share of an effect of which the change of the motion is taken, so that no contact comes earlier."""
CHANCE = 1e-3
"""Probability below which a check fires: there are some twenty."""

Changes = Callable[[Video], Float[np.ndarray, "time body 2"]]


@cache
def null() -> tuple[tuple[Video, ...], ResidualModel]:
    data, fit = fitted(seed=1)
    return data.truth.videos, ResidualModel.of(fit)


def checked(model: ResidualModel) -> Mapping[str, Check]:
    """Checks of contacts and of the measurement, by name."""
    generator = np.random.default_rng(0)
    flight = FreeFlight.of(model)
    replicas, beside = (one.replicas(REPLICAS, generator) for one in (model, flight.beside))
    measured = measurement_checks(model, replicas, flight, beside, generator)
    return by_name((*contact_checks(model, flight, beside), *measured))


def faintly(video: Video, other: Video) -> Float[np.ndarray, "time body 2"]:
    return np.asarray(other.motion.states[..., :2] - video.motion.states[..., :2]) / FAINT


def larger(video: Video) -> Float[np.ndarray, "time body 2"]:
    return 0.02 * faintly(video, replace(video, touching=1 + FAINT))


def kicked(video: Video) -> Float[np.ndarray, "time body 2"]:
    """A kick of the first body that moves for long."""
    speed = np.linalg.norm(video.motion.states[..., 2:4], axis=-1)
    body = int(speed.min(axis=0).argmax())
    return faintly(video, video.governed_by(kick_time=1.0, kick_body=float(body), kick_x=0.2 * FAINT, kick_y=0.0))


def lost(video: Video) -> Float[np.ndarray, "time body 2"]:
    late = np.where(video.stamps > 0.8, 0.02, 0.0)
    return np.asarray(move(video, video.stamps + late).states[..., :2] - video.motion.states[..., :2])


def irregular(video: Video) -> Float[np.ndarray, "time body 2"]:
    late = 0.008 * np.random.default_rng(3).standard_normal(video.frames)
    late[0] = 0.0
    return np.asarray(move(video, video.stamps + late).states[..., :2] - video.motion.states[..., :2])


def bent(video: Video) -> Float[np.ndarray, "time body 2"]:
    places = video.motion.states[..., :2]
    return np.asarray(recorded(replace(video, distortion=0.04), places) - places)


def test_none_fires_where_nothing_is_wrong() -> None:
    found = checked(null()[1])
    assert {DISTANCE, KICK, LOST, SINGLE, DISTORTION, OUTLIERS} <= set(found)
    assert min(check.p_value for check in found.values()) > CHANCE


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        (DISTANCE, larger, "farther apart than the sum of their radii"),
        (KICK, kicked, "Without a partner in reach"),
        (LOST, lost, "jump ahead along their paths together"),
        (SINGLE, irregular, "too early or too late for all bodies"),
        (DISTORTION, bent, "away from the middle of the picture"),
    ],
)
def test_a_check_fires_on_what_it_is_for(name: str, change: Changes, says: str) -> None:
    videos, model = null()
    found = checked(moved(model, [change(video) for video in videos]))
    assert found[name].p_value < CHANCE
    assert says in found[name].sentence
    assert found[name].p_value == min(found[one].p_value for one in (DISTANCE, KICK, LOST, SINGLE, DISTORTION))


@pytest.mark.parametrize(
    ("name", "belongs", "says"),
    [
        ("shape", lambda body: body.shape is Shape.SPHERE, "Bodies of one shape are pushed sideways"),
        ("material", lambda body: body.material == "metal", "Bodies of one material are pushed sideways"),
    ],
)
def test_a_push_to_the_side_of_some_bodies_is_told_by_what_they_are(
    name: str, belongs: Callable[[Body], bool], says: str
) -> None:
    _, model = null()
    changes, chosen = [], 0
    for video in model.videos:
        motion = video.motion
        some = np.array([belongs(body) for body in motion.tracks.bodies])
        chosen += int(some.sum())
        left = np.stack([-motion.velocity[..., 1], motion.velocity[..., 0]], axis=-1)
        changes.append(motion.pushed(0.5 * (some[:, None] * left)[..., None])[:, :, :2, 0])
    assert 0 < chosen < sum(len(video.motion.tracks.bodies) for video in model.videos)
    before, after = (by_name(free_flight_checks(FreeFlight.of(one))) for one in (model, moved(model, changes)))
    check = f"acceleration across the velocity against {name}"
    assert before[check].p_value > CHANCE
    assert after[check].p_value < CHANCE
    assert after[check].sentence.startswith(says)


def grossly_wrong(model: ResidualModel, sd: float) -> ResidualModel:
    """Residuals of which some positions are off by a normal number (m) of some standard deviation."""
    generator = np.random.default_rng(0)
    videos = []
    for video in model.videos:
        raw = video.raw.copy()
        wrong = generator.random(len(raw)) < 0.03
        raw[wrong] += generator.normal(0, sd, (int(wrong.sum()), 2))
        videos.append(replace(video, raw=raw))
    return replace(model, videos=tuple(videos))


def test_positions_that_are_grossly_wrong_are_counted() -> None:
    _, model = null()
    found = checked(grossly_wrong(model, 0.3))[OUTLIERS]
    assert found.p_value < 1e-6
    assert 0.01 < found.statistic < 0.05


def test_a_clock_that_is_fast_throughout_and_the_scale_of_all_masses_leave_nothing() -> None:
    _, model = null()
    rates = [video.motion.times[:, None, None] * video.motion.velocity for video in model.videos]
    rows = [video.rows(change[..., None]) for video, change in zip(model.videos, rates, strict=True)]
    told, whole = model.score(rows).information.item(), sum(float((one**2).sum()) for one in rows)
    assert told < 1e-5 * whole
    for video in model.videos:
        entries = [video.likelihood.coordinates.entries[place] for place in video.own_places]
        masses = [k for k, entry in enumerate(entries) if entry.field == "mass"]
        columns = video.linear.own[: video.linear.data, masses]
        assert np.linalg.norm(columns.sum(axis=1)) < 1e-3 * np.linalg.norm(columns)
