"""Checks fire on what they are for: the generator's change of the measured places, on top of what a null leaves."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from jaxtyping import Float

from tests.discovery.data_set import draw
from tests.discovery.fitted import SMALL, fitted, moved
from tests.discovery.measurement import Measurement
from tests.discovery.test_checks import by_name
from tests.discovery.videos import Video, move, recorded
from vrdp_prob.discovery.checks.clock import LOST_FRAMES, SINGLE_FRAMES
from vrdp_prob.discovery.checks.contacts import DISTANCE, MOMENTUM, RUBBING, contact_checks
from vrdp_prob.discovery.checks.flight import free_flight_checks
from vrdp_prob.discovery.checks.kicks import KICK
from vrdp_prob.discovery.checks.measurement import DISTORTION, OUTLIERS, measurement_checks
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.models.physics import PhysicsModel
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


@cache
def weighed() -> ResidualModel:
    """A null of bodies whose masses are stated, whose angles are measured, and which share one friction."""
    data = draw(
        [], seed=1, setting=replace(SMALL, friction_spread=0.0), measurement=Measurement(masses=True, angles=True)
    )
    return ResidualModel.of(fit_together(data.tracks, model=PhysicsModel.base(), model_error=False))


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
    assert {DISTANCE, KICK, LOST_FRAMES, SINGLE_FRAMES, DISTORTION, OUTLIERS} <= set(found)
    assert min(check.p_value for check in found.values()) > CHANCE


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        (DISTANCE, larger, "farther apart than the sum of their radii"),
        (KICK, kicked, "Without a partner in reach"),
        (LOST_FRAMES, lost, "jump ahead along their paths together"),
        (SINGLE_FRAMES, irregular, "too early or too late for all bodies"),
        (DISTORTION, bent, "away from the middle of the picture"),
    ],
)
def test_a_check_fires_on_what_it_is_for(name: str, change: Changes, says: str) -> None:
    videos, model = null()
    found = checked(moved(model, [change(video) for video in videos]))
    assert found[name].p_value < CHANCE
    assert says in found[name].sentence
    assert found[name].p_value == min(
        found[one].p_value for one in (DISTANCE, KICK, LOST_FRAMES, SINGLE_FRAMES, DISTORTION)
    )


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


def speed(motion: FittedMotion) -> Float[np.ndarray, "time body 1"]:
    return np.linalg.norm(motion.velocity, axis=-1, keepdims=True)


def forward(motion: FittedMotion) -> Float[np.ndarray, "time body 2"]:
    return np.asarray(motion.velocity / np.maximum(speed(motion), 1e-6))


def left(motion: FittedMotion) -> Float[np.ndarray, "time body 2"]:
    return np.stack([-forward(motion)[..., 1], forward(motion)[..., 0]], axis=-1)


def way(motion: FittedMotion) -> Float[np.ndarray, "time body 1"]:
    return np.cumsum(speed(motion) * np.diff(motion.times, prepend=motion.times[0])[:, None, None], axis=0)


def those(motion: FittedMotion, belongs: Callable[[Body], bool]) -> Float[np.ndarray, "body 1"]:
    return np.array([float(belongs(body)) for body in motion.tracks.bodies])[:, None]


def towards_others(motion: FittedMotion) -> Float[np.ndarray, "time body 2"]:
    apart = motion.position[:, None] - motion.position[:, :, None]
    return np.asarray((apart / (np.linalg.norm(apart, axis=-1, keepdims=True) ** 3 + 1e-3)).sum(axis=2))


def sway(motion: FittedMotion) -> Float[np.ndarray, "time body 2"]:
    return np.sin(9.0 * motion.times)[:, None, None] * np.ones_like(motion.velocity) * (1.0, 0.0)


Field = Callable[[FittedMotion], Float[np.ndarray, "time body 2"]]
FIELDS: dict[str, tuple[Field, str]] = {
    "push in one direction": (
        lambda one: np.ones_like(one.velocity) * (1.0, 0.0),
        r"by 0\.(099|10) .* towards \+x",
    ),
    "push against place": (lambda one: one.position - one.position.mean(axis=(0, 1)), r"0\.1\d m/s\^2 per m away"),
    "push against speed": (
        lambda one: speed(one) * (1.0, 0.0),
        r"towards \+x, the more .* 0\.(099|10) m/s\^2 per",
    ),
    "push against time": (sway, r"to and fro 1\.4 times a second"),
    "acceleration along the velocity against speed": (
        lambda one: -np.exp(-speed(one) / 0.15) * forward(one),
        "in a way that changes with speed",
    ),
    "acceleration along the velocity against the direction of motion": (
        lambda one: (forward(one)[..., :1] ** 2 - forward(one)[..., 1:] ** 2) * forward(one),
        "depends on the direction of motion",
    ),
    "acceleration along the velocity against place": (
        lambda one: one.position[..., :1] * forward(one),
        "in a way that changes with the place",
    ),
    "acceleration along the velocity against time": (
        lambda one: -one.times[:, None, None] * forward(one),
        r"by -0\.(099|10)\d* m/s\^2 per s",
    ),
    "acceleration along the velocity against the way travelled": (
        lambda one: -way(one) * forward(one),
        r"by -0\.(099|10)\d* m/s\^2 per m",
    ),
    "acceleration across the velocity against speed": (left, r"\+0\.10 m/s\^2 to the left"),
    "acceleration across the velocity against place": (
        lambda one: one.position[..., :1] * speed(one) * left(one),
        "pushed sideways .* changes with the place",
    ),
    "acceleration across the velocity against time": (
        lambda one: one.times[:, None, None] * speed(one) * left(one),
        "changes in the course of the video",
    ),
    "acceleration along the velocity against the distance to other bodies": (
        lambda one: -np.linalg.norm(towards_others(one), axis=-1)[..., None] * forward(one),
        "Near others bodies are slowed along their velocity",
    ),
    "acceleration across the velocity against the distance to other bodies": (
        lambda one: np.linalg.norm(towards_others(one), axis=-1)[..., None] * left(one),
        "pushed to the left of their velocity",
    ),
    "acceleration against the distance to other bodies": (towards_others, "attract each other"),
}
FIELDS_OF_BODIES: dict[str, tuple[Field, str]] = {
    "acceleration along the velocity against spin": (
        lambda one: -np.abs(one.spin)[..., None] * forward(one),
        r"the more they spin, by -0\.(08|09|1)\d* m/s\^2 per rad/s",
    ),
    "acceleration along the velocity against shape": (
        lambda one: -those(one, lambda body: body.shape is Shape.CUBE) * forward(one),
        "Cubes are slowed more than cylinders",
    ),
    "acceleration along the velocity against material": (
        lambda one: -those(one, lambda body: body.material == "metal") * forward(one),
        "Bodies of one material are slowed more than others",
    ),
    "acceleration along the velocity against mass": (
        lambda one: -one.mass[:, None] * forward(one),
        "Heavy bodies are slowed more than light ones",
    ),
    "acceleration across the velocity against spin": (
        lambda one: one.spin[..., None] * speed(one) * left(one),
        r"counter-clockwise are pushed to the left, by 0\.(08|09|1)\d* m/s\^2 per",
    ),
    "acceleration across the velocity against mass": (
        lambda one: one.mass[:, None] * speed(one) * left(one),
        "Heavy bodies are pushed more to the left than light ones",
    ),
}
"""Of what bodies are and how they spin, which tracks have to tell, and a shared friction leaves open."""
STRENGTH = 0.1
"""Acceleration in m/s^2 of the fields, in units of m, m/s and s."""


@pytest.mark.parametrize("name", [*FIELDS, *FIELDS_OF_BODIES])
def test_a_check_of_free_flight_fires_on_its_field_and_says_how_large_it_is(name: str) -> None:
    model = weighed() if name in FIELDS_OF_BODIES else null()[1]
    field, says = {**FIELDS, **FIELDS_OF_BODIES}[name]
    changes = [video.motion.pushed(STRENGTH * field(video.motion)[..., None])[:, :, :2, 0] for video in model.videos]
    before, after = (by_name(free_flight_checks(FreeFlight.of(one)))[name] for one in (model, moved(model, changes)))
    assert before.p_value > CHANCE
    assert after.p_value < CHANCE
    assert re.search(says, after.sentence), after.sentence


def test_what_brakes_a_body_by_a_constant_is_its_own_friction_however_little_the_table_brakes() -> None:
    model = ResidualModel.of(fitted(seed=1, setting=replace(SMALL, resistance=0.05))[1])
    generator = np.random.default_rng(0)
    changes = []
    for video in model.videos:
        motion = video.motion
        brakes = generator.normal(0.0, 0.1, len(motion.mass))
        changes.append(motion.pushed((brakes[:, None] * motion.direction)[..., None])[:, :, :2, 0])
    before, after = (by_name(free_flight_checks(FreeFlight.of(one))) for one in (model, moved(model, changes)))
    assert min(check.p_value for check in before.values()) > CHANCE
    for name, check in before.items():
        assert after[name].statistic == pytest.approx(check.statistic, rel=1e-3), name


def struck_aside(model: ResidualModel, back: float) -> list[Float[np.ndarray, "time body 2"]]:
    """Contacts at which one body is struck along the side that it touches with, and the other back by a share of it."""
    changes = []
    for video in model.videos:
        motion, events = video.motion, video.motion.events
        acceleration = np.zeros_like(motion.velocity)
        bodies = acceleration.shape[1]
        for time, first, second in zip(events.time, events.first, events.second, strict=True):
            frame = int(np.searchsorted(motion.times, time))
            if not (0 <= first < bodies and 0 <= second < bodies and frame + 2 < len(motion.times)):
                continue
            apart = motion.position[frame, second] - motion.position[frame, first]
            side = np.array([-apart[1], apart[0]]) / np.linalg.norm(apart)
            impulse = 0.1 * side / (motion.times[frame + 1] - motion.times[frame])
            acceleration[frame, first] += impulse / motion.mass[first]
            acceleration[frame, second] -= back * impulse / motion.mass[second]
        changes.append(motion.pushed(acceleration[..., None])[:, :, :2, 0])
    return changes


@pytest.mark.parametrize(
    ("name", "back", "says"),
    [(RUBBING, 1.0, "At contacts tangential impulses act"), (MOMENTUM, 0.0, "Momentum is not kept at contacts")],
)
def test_a_check_of_contacts_fires_on_its_impulses(name: str, back: float, says: str) -> None:
    _, model = null()
    found = checked(moved(model, struck_aside(model, back)))[name]
    assert found.p_value < CHANCE
    assert says in found.sentence


def test_noise_that_remembers_is_told_by_its_memory_and_its_size() -> None:
    _, model = null()
    generator = np.random.default_rng(0)
    changes = []
    for video in model.videos:
        noise = generator.normal(0, 0.002, video.motion.position.shape)
        for frame in range(1, len(noise)):
            noise[frame] = 0.7 * noise[frame - 1] + np.sqrt(1 - 0.7**2) * noise[frame]
        changes.append(noise)
    found = checked(moved(model, changes))
    assert found["memory of the residuals"].p_value < CHANCE
    assert "the noise has a memory" in found["memory of the residuals"].sentence
    assert found["size of the residuals"].p_value < CHANCE
    assert "times as large as the roughness" in found["size of the residuals"].sentence


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
