"""The same motion on another scale, as of marbles on a desk or of curling stones."""

from dataclasses import replace

from vrdp_prob.scene import Tracks, Wall


def scaled(tracks: Tracks, *, length: float, time: float) -> Tracks:
    """Tracks whose lengths, the noise with them, and times are multiplied by a factor each.

    With a length of `time` squared gravity is the same, and so are all coefficients of friction.

    Raises
    ------
    ValueError
        If the tracks state a camera, covariances or moments of inertia, which would have to be scaled, too.
    """
    if tracks.camera or "position_covariance" in tracks.data or any(one.inertia for one in tracks.bodies):
        raise ValueError("only tracks without camera, covariances and moments of inertia are put on another scale.")
    data = tracks.data.assign(x=length * tracks.data["x"], y=length * tracks.data["y"])
    return replace(
        tracks,
        bodies=tuple(replace(one, radius=one.radius and length * one.radius) for one in tracks.bodies),
        data=data.assign_coords(time=time * tracks.data["time"]),
        walls=tuple(_scaled(wall, length) for wall in tracks.walls),
    )


def _scaled(wall: Wall, length: float) -> Wall:
    return replace(wall, x1=length * wall.x1, y1=length * wall.y1, x2=length * wall.x2, y2=length * wall.y2)
