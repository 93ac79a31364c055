"""Place the known objects in one frame: nearest first, each judged by what it would show in front of the others."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from jaxtyping import UInt8

from vrdp_prob.perception.appearance import Appearance, Evidence
from vrdp_prob.perception.contour import ContourFit, fit_contour
from vrdp_prob.perception.region import Gain, Window, apparent_radius, climb, paint, polygon_area
from vrdp_prob.perception.solids import Pose, Solid, depth
from vrdp_prob.scene.body import Shape
from vrdp_prob.scene.camera import Camera

_STEPS = (0.3, 0.15, 0.07)
"""Compass steps of the search in apparent radii."""
_CLEAR_SUPPORT = 0.9
"""Share of the visible outline on clean edges from which a guess needs no search."""
_SEARCH_MARGIN = 2.0
"""Apparent radii around the first guesses in which an object is looked for."""
_PROFILES = (0.24, 0.2, 0.16)
"""Half lengths of the contour's profiles in apparent radii."""
_SHORTEST_PROFILE = 3.0
_COVER_MARGIN = 1
"""Pixels around a nearer object in which nothing is measured of the one behind."""
_LEAST_VISIBLE = 0.1
"""Share of an object's picture that must show for it to count as seen."""
_LEAST_ODDS = 1.0
"""Mean log odds per visible pixel below which the object is not there."""
_FAINT_ODDS = 0.0
_FAINT_SUPPORT = 0.7
"""Where the colours say little (a gray object in its own shadow's colour), so much of the outline must lie on edges."""
_LEARN_VISIBLE = 0.5
_MEMORY = 0.85
_FLOOR_LIKE = -9.0
"""Log density above which a pixel looks like plain floor."""


@dataclass(frozen=True)
class Sighting:
    """One object in one frame.

    Parameters
    ----------
    pose
        Where it is.
    contour
        The fit of its outline, None where too little of it shows.
    visible
        Share of its picture that lies in the frame and in front of the others.
    odds
        Mean log odds per visible pixel that the object is there.
    """

    pose: Pose
    contour: ContourFit | None
    visible: float
    odds: float

    @property
    def seen(self) -> bool:
        """Whether the picture shows it."""
        outlined = self.contour is not None and self.contour.support >= _FAINT_SUPPORT
        return self.visible >= _LEAST_VISIBLE and self.odds >= (_FAINT_ODDS if outlined else _LEAST_ODDS)


@dataclass
class Track:
    """One object through the frames.

    Parameters
    ----------
    number
        Order of discovery.
    radius
        Radius or half side in m.
    shape
        Current belief.
    appearance
        Its colours.
    sightings
        By frame; frames in which it was not seen are absent.
    shape_scores
        Evidence for each shape: outline misfits, negative, summed over the frames that were looked at.
    shape_frames
        How many these are.
    expected
        Where it is thought to be now.
    gone
        Whether it has left the picture; it is not looked for any more.
    """

    number: int
    radius: float
    shape: Shape
    appearance: Appearance
    sightings: dict[int, Sighting] = field(default_factory=dict)
    shape_scores: dict[Shape, float] = field(default_factory=lambda: dict.fromkeys(Shape, 0.0))
    shape_frames: int = 0
    expected: Pose = field(default_factory=lambda: Pose(0.0, 0.0))
    gone: bool = False

    @property
    def solid(self) -> Solid:
        """What is looked for."""
        return Solid(self.shape, self.radius)

    def predict(self, frame: int, direction: int) -> Pose | None:
        """Pose in a frame if it goes on as in the nearest two sightings; None where there is none near."""
        near = [frame - direction * back for back in range(1, 6) if frame - direction * back in self.sightings]
        if not near:
            return None
        last = self.sightings[near[0]].pose
        if len(near) == 1:
            return last
        before = self.sightings[near[1]].pose
        share = (frame - near[0]) / (near[0] - near[1])
        return last.moved(*(share * (getattr(last, name) - getattr(before, name)) for name in ("x", "y", "yaw")))


class Placer:
    """Places objects in frames of one camera."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera

    def window(self, solid: Solid, pose: Pose) -> Window:
        """The solid's pixels."""
        return paint(solid.polygon(self.camera, pose), self.camera.height, self.camera.width)

    def surroundings(self, solid: Solid, poses: Sequence[Pose]) -> tuple[slice, slice]:
        """Rectangle of the frame in which a search from the given poses stays."""
        size = max(apparent_radius(self.camera, solid, pose) for pose in poses)
        points = np.concatenate([solid.polygon(self.camera, pose) for pose in poses])
        low = np.floor(points.min(axis=0) - _SEARCH_MARGIN * size).astype(int)
        high = np.ceil(points.max(axis=0) + _SEARCH_MARGIN * size).astype(int)
        limits = np.array([self.camera.width, self.camera.height])
        (left, top), (right, bottom) = np.clip(low, 0, limits), np.clip(high, 0, limits)
        return slice(int(top), int(bottom)), slice(int(left), int(right))

    def place(
        self, evidence: Evidence, tracks: Sequence[Track], starts: Mapping[int, Sequence[Pose]]
    ) -> dict[int, Sighting]:
        """Sightings of all tracks in one frame, each from its candidate starts (by track number)."""
        order = sorted(tracks, key=lambda track: depth(self.camera, starts[track.number][0], track.radius))
        windows = {track.number: self.window(track.solid, starts[track.number][0]) for track in order}
        covered = np.zeros(evidence.floor.shape, np.uint8)
        sightings: dict[int, Sighting] = {}
        for index, track in enumerate(order):
            behind = [(windows[other.number], other.appearance) for other in order[index + 1 :]]
            place = self.surroundings(track.solid, starts[track.number])
            gain = Gain.of(evidence, track.appearance, covered, behind, place)
            sighting = self.sight(evidence, gain, track.solid, starts[track.number], covered)
            sightings[track.number] = sighting
            if sighting.seen:
                window = self.window(track.solid, sighting.pose)
                covered[window.place] |= window.mask
        return sightings

    def sight(
        self,
        evidence: Evidence,
        gain: Gain,
        solid: Solid,
        starts: Sequence[Pose],
        covered: UInt8[np.ndarray, "height width"],
    ) -> Sighting:
        """Best pose of one solid: its outline where a guess is near enough, else a search by region before that."""
        best = max(starts, key=lambda start: gain.score(solid.polygon(self.camera, start)))
        contour = self.refine(evidence, solid, best, covered)
        if contour is None or contour.support < _CLEAR_SUPPORT:
            pose, value = climb(gain, self.camera, solid, best, _STEPS)
            contour = self.refine(evidence, solid, pose, covered)
        else:
            pose, value = contour.pose, gain.score(solid.polygon(self.camera, contour.pose))
        if contour is not None:
            fitted = gain.score(solid.polygon(self.camera, contour.pose))
            if fitted > value - 0.08 * abs(value) - 30:
                pose = contour.pose
                value = fitted
            else:
                contour = None
        visible = self.visibility(solid, pose, covered)
        pixels = visible * polygon_area(solid.polygon(self.camera, pose))
        return Sighting(pose, contour, visible, value / max(pixels, 1.0))

    def refine(
        self, evidence: Evidence, solid: Solid, pose: Pose, covered: UInt8[np.ndarray, "height width"]
    ) -> ContourFit | None:
        """Fit the outline where nothing nearer hides it."""
        return self.refine_picture(evidence.picture, solid, pose, covered)

    def refine_picture(
        self,
        picture: UInt8[np.ndarray, "height width 3"],
        solid: Solid,
        pose: Pose,
        covered: UInt8[np.ndarray, "height width"],
    ) -> ContourFit | None:
        """Fit the outline in a bare picture where nothing nearer hides it."""
        size = apparent_radius(self.camera, solid, pose)
        halves = tuple(max(_SHORTEST_PROFILE, share * size) for share in _PROFILES)
        blocked = cv2.dilate(covered, np.ones((2 * _COVER_MARGIN + 1,) * 2, np.uint8)) if covered.any() else None
        return fit_contour(picture, self.camera, solid, pose, halves=halves, covered=blocked)

    def visibility(self, solid: Solid, pose: Pose, covered: UInt8[np.ndarray, "height width"]) -> float:
        """Share of the solid's picture that lies in the frame and in front of what is nearer."""
        polygon = solid.polygon(self.camera, pose)
        window = paint(polygon, self.camera.height, self.camera.width)
        free = int(np.count_nonzero(window.mask & (covered[window.place] == 0)))
        return min(1.0, free / max(polygon_area(polygon), 1.0))

    def learn(
        self, evidence: Evidence, track: Track, sighting: Sighting, covered: UInt8[np.ndarray, "height width"]
    ) -> None:
        """Update a track's colours from a sighting that shows enough of it."""
        if sighting.visible < _LEARN_VISIBLE:
            return
        window = self.window(track.solid, sighting.pose)
        core = cv2.erode(window.mask, np.ones((3, 3), np.uint8)) > 0
        core &= (covered[window.place] == 0) & (evidence.floor[window.place] < _FLOOR_LIKE)
        track.appearance.learn(evidence.bins[window.place][core], memory=_MEMORY)
