"""The player's data: rollouts small enough to travel inside the page.

Positions become 16-bit steps of a common length, angles 16-bit parts of a turn. Second differences in time of smooth
motion are nearly zero, so they deflate well; all arithmetic is modulo 2^16, which loses nothing. The browser undoes
it with its own inflate (`assets/worlds.js`).
"""

import base64
import math
import zlib
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from vrdp_prob.plain_words import percent, percent_error
from vrdp_prob.report.content import ReportContent, WorldContent
from vrdp_prob.report.footage import film_data
from vrdp_prob.report.wording import color_of, tags, world_group, world_label
from vrdp_prob.scene import Camera
from vrdp_prob.scene.naming import names

_STEPS = 16000
"""Steps of length on each side of the origin."""

_TURN = 65536
"""Parts of a full turn."""


def player_data(content: ReportContent) -> dict[str, Any]:
    """What the page's player reads, as strict JSON values (lengths in m, times in s)."""
    tracks = content.tracks
    name, tag = names(tracks.bodies), tags(tracks.bodies)
    reach = _reach(content)
    camera = tracks.camera
    return {
        "bodies": [
            {
                "id": body.id,
                "tag": tag[body.id],
                "name": name[body.id],
                "shape": str(body.shape),
                "color": color_of(body, index),
                "radius": body.radius if body.radius is not None else 0.02 * reach,
            }
            for index, body in enumerate(tracks.bodies)
        ],
        "camera": None
        if camera is None
        else {"projection": camera.projection.tolist(), "width": camera.width, "height": camera.height},
        "frameRate": round(tracks.frame_rate, 6),
        "seenUntil": round(float(tracks.times[-1]), 6),
        "tracks": {"times": _rounded(tracks.times), "positions": _measured(tracks.positions, _digits(reach))},
        "walls": [[[wall.x1, wall.y1], [wall.x2, wall.y2]] for wall in tracks.walls],
        "view": _view(content, _digits(reach)),
        "pictureEdge": None if camera is None else _picture_edge(camera),
        "film": None if content.footage is None or camera is None else film_data(content.footage),
        "worlds": [_world(world, content, reach) for world in content.worlds],
    }


def encode(
    trajectory: Float[np.ndarray, "draw time body 3"], step: float
) -> tuple[str, Int[np.ndarray, "body axis draw time"]]:
    """Trajectories as deflated 16-bit second differences in base64, and the 16-bit values that they stand for.

    Parameters
    ----------
    trajectory
        Position (m) and angle (rad).
    step
        Length in m of one step; positions further than 32767 steps from the origin are drawn at that distance.
    """
    position = np.clip(np.rint(trajectory[..., :2] / step), -32767, 32767)
    angle = np.rint(trajectory[..., 2:] / (2 * np.pi) * _TURN) % _TURN
    whole = np.concatenate([position, angle], axis=-1).astype(np.int64).transpose(2, 3, 0, 1)
    differences = np.diff(whole, axis=-1, prepend=0)
    differences[..., 1:] = np.diff(differences, axis=-1)
    packed = zlib.compress(differences.astype("<u2").tobytes(), 9)
    return base64.b64encode(packed).decode("ascii"), whole.astype("<u2").astype(np.int16)


def _world(world: WorldContent, content: ReportContent, reach: float) -> dict[str, Any]:
    step = reach / _STEPS
    data, _ = encode(world.trajectory, step)
    frames = len(world.times)
    there = world.exists.any(axis=1)
    first = np.where(there, world.exists.argmax(axis=1), frames)
    until = np.where(there, frames - world.exists[:, ::-1].argmax(axis=1), frames)
    collisions = world.collisions
    order = np.argsort(collisions.time, kind="stable")
    return {
        "key": world.key,
        "kind": world.kind,
        "label": world_label(world, content.tracks),
        "group": world_group(world.kind),
        "body": world.body,
        "times": _rounded(world.times),
        "draws": world.draws,
        "step": step,
        "data": data,
        "first": first.tolist(),
        "until": until.tolist(),
        "pairs": [
            {
                "bodies": list(pair.bodies),
                "share": f"{percent(pair.share, pair.error)} {percent_error(pair.share, pair.error)}".strip(),
                "time": round(pair.time, 4),
            }
            for pair in world.pairs
        ],
        "collisions": {
            "draw": collisions.draw[order].tolist(),
            "time": _rounded(collisions.time[order]),
            "bodies": np.sort(collisions.bodies[order], axis=1).tolist(),
            "point": np.round(collisions.point[order], _digits(reach)).tolist(),
        },
    }


def _reach(content: ReportContent) -> float:
    """Distance in m from the origin that the player's numbers have to cover (rare runaways may exceed it)."""
    seen = np.nanmax(np.abs(content.tracks.positions))
    rolled = [np.quantile(np.abs(world.trajectory[..., :2]), 0.999) for world in content.worlds]
    return float(max([1.5 * seen, *rolled, 1e-3]))


def _view(content: ReportContent, digits: int) -> list[float]:
    """Rectangle (x1, y1, x2, y2) in m that the bird's-eye view shows: what was seen, and nearly all that was drawn."""
    positions = content.tracks.positions.reshape(-1, 2)
    walls = np.array([(x, y) for wall in content.tracks.walls for x, y in ((wall.x1, wall.y1), (wall.x2, wall.y2))])
    positions = np.concatenate([positions, walls.reshape(-1, 2)])
    low, high = np.nanmin(positions, axis=0), np.nanmax(positions, axis=0)
    room = 0.2 * (high - low) + 2 * max((body.radius or 0.0 for body in content.tracks.bodies), default=0.0)
    for world in content.worlds[:2]:
        drawn = world.trajectory[..., :2][world.exists]
        if len(drawn):
            inner, outer = np.quantile(drawn, [0.005, 0.995], axis=0)
            low, high = np.minimum(low, np.maximum(inner, low - room)), np.maximum(high, np.minimum(outer, high + room))
    return [round(float(value), digits) for value in (*low, *high)]


def _picture_edge(camera: Camera) -> list[list[float]] | None:
    """Corners of the picture on the floor in m, None where one of them looks above the horizon."""
    u, v = float(camera.width), float(camera.height)
    corners = camera.to_plane(np.array([[0.0, 0.0], [u, 0.0], [u, v], [0.0, v]]), 0.0)
    grounded = np.column_stack([corners, np.zeros(4), np.ones(4)])
    if not np.isfinite(corners).all() or (grounded @ camera.projection[2] <= 0).any():
        return None
    return np.round(corners, 3).tolist()


def _digits(reach: float) -> int:
    """Decimals in m that show what a scene of some size holds: a millimetre, less in small scenes."""
    return max(3, 4 - math.ceil(math.log10(reach)))


def _measured(positions: Float[np.ndarray, "time body 2"], digits: int) -> list[list[list[float] | None]]:
    """Per body and frame the measured position in m, None where it was not seen."""
    seen = np.isfinite(positions).all(axis=-1)
    places = np.round(positions, digits)
    return [
        [place if here else None for place, here in zip(path.tolist(), there, strict=True)]
        for path, there in zip(places.transpose(1, 0, 2), seen.T, strict=True)
    ]


def _rounded(times: Float[np.ndarray, "time"]) -> list[float]:
    return [round(float(value), 4) for value in times]
