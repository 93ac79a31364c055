"""Where hidden things are put, so that some body meets them: read off the motion without them."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from tests.discovery.videos import Disc, Video
from vrdp_prob.scene import Wall

RESTITUTION = 0.8
"""Restitution factor of hidden walls and discs."""
ROOM = 0.05
"""Distance in m that hidden things keep from where bodies are released."""
LONG = 20.0
"""Half length of a hidden wall in m."""
LARGEST_DISC = 0.3
"""Radius in m of the largest disc that is put where bodies meet it often."""
TRIED = 200
"""Places and directions that are tried for what bodies shall meet often."""


def moving_moment(videos: tuple[Video, ...], generator: np.random.Generator) -> tuple[int, int, float]:
    """A video, a body of it and a time in s when it moves and goes on for a while."""
    while True:
        number = int(generator.integers(len(videos)))
        video = videos[number]
        body, share = int(generator.integers(len(video.shapes))), generator.uniform(0.15, 0.6)
        frame = int(share * video.frames)
        speed = np.linalg.norm(video.motion.states[frame : frame + video.frames // 5, body, 2:4], axis=-1)
        if speed.min() > 0.2 and video.times[frame] > video.release[body] and video.in_view[frame, body]:
            return number, body, float(video.times[frame])


def on_a_way(videos: tuple[Video, ...], generator: np.random.Generator) -> tuple[float, float]:
    """A place in m that a body passes."""
    number, body, time = moving_moment(videos, generator)
    x, y = videos[number].motion.states[np.searchsorted(videos[number].times, time), body, :2]
    return float(x), float(y)


def in_the_way(videos: tuple[Video, ...], depth: float, generator: np.random.Generator) -> Disc:
    """A disc that reaches `depth` m into where a body would end, straight ahead of it.

    No body of any video is released on it, and of the places that are tried it is the one that other bodies pass least.

    Raises
    ------
    ValueError
        If no such place is found.
    """
    best, fewest = None, np.inf
    for _ in range(100):
        video = videos[generator.integers(len(videos))]
        body, radius = generator.integers(len(video.shapes)), generator.uniform(0.1, 0.25)
        states = video.motion.states[:, body]
        speed = np.linalg.norm(states[:, 2:4], axis=1)
        if speed.max() < 0.4 or states[-1, 8] < 0.5 or not video.in_view[-1, body]:
            continue
        last = np.flatnonzero(speed > 0.05)[-1]
        ahead = states[last, 2:4] / speed[last]
        touching = states[-1, :2] + (video.radius[body] + radius) * ahead
        deepest = min(0.5, states[-1, 8] / 2)
        ends = [_disc(touching - reach * ahead, radius) for reach in (0.0, deepest)]
        passing = sum(_passing(other, ends[0]) for other in videos)
        if passing < fewest and all(_clear(other, disc) for other in videos for disc in ends):
            best, fewest = _disc(touching - min(depth, deepest) * ahead, radius), passing
        if fewest == 0:
            break
    if best is None:
        raise ValueError("no place for a hidden disc was found; draw other videos.")
    return best


def cutting_off(videos: tuple[Video, ...], depth: float, generator: np.random.Generator) -> tuple[Wall, ...]:
    """One wall or two square to each other; each cuts `depth` m off what bodies reach, where there is room for it."""
    count = int(generator.integers(1, 3))
    best, most_room = 0.0, -np.inf
    for angle in generator.uniform(0, 2 * np.pi, 24):
        room = min(_room(videos, angle + k * np.pi / 2)[2] for k in range(count))
        if room > most_room:
            best, most_room = float(angle), room
    walls = []
    for k in range(count):
        angle = best + k * np.pi / 2
        reach, room, _ = _room(videos, angle)
        walls.append(_wall(angle, reach - min(depth, room)))
    return tuple(walls)


def in_many_ways(videos: tuple[Video, ...], radius: float, generator: np.random.Generator) -> Disc:
    """A disc at the place, of those that are tried, that most bodies pass within the largest one's reach.

    Raises
    ------
    ValueError
        If no such place is found.
    """
    tried = [np.array(on_a_way(videos, generator)) for _ in range(TRIED)]
    largest = [_disc(middle, LARGEST_DISC) for middle in tried]
    free = [disc for disc in largest if all(_clear(video, disc) for video in videos)]
    if not free:
        raise ValueError("no place for a hidden disc was found; draw other videos.")
    return replace(max(free, key=lambda disc: sum(_meeting(video, disc) for video in videos)), radius=radius)


def cutting_many(videos: tuple[Video, ...], depth: float, generator: np.random.Generator) -> tuple[Wall, ...]:
    """One wall that cuts `depth` m off what bodies reach, of the directions that are tried in that of most of them."""

    def cut(angle: float) -> tuple[float, int]:
        """Distance of the wall in a direction, and how many bodies would be seen beyond it."""
        reach, room, _ = _room(videos, angle)
        distance, ahead = reach - min(depth, room), np.array([np.cos(angle), np.sin(angle)])
        beyond = [video.in_view & (video.motion.states[..., :2] @ ahead + video.radius > distance) for video in videos]
        return distance, sum(int(one.any(axis=0).sum()) for one in beyond)

    angles = generator.uniform(0, 2 * np.pi, TRIED).tolist()
    best = max(angles, key=lambda angle: cut(angle)[1])
    return (_wall(best, cut(best)[0]),)


def _room(videos: tuple[Video, ...], angle: float) -> tuple[float, float, float]:
    """How far bodies reach in a direction, how much of it no body needs at its release, and that less what is unseen.

    A wall where a body has left the picture would bring it back, which is no small effect however shallow it cuts.
    """
    ahead = np.array([np.cos(angle), np.sin(angle)])
    reaches = [video.motion.states[..., :2] @ ahead + video.radius for video in videos]
    reach = max(float(found.max()) for found in reaches)
    seen = max(float(found[video.in_view].max()) for found, video in zip(reaches, videos, strict=True))
    start = max(float((video.position @ ahead + np.sqrt(2.0) * video.radius).max()) for video in videos)
    return reach, reach - start - ROOM, seen - start - ROOM - 10 * (reach - seen)


def _wall(angle: float, distance: float) -> Wall:
    x, y = np.cos(angle), np.sin(angle)
    ends = [(distance * x - side * y, distance * y + side * x) for side in (-LONG, LONG)]
    return Wall(*ends[0], *ends[1], restitution=RESTITUTION)


def _disc(middle: np.ndarray, radius: float) -> Disc:
    return Disc(float(middle[0]), float(middle[1]), radius, RESTITUTION)


def _clear(video: Video, disc: Disc) -> bool:
    return bool((_apart(video.position, disc) > disc.radius + 1.5 * video.radius + ROOM).all())


def _passing(video: Video, disc: Disc) -> int:
    """How often a body is seen where the disc would be."""
    return int((_apart(video.motion.states[..., :2], disc) < disc.radius + video.radius - 1e-6).sum())


def _meeting(video: Video, disc: Disc) -> int:
    """How many bodies are seen where the disc would be."""
    near = _apart(video.motion.states[..., :2], disc) < disc.radius + video.radius
    return int((video.in_view & near).any(axis=0).sum())


def _apart(positions: Float[np.ndarray, "*batch 2"], disc: Disc) -> Float[np.ndarray, "*batch"]:
    """Distances in m of places from the middle of a disc."""
    distances: np.ndarray = np.linalg.norm(positions - (disc.x, disc.y), axis=-1)
    return distances
