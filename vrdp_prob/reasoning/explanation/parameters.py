"""What the posterior's draws leave open of masses, restitutions and friction."""

from collections.abc import Mapping

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.identifiability.status import Status
from vrdp_prob.reasoning.explanation.quantities import RARE, Kind, Measurement, Quantity
from vrdp_prob.reasoning.run import World
from vrdp_prob.reasoning.worlds import PosteriorWorlds

ACCURACY = 0.05
"""Relative error of a measured mass, restitution or friction."""

SHARED_FRICTION = "sliding_friction"


def parameter_quantities(worlds: PosteriorWorlds, world: World, name: Mapping[str, str]) -> list[Quantity]:
    """Masses, restitutions and friction of the objects that collide in a world.

    A mass that only its ratios to others determine is told as such a ratio: its scale moves nothing.

    Parameters
    ----------
    worlds
        The draws.
    world
        Which world.
    name
        Name of each object by id.
    """
    called = [name[body.id] for body in worlds.bodies]
    alone = [worlds.posterior.status[body.id].mass.status is not Status.RATIO_ONLY for body in worlds.bodies]
    mass, restitution = (_drawn(worlds, field) for field in ("mass", "restitution"))
    pairs = meeting_pairs(worlds, world)
    weighable = sorted({body for pair in pairs for body in pair if alone[body]})
    found = [
        _quantity(f"mass of the {called[body]}", mass[:, body], f"weighing the {called[body]}", unit="kg")
        for body in weighable
    ]
    for first, second in pairs:
        pair = f"the {called[first]} and the {called[second]}"
        weighed = alone[first] and alone[second]
        how = f"weighing {pair}, each" if weighed else f"measuring the ratio of the masses of {pair}"
        ratio = f"mass of the {called[first]} relative to the {called[second]}"
        values = mass[:, first] / mass[:, second]
        found.append(_quantity(ratio, values, how, measured=2 if weighed else 1))
        bounce, how = f"restitution between {pair}", f"measuring the restitution between {pair}"
        found.append(_quantity(bounce, restitution[:, first] * restitution[:, second], how))
    friction = _friction(worlds, world)
    if friction is not None:
        for body in relevant_bodies(worlds, world):
            slowing = f"friction of the {called[body]}"
            found.append(_quantity(slowing, friction[:, body], f"measuring the {slowing}"))
    return found


def relevant_bodies(worlds: PosteriorWorlds, world: World) -> list[int]:
    """Places of the objects that a simulated contact reaches in some draws."""
    return np.flatnonzero(worlds.world(world).collided.mean(axis=0) > RARE).tolist()


def meeting_pairs(worlds: PosteriorWorlds, world: World) -> list[tuple[int, int]]:
    """Pairs of such objects that meet, in the world or before in the video, in some draws."""
    universe = worlds.seen.universe
    there = worlds.world(world).events.happens | worlds.events().happens
    share, bodies = there[:, universe.collisions].mean(axis=0), set(relevant_bodies(worlds, world))
    return [pair for pair, part in zip(universe.pairs, share, strict=True) if part > RARE and bodies.issuperset(pair)]


def _drawn(worlds: PosteriorWorlds, field: str) -> Float[np.ndarray, "draw body"]:
    return torch.cat([getattr(batch.drawn, field) for batch in worlds.batches]).numpy()


def _quantity(name: str, values: Float[np.ndarray, "draw"], how: str, *, unit: str = "", measured: int = 1) -> Quantity:
    """A positive quantity; `measured` is the number of measurements that it takes, each of the same accuracy."""
    measurement = Measurement(f"{how} to {100 * ACCURACY:.0f} %", ACCURACY * np.sqrt(measured))
    return Quantity(Kind.PARAMETER, name, values, unit, relative=True, measurement=measurement)


def _friction(worlds: PosteriorWorlds, world: World) -> Float[np.ndarray, "draw body"] | None:
    """Friction coefficient of each body as the world is simulated with; None for a model without dry friction."""
    parts = []
    for batch in worlds.batches:
        if batch.friction is None or SHARED_FRICTION not in batch.drawn.parameters:
            return None
        log_ratio = batch.end[1] if isinstance(world, str) else batch.friction.log_ratio
        parts.append(batch.drawn.parameters[SHARED_FRICTION].numpy()[:, None] * np.exp(log_ratio))
    return np.concatenate(parts)
