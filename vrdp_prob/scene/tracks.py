"""Measured positions of the objects of one video."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from vrdp_prob.errors import InputError
from vrdp_prob.scene.body import Body, Shape, Wall
from vrdp_prob.scene.camera import Camera
from vrdp_prob.scene.third_differences import FEWEST, NORMAL_MAD, WINDOW, third_difference

FARTHEST = 1e6
"""Coordinate in m beyond which a position is no position; trackers mark with such numbers what they did not see."""
OVERLAP_TOLERANCE, OVERLAP_NOISE = 0.25, 4.0
"""Share of the contact distance, and number of standard deviations of the noise, by which measured centres may be too
near before the tracks are refused."""
WHOLE, FRAME, FEWEST_STEPS = 0.125, 1.5, 3
"""How near a jump of an angle is to whole turns, and how near two frames in median steps, for it to be one of wrapping;
steps from which that is told."""
LATEST_START = 1e6
"""Time in s of the first frame beyond which times are counted from it: what is left of their digits is too little."""
ORIGIN = "time_origin"
"""Attribute of the data that says when that was."""


@dataclass(frozen=True)
class Tracks:
    """Measured positions of the objects of one video, validated once, here.

    Parameters
    ----------
    video
        Name of the video.
    bodies
        The objects, in the order of the `body` axis.
    data
        Dataset with coordinates `time` (s, increasing) and `body` (ids) and the variables

        - `x`, `y` (time, body): position in m, NaN where the object was not seen;
        - `angle` (time, body), optional: angle in rad, counter-clockwise, unwrapped, its zero arbitrary per object;
        - `position_covariance` (time, body, axis, axis_other), optional: covariance in m^2 of the measured position,
          where whoever measured it knows it.
    walls
        Static walls.
    camera
        The camera, where there is one: events `in` and `out` are crossings of its picture's edge.

    Raises
    ------
    InputError
        If there is no object or no position, times are not finite and strictly increasing, a position is infinite or
        farther off than 1000 km, an object was seen fewer than two times, an angle jumps as wrapped ones do, or two
        bodies, or a body and a wall, overlap where they are first seen together by more than the noise explains.
    """

    video: str
    bodies: tuple[Body, ...]
    data: xr.Dataset
    walls: tuple[Wall, ...] = ()
    camera: Camera | None = None

    def __post_init__(self) -> None:
        self._check_names()
        self._check_values()
        self._check_angles()
        self._check_overlap()

    @classmethod
    def from_arrays(
        cls,
        video: str,
        bodies: tuple[Body, ...],
        times: Float[np.ndarray, "time"],
        positions: Float[np.ndarray, "time body 2"],
        *,
        angles: Float[np.ndarray, "time body"] | None = None,
        position_covariance: Float[np.ndarray, "time body 2 2"] | None = None,
        walls: tuple[Wall, ...] = (),
        camera: Camera | None = None,
    ) -> "Tracks":
        """Tracks from arrays: times in s, positions in m (NaN where not seen), angles in rad, covariance in m^2.

        Times of day (seconds since 1970, say) are counted from the first frame; `data.attrs["time_origin"]` says when
        that was.

        Raises
        ------
        InputError
            If an array has another shape, or what the class refuses.
        """
        times, positions = _numbers(video, "times", times), _numbers(video, "positions", positions)
        frames, count = len(times), len(bodies)
        _check_shape(video, "times", times, (frames,), "(time)")
        _check_shape(video, "positions", positions, (frames, count, 2), "(time, body, 2)")
        if angles is not None:
            angles = _numbers(video, "angles", angles)
            _check_shape(video, "angles", angles, (frames, count), "(time, body)")
        if position_covariance is not None:
            position_covariance = _numbers(video, "position_covariance", position_covariance)
            _check_shape(video, "position_covariance", position_covariance, (frames, count, 2, 2), "(time, body, 2, 2)")
        variables: dict[str, object] = {
            "x": (("time", "body"), positions[..., 0], {"units": "m"}),
            "y": (("time", "body"), positions[..., 1], {"units": "m"}),
        }
        if angles is not None:
            variables["angle"] = (("time", "body"), angles, {"units": "rad"})
        if position_covariance is not None:
            axes = ("time", "body", "axis", "axis_other")
            variables["position_covariance"] = (axes, position_covariance, {"units": "m^2"})
        attributes = {}
        if frames and LATEST_START < abs(times[0]) < np.inf:
            attributes[ORIGIN] = float(times[0])
            times = times - times[0]
        coordinates = {"time": ("time", times, {"units": "s"}), "body": ("body", [body.id for body in bodies])}
        return cls(video, bodies, xr.Dataset(variables, coordinates, attributes), walls, camera)

    def from_first_frame(self) -> "Tracks":
        """The same with times counted from the first frame; `data.attrs["time_origin"]` says when that was."""
        first = float(self.times[0])
        data = self.data.assign_coords(time=("time", self.times - first, self.data["time"].attrs))
        return replace(self, data=data.assign_attrs({ORIGIN: self.data.attrs.get(ORIGIN, 0.0) + first}))

    @property
    def times(self) -> Float[np.ndarray, "time"]:
        """Times in s of the frames."""
        return np.asarray(self.data["time"].values, dtype=float)

    @property
    def positions(self) -> Float[np.ndarray, "time body 2"]:
        """Measured positions in m, NaN where an object was not seen."""
        return np.stack([self.data["x"].values, self.data["y"].values], axis=-1).astype(float)

    @property
    def angles(self) -> Float[np.ndarray, "time body"] | None:
        """Measured angles in rad, NaN where not measured; None where no angle was."""
        return np.asarray(self.data["angle"].values, dtype=float) if "angle" in self.data else None

    @property
    def angles_told(self) -> Bool[np.ndarray, "body"]:
        """Whether an angle of each object was measured."""
        angles = self.angles
        return (
            np.zeros(len(self.bodies), dtype=bool) if angles is None else (np.isfinite(angles) & self.seen).any(axis=0)
        )

    @property
    def turning_told(self) -> bool:
        """Whether angles of all objects whose turning can be seen were measured, and there are angles at all."""
        spheres = np.array([body.shape is Shape.SPHERE for body in self.bodies])
        return bool(self.angles_told.any() and (self.angles_told | spheres).all())

    @property
    def position_covariance(self) -> Float[np.ndarray, "time body 2 2"] | None:
        """Covariance in m^2 of the measured positions; None where it is not known, or says nothing of any position."""
        if "position_covariance" not in self.data:
            return None
        covariance = np.asarray(self.data["position_covariance"].values, dtype=float)
        return covariance if (self.seen & np.isfinite(_mean_variance(covariance))).any() else None

    @property
    def position_variance(self) -> Float[np.ndarray, "time body"] | None:
        """Stated variance in m^2 of the measured positions, the mean of both coordinates; NaN where none is stated.

        None where the covariance is.
        """
        covariance = self.position_covariance
        return None if covariance is None else _mean_variance(covariance)

    @property
    def seen(self) -> Bool[np.ndarray, "time body"]:
        """Whether an object was seen in a frame."""
        return np.isfinite(self.positions).all(axis=-1)

    @property
    def first_seen(self) -> Float[np.ndarray, "body"]:
        """Time in s at which each object was first seen."""
        return self.times[self.seen.argmax(axis=0)]

    @property
    def last_seen(self) -> Float[np.ndarray, "body"]:
        """Time in s at which each object was last seen."""
        return self.times[::-1][self.seen[::-1].argmax(axis=0)]

    @property
    def frame_rate(self) -> float:
        """Frames per second: of the camera where it says so, else from the median time step."""
        if self.camera is not None and self.camera.frame_rate is not None:
            return self.camera.frame_rate
        return float(1 / np.median(np.diff(self.times)))

    def index(self, body: str) -> int:
        """Place of an object on the body axis.

        Raises
        ------
        InputError
            If no object has that id.
        """
        for index, candidate in enumerate(self.bodies):
            if candidate.id == body:
                return index
        raise InputError(
            f"{self.video}: there is no object '{body}'; the objects are {', '.join(b.id for b in self.bodies)}."
        )

    def at_times(self, times: Float[np.ndarray, "time"]) -> "Tracks":
        """The same tracks with other times (s) of the frames."""
        return replace(self, data=self.data.assign_coords(time=("time", times, self.data["time"].attrs)))

    def until(self, time: float) -> "Tracks":
        """The same tracks up to and including a time (s); objects not seen twice by then are left out.

        Raises
        ------
        InputError
            If what is left is refused: of a few frames the noise is not told, by which bodies may overlap.
        """
        data = self.data.sel(time=slice(None, time + 1e-9))
        keep = np.isfinite(data["x"].values).sum(axis=0) >= 2
        bodies = tuple(body for body, kept in zip(self.bodies, keep, strict=True) if kept)
        return Tracks(self.video, bodies, data.isel(body=keep), self.walls, self.camera)

    def _check_names(self) -> None:
        ids = [body.id for body in self.bodies]
        if not ids:
            raise InputError(f"{self.video}: there are 0 objects; give tracks of at least one.")
        if len(set(ids)) < len(ids):
            raise InputError(f"{self.video}: two objects have the same id ({', '.join(ids)}); name them apart.")
        if list(self.data["body"].values) != ids:
            raise InputError(f"{self.video}: the body axis of the data does not match the objects {', '.join(ids)}.")

    def _check_values(self) -> None:
        times, positions = self.times, self.positions
        if not np.isfinite(times).all():
            raise InputError(f"{self.video}: a time is not finite; give every row a time in seconds.")
        steps = np.diff(times)
        if (steps <= 0).any():
            where = times[1:][steps <= 0][0]
            raise InputError(
                f"{self.video}: times are not strictly increasing at {where:g} s; sort the rows and drop duplicates."
            )
        if (far := np.abs(positions) > FARTHEST).any():
            frame, body, axis = np.argwhere(far)[0]
            value = positions[frame, body, axis]
            where = "infinite" if np.isinf(value) else f"{value:.3g} m away, farther than {FARTHEST:g} m"
            raise InputError(
                f"{self.video}: the position of object {self.bodies[body].id} at {times[frame]:g} s is {where}; "
                "leave a missing observation out."
            )
        for body, count in zip(self.bodies, self.seen.sum(axis=0).tolist(), strict=True):
            if count < 2:
                raise InputError(
                    f"{self.video}: object {body.id} was seen in {count} frame{'s' * (count != 1)}; "
                    "at least two are needed to tell its motion."
                )

    def _check_angles(self) -> None:
        """A jump by whole turns from one frame to the next, beside steps of less than a quarter, is one of wrapping."""
        if (angles := self.angles) is None:
            return
        for index, body in enumerate(self.bodies):
            there = np.flatnonzero(np.isfinite(angles[:, index]))
            if len(there) < FEWEST_STEPS + 1 or body.shape is Shape.SPHERE:
                continue
            spans, steps = np.diff(self.times[there]), np.diff(angles[there, index])
            rates = np.pad(steps / spans, 1, mode="edge")
            slower = np.where(np.abs(rates[:-2]) < np.abs(rates[2:]), rates[:-2], rates[2:])
            turns = (steps - slower * spans) / (2 * np.pi)
            calm = (np.abs(rates[:-2]) * spans < np.pi / 2) & (np.abs(rates[2:]) * spans < np.pi / 2)
            whole = (np.rint(turns) != 0) & (np.abs(turns - np.rint(turns)) < WHOLE)
            wrapped = whole & calm & (spans < FRAME * np.median(spans))
            if wrapped[1:-1].any():
                where = int(wrapped[1:-1].argmax()) + 1
                raise InputError(
                    f"{self.video}: the angle of object {body.id} jumps by {abs(steps[where]):.3g} rad at "
                    f"{self.times[there[where + 1]]:g} s; give angles in rad that do not wrap (numpy.unwrap)."
                )

    def _noise(self, body: int) -> float:
        """Roughness (m) of the track of a body along its rougher axis; 0 where there are too few positions."""
        seen = np.flatnonzero(self.seen[:, body])
        windows = seen[np.arange(max(len(seen) - WINDOW + 1, 0))[:, None] + np.arange(WINDOW)]
        if len(windows) < FEWEST:
            return 0.0
        differences = np.einsum("wf,wfa->wa", third_difference(self.times[windows]), self.positions[windows, body])
        return float(np.median(np.abs(differences), axis=0).max()) / NORMAL_MAD

    def overlaps(self) -> list[str]:
        """What overlaps where bodies are first seen, each in words: bodies with one another, and with walls."""
        return [one.words for one in (*self._closest_bodies(), *self._closest_walls()) if one.missing(0.0) > 0]

    def _check_overlap(self) -> None:
        kinds = {"positions and radii": self._closest_bodies(), "positions, radii and walls": self._closest_walls()}
        for kind, some in kinds.items():
            for one in some:
                missing = one.missing(OVERLAP_TOLERANCE)
                if missing > 0 and missing > OVERLAP_NOISE * math.hypot(*map(self._noise, one.bodies)):
                    raise InputError(f"{self.video}: {one.words}; check {kind}.")

    def _closest_bodies(self) -> Iterator["_Closeness"]:
        """How close each two bodies are where both are first seen."""
        seen, positions = self.seen, self.positions
        for i, first in enumerate(self.bodies):
            for j in range(i + 1, len(self.bodies)):
                second = self.bodies[j]
                together = seen[:, i] & seen[:, j]
                if not together.any() or first.radius is None or second.radius is None:
                    continue
                frame = int(together.argmax())
                distance = float(np.linalg.norm(positions[frame, i] - positions[frame, j]))
                words = (
                    f"objects {first.id} and {second.id} overlap at {self.times[frame]:g} s "
                    f"(centres {distance:.3g} m apart, radii {first.radius:g} and {second.radius:g} m)"
                )
                yield _Closeness((i, j), distance, first.radius + second.radius, words)

    def _closest_walls(self) -> Iterator["_Closeness"]:
        """How close each body is to each wall where it is first seen."""
        for index, body in enumerate(self.bodies):
            if body.radius is None:
                continue
            frame = int(self.seen[:, index].argmax())
            for wall in self.walls:
                distance = wall.distance(self.positions[frame, index])
                words = (
                    f"object {body.id} overlaps the wall from ({wall.x1:g}, {wall.y1:g}) to "
                    f"({wall.x2:g}, {wall.y2:g}) m at {self.times[frame]:g} s (centre {distance:.3g} m from it, "
                    f"radius {body.radius:g} m)"
                )
                yield _Closeness((index,), distance, body.radius, words)


@dataclass(frozen=True)
class _Closeness:
    """How close two things are, whose radii add up to `reach` (m), which of them are bodies, and all of it in words."""

    bodies: tuple[int, ...]
    distance: float
    reach: float
    words: str

    def missing(self, tolerance: float) -> float:
        """Distance in m that is missing to their touching, if a share of the reach may be wrong."""
        return (1 - tolerance) * self.reach - self.distance


def _mean_variance(covariance: Float[np.ndarray, "time body 2 2"]) -> Float[np.ndarray, "time body"]:
    """Mean variance of both coordinates; NaN where it is none."""
    variance = np.trace(covariance, axis1=-2, axis2=-1) / 2
    return np.where(np.isfinite(covariance).all(axis=(-1, -2)) & (variance > 0), variance, np.nan)


def _numbers(video: str, name: str, values: ArrayLike) -> Float[np.ndarray, "..."]:
    """Values as an array of numbers."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{video}: {name} are not an array of numbers ({error}); give one.") from error


def _check_shape(video: str, name: str, values: Float[np.ndarray, "..."], shape: tuple[int, ...], axes: str) -> None:
    """Refuse an array of another shape."""
    if values.shape != shape:
        raise InputError(
            f"{video}: {name} have the shape {values.shape}; with these times and objects it must be {shape}: {axes}."
        )
