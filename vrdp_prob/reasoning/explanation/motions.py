"""What the tracks leave open of how objects move and turn when a simulated world begins."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.explanation.parameters import relevant_bodies
from vrdp_prob.reasoning.explanation.quantities import Kind, Measurement, Quantity
from vrdp_prob.reasoning.run import World
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.scene import Shape

SPEED_ACCURACY, DIRECTION_ACCURACY, YAW_ACCURACY, SPIN_ACCURACY = 0.01, 0.5, 3.0, 0.1
"""Errors of a measured speed (relative), direction (degrees), angle (degrees) and spin (rad/s)."""

SLOWEST = 0.05
"""Speed in m/s below which an object has no direction worth a name."""

FILMED_FRAMES = 20
"""How many more frames a film would show."""


def motion_quantities(worlds: PosteriorWorlds, world: World, name: Mapping[str, str]) -> list[Quantity]:
    """Speed and direction of the objects that collide in a world, and how cubes lie when they first do.

    Parameters
    ----------
    worlds
        The draws.
    world
        Which world.
    name
        Name of each object by id.
    """
    begin = _begin(worlds, world)
    if begin is None:
        return []
    when, velocity = begin
    found = []
    for body in relevant_bodies(worlds, world):
        called = name[worlds.bodies[body].id]
        if not isinstance(world, str) and world == (Change.REMOVED, body):
            continue
        speed = np.linalg.norm(velocity[:, body], axis=1)
        if speed.min() > SLOWEST:
            found += _course(called, when, speed, velocity[:, body])
        if worlds.bodies[body].shape is Shape.CUBE:
            found += _turning(worlds, world, body, called)
    return found


def filmed(worlds: PosteriorWorlds, generator: np.random.Generator) -> Float[np.ndarray, "draw feature"]:
    """Where the objects that collide after the video would be seen some frames after its end, in m, with noise."""
    bodies = relevant_bodies(worlds, "future")
    places = worlds.future.trajectory[:, min(FILMED_FRAMES, len(worlds.future.times)) - 1, bodies, :2]
    noise = np.median(np.concatenate([smoother.track.noise for smoother in worlds.seen.seen.smoothers]))
    flat = places.reshape(len(places), -1)
    return np.asarray(flat + noise * generator.standard_normal(flat.shape))


def _begin(worlds: PosteriorWorlds, world: World) -> tuple[str, Float[np.ndarray, "draw body 2"]] | None:
    """When the simulation of a world begins, in words, and the velocities (m/s) then; None where it never does."""
    if isinstance(world, str):
        return "at the end of the video", np.concatenate([batch.end[0].velocity for batch in worlds.batches])
    contacts = worlds.seen.sight.seen.contacts
    times = [contact.time for contact in contacts if world[1] in (contact.first, contact.second)]
    if not times:
        return None
    tracks = [smoother.track for smoother in worlds.seen.seen.smoothers]
    at = [np.clip([times[0]], track.times[0], track.times[-1]) for track in tracks]
    parts = [
        np.stack([drawn.state(time, before=True)[1][:, 0] for drawn, time in zip(batch.seen.drawn, at, strict=True)], 1)
        for batch in worlds.batches
    ]
    return f"at {times[0]:.2f} s", np.concatenate(parts)


def _course(
    called: str, when: str, speed: Float[np.ndarray, "draw"], velocity: Float[np.ndarray, "draw 2"]
) -> list[Quantity]:
    mean = np.arctan2(*velocity.mean(axis=0)[::-1])
    turned = np.angle(np.exp(1j * (np.arctan2(velocity[:, 1], velocity[:, 0]) - mean)))
    accuracy = f"{100 * SPEED_ACCURACY:.0f} %"
    return [
        Quantity(
            Kind.MOTION,
            f"speed of the {called} {when}",
            speed,
            "m/s",
            relative=True,
            measurement=Measurement(f"measuring the speed of the {called} {when} to {accuracy}", SPEED_ACCURACY),
        ),
        Quantity(
            Kind.MOTION,
            f"direction of the {called} {when}",
            np.rad2deg(mean + turned),
            "°",
            measurement=Measurement(
                f"measuring the direction of the {called} {when} to {DIRECTION_ACCURACY:g}°", DIRECTION_ACCURACY
            ),
        ),
    ]


def _turning(worlds: PosteriorWorlds, world: World, body: int, called: str) -> list[Quantity]:
    """Angle and spin of a cube when it first meets another object in a world."""
    draws, universe = worlds.world(world), worlds.seen.universe
    own = np.flatnonzero(universe.takes_part[:, body] & universe.mask(universe.collisions))
    time = np.where(draws.events.happens[:, own], draws.events.time[:, own], np.inf).min(axis=1)
    if not np.isfinite(time).any():
        return []
    time = np.where(np.isfinite(time), time, np.median(time[np.isfinite(time)]))
    frame = np.clip(np.searchsorted(draws.times, time) - 1, 1, len(draws.times) - 1)
    rows, angle = np.arange(len(time)), draws.trajectory[:, :, body, 2]
    spin = (angle[rows, frame] - angle[rows, frame - 1]) / np.diff(draws.times)[frame - 1]
    # a square turned by a quarter is the same square
    quarter = np.angle(np.exp(4j * angle[rows, frame]))
    mean = np.angle(np.exp(1j * quarter).mean())
    yaw = np.rad2deg(mean + np.angle(np.exp(1j * (quarter - mean)))) / 4
    when = "when it is first hit"
    return [
        Quantity(
            Kind.MOTION,
            f"angle of the {called} {when}",
            yaw,
            "°",
            measurement=Measurement(f"measuring the angle of the {called} {when} to {YAW_ACCURACY:g}°", YAW_ACCURACY),
        ),
        Quantity(
            Kind.MOTION,
            f"spin of the {called} {when}",
            spin,
            "rad/s",
            measurement=Measurement(
                f"measuring the spin of the {called} {when} to {SPIN_ACCURACY:g} rad/s", SPIN_ACCURACY
            ),
        ),
    ]
