"""Worlds that go on from the end of a video: simulated to there, then set right by the last frames.

An imperfect model leaves small errors of place and speed at the end, which grow in a prediction. What a body did in its
last frames after its last contact says where it really is. Source: Ding et al., NeurIPS 2021 (VRDP), section 3.4 (they
optimise the last 20 frames anew).
"""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Bool, Float

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.models.simulator.rollout import Rollout, simulate
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Tracks

LAST_FRAMES = 20
"""Frames that set the end of the video right."""
FEWEST_FRAMES = 4
SPEED_SHARE = 0.15
"""Prior standard deviation of the error of a speed, as a share of it..."""
SPEED_ERROR = 0.02
"""...plus so many m/s."""
PLACE_ERROR = 3.0
"""Prior standard deviation of the error of a place, in units of the noise."""


def continued(
    tracks: Tracks, model: PhysicsModel, worlds: Worlds, noise: float, generator: np.random.Generator | None
) -> Worlds:
    """The worlds released anew at the last frame of the video.

    Parameters
    ----------
    tracks
        What was seen.
    model
        The physics.
    worlds
        Worlds released at the start of the video.
    noise
        Standard deviation in m of the residuals.
    generator
        Draws the error that remains; where None, worlds go on from the most probable states.

    Returns
    -------
    Worlds whose existing bodies have the time of the last frame as release time. A body that was not seen in the last
    frames, or not since its last contact, is left where the simulation has it.
    """
    times = torch.tensor(tracks.times)
    with torch.no_grad():
        rollout = simulate(worlds, times, model)
    state, velocity = rollout.trajectory[:, -1].clone(), rollout.velocity[:, -1].clone()
    place_error, speed_error = _corrections(tracks, rollout, noise, generator)
    speed = velocity[..., :2].norm(dim=-1, keepdim=True)
    moving = speed > 0
    position = state[..., :2] + torch.from_numpy(place_error)
    free = ~_touching(worlds, position)[..., None]
    position = torch.where(free, position, state[..., :2])
    corrected = velocity[..., :2] + torch.where(moving & free, torch.from_numpy(speed_error), torch.zeros(()))
    exists = rollout.exists[:, -1]
    return replace(
        worlds,
        position=torch.where(exists[..., None], position, worlds.position),
        velocity=torch.where(exists[..., None], corrected, worlds.velocity),
        angle=torch.where(exists, state[..., 2], worlds.angle),
        spin=torch.where(exists, velocity[..., 2], worlds.spin),
        release_time=torch.where(exists, times[-1], worlds.release_time),
    )


def _corrections(
    tracks: Tracks, rollout: Rollout, noise: float, generator: np.random.Generator | None
) -> tuple[Float[np.ndarray, "world body 2"], Float[np.ndarray, "world body 2"]]:
    """Draws of the errors of place (m) and velocity (m/s) at the last frame, by Bayesian straight lines."""
    times = tracks.times[-LAST_FRAMES:]
    offset = times - times[-1]
    residuals = tracks.positions[-LAST_FRAMES:] - rollout.trajectory[:, -LAST_FRAMES:, :, :2].numpy()
    usable = np.isfinite(residuals).all(axis=-1) & (times[:, None] > _last_contact(rollout)[:, None, :])
    weight = usable / noise**2
    filled = np.where(usable[..., None], residuals, 0.0)
    speed = rollout.velocity[:, -1, :, :2].norm(dim=-1).numpy()
    place_precision = weight.sum(axis=1) + (PLACE_ERROR * noise) ** -2
    speed_precision = (weight * offset[:, None] ** 2).sum(axis=1) + (SPEED_SHARE * speed + SPEED_ERROR) ** -2
    cross = (weight * offset[:, None]).sum(axis=1)
    determinant = place_precision * speed_precision - cross**2
    right_place = (weight[..., None] * filled).sum(axis=1)
    right_speed = ((weight * offset[:, None])[..., None] * filled).sum(axis=1)
    place = (speed_precision[..., None] * right_place - cross[..., None] * right_speed) / determinant[..., None]
    change = (place_precision[..., None] * right_speed - cross[..., None] * right_place) / determinant[..., None]
    enough = (usable.sum(axis=1) >= FEWEST_FRAMES)[..., None]
    place_sd = np.sqrt(speed_precision / determinant)[..., None]
    slope = -(cross / speed_precision)[..., None]
    normal = np.zeros((2, *place.shape)) if generator is None else generator.standard_normal((2, *place.shape))
    place_noise = place_sd * normal[0]
    change_noise = slope * place_noise + np.sqrt(1 / speed_precision)[..., None] * normal[1]
    return np.where(enough, place + place_noise, 0.0), np.where(enough, change + change_noise, 0.0)


def _last_contact(rollout: Rollout) -> Float[np.ndarray, "world body"]:
    """Time (s) of the last contact of each body; minus infinity without one."""
    last = np.full(rollout.trajectory.shape[:1] + rollout.trajectory.shape[2:3], -np.inf)
    events = rollout.events
    collision, wall = events.kind == RolloutEventKind.COLLISION, events.kind == RolloutEventKind.WALL
    for chosen, bodies in ((collision | wall, events.first), (collision, events.second)):
        np.maximum.at(last, (events.world[chosen], bodies[chosen]), events.time[chosen])
    return last


def _touching(worlds: Worlds, position: Float[torch.Tensor, "world body 2"]) -> Bool[torch.Tensor, "world body"]:
    """Whether a body would be so near to another that a correction might press one into the other."""
    distance = torch.cdist(position, position)
    reach = worlds.radius[:, :, None] + worlds.radius[:, None, :]
    near = (distance < 1.05 * reach) & worlds.present[:, None, :] & worlds.present[:, :, None]
    near.diagonal(dim1=1, dim2=2).fill_(False)
    return near.any(dim=2)
