"""Follow objects through the frames: forward to find them and learn what they are, backward to measure them."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import UInt8
from scipy.optimize import linear_sum_assignment

from vrdp_prob.perception.appearance import Evidence, frame_evidence
from vrdp_prob.perception.background import estimate_background
from vrdp_prob.perception.contour import WORST_MISFIT
from vrdp_prob.perception.placing import Placer, Sighting, Track
from vrdp_prob.perception.proposing import Proposal, propose
from vrdp_prob.perception.region import Gain, climb
from vrdp_prob.perception.solids import Pose, Solid, depth
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.scene.body import Shape
from vrdp_prob.scene.camera import Camera

_LEARN_EVERY = 2
_LEARN_FIRST = 5
_GRAY_EVERY = 4
"""Frames between searches for gray objects, which the backward pass follows into the frames between."""
_SHAPE_EVERY = 8
"""Frames between looks at a track's shape after the first few."""
_SHAPE_FIRST = 4
_SHAPE_VISIBLE = 0.9
"""Share of an object's picture that must show for its shape to be judged."""
_YAWS = tuple(np.radians((0.0, 30.0, 60.0)))
_SHAPE_STEPS = (0.2, 0.1, 0.05)
_REUNION_DISTANCE = 1.0
"""Metres from the expected place within which a lost object may be found again."""
_REUNION_LIKENESS = 0.5
_SOLID_SUPPORT = 0.6
_FEWEST_OUTLINES = 3
_NO_PAIR = 1e3
_FEWEST_FRAMES = 4
"""Sightings below which a track is taken for a passing disturbance."""


class Tracker:
    """Follows all objects of one video.

    Parameters
    ----------
    frames
        RGB pictures.
    camera
        The camera.
    radius
        Radius or half side of every object, m.
    """

    def __init__(self, frames: UInt8[np.ndarray, "frame height width 3"], camera: Camera, radius: float) -> None:
        self.frames = frames
        self.camera = camera
        self.radius = radius
        self.placer = Placer(camera)
        self.background = estimate_background(frames)
        self.tracks: list[Track] = []

    def run(self, progress: ProgressDisplay | None = None) -> list[Track]:
        """Find, follow and measure; tracks that were hardly seen are left out."""
        display = progress or SilentProgress()
        count = len(self.frames)
        with display.stage("Finding objects", count) as advance:
            for frame in range(count):
                self._forward(frame)
                advance(1)
        self.tracks = [track for track in self.tracks if len(track.sightings) >= _FEWEST_FRAMES]
        for track in self.tracks:
            track.gone = False
            if track.shape_frames == 0:
                self._weigh_shapes_late(track)
        with display.stage("Measuring positions", count) as advance:
            for frame in reversed(range(count)):
                self._backward(frame)
                advance(1)
        return [track for track in self.tracks if _is_solid(track)]

    def evidence(self, frame: int) -> Evidence:
        """What a frame says at each pixel."""
        return frame_evidence(self.frames[frame], self.background)

    def _forward(self, frame: int) -> None:
        evidence = self.evidence(frame)
        live = [track for track in self.tracks if not track.gone]
        starts = {track.number: self._starts(track, frame, 1) for track in live}
        sightings = self.placer.place(evidence, live, starts)
        self._record(evidence, frame, live, sightings)
        explained = self._explained(evidence, live, sightings)
        proposals = propose(self.placer, evidence, explained, self.radius, gray=frame % _GRAY_EVERY == 0)
        self._adopt(evidence, frame, proposals)

    def _backward(self, frame: int) -> None:
        """Sight every track again with its final shape, also before it was first noticed."""
        evidence = self.evidence(frame)
        live, starts = [], {}
        for track in self.tracks:
            guesses = []
            if frame in track.sightings:
                guesses.append(track.sightings[frame].pose)
            follow = track.predict(frame, -1)
            if follow is not None:
                guesses.append(follow)
            if guesses:
                live.append(track)
                starts[track.number] = guesses
        sightings = self.placer.place(evidence, live, starts)
        for track in live:
            track.sightings.pop(frame, None)
            sighting = sightings[track.number]
            if sighting.seen:
                track.sightings[frame] = sighting
                if frame % _LEARN_EVERY == 0:
                    self.placer.learn(evidence, track, sighting, self.covered(track, live, sightings))

    def _starts(self, track: Track, frame: int, direction: int) -> list[Pose]:
        predicted = track.predict(frame, direction)
        if predicted is None:
            return [track.expected]
        last = track.sightings.get(frame - direction)
        return [predicted] if last is None else [predicted, last.pose]

    def _record(self, evidence: Evidence, frame: int, live: Sequence[Track], sightings: Mapping[int, Sighting]) -> None:
        for track in live:
            sighting = sightings[track.number]
            if sighting.seen:
                track.sightings[frame] = sighting
                track.expected = sighting.pose
                if frame % _LEARN_EVERY == 0 or len(track.sightings) <= _LEARN_FIRST:
                    self.placer.learn(evidence, track, sighting, self.covered(track, live, sightings))
                self._look_at_shape(evidence, track, live, sightings)
            else:
                track.expected = track.predict(frame, 1) or track.expected
                track.gone = self.placer.window(track.solid, track.expected).area == 0

    def covered(
        self, track: Track, live: Sequence[Track], sightings: Mapping[int, Sighting]
    ) -> UInt8[np.ndarray, "height width"]:
        """Pixels of what is seen nearer than a track."""
        covered = np.zeros(self.frames.shape[1:3], np.uint8)
        own = depth(self.camera, sightings[track.number].pose, track.radius)
        for other in live:
            sighting = sightings[other.number]
            if other is not track and sighting.seen and depth(self.camera, sighting.pose, other.radius) < own:
                window = self.placer.window(other.solid, sighting.pose)
                covered[window.place] |= window.mask
        return covered

    def _look_at_shape(
        self, evidence: Evidence, track: Track, live: Sequence[Track], sightings: Mapping[int, Sighting]
    ) -> None:
        """Weigh the shapes where it is time to and the object shows whole."""
        due = track.shape_frames < _SHAPE_FIRST or len(track.sightings) % _SHAPE_EVERY == 0
        sighting = sightings[track.number]
        if due and sighting.visible >= _SHAPE_VISIBLE:
            self._weigh_shapes(evidence, track, live, sightings)

    def _weigh_shapes_late(self, track: Track) -> None:
        """Judge the shape of a track that was never seen whole by the frames that show most of it."""
        ranked = sorted(track.sightings, key=lambda frame: -track.sightings[frame].visible)
        for frame in ranked[:_SHAPE_FIRST]:
            live = [other for other in self.tracks if frame in other.sightings]
            sightings = {other.number: other.sightings[frame] for other in live}
            self._weigh_shapes(self.evidence(frame), track, live, sightings)

    def _weigh_shapes(
        self, evidence: Evidence, track: Track, live: Sequence[Track], sightings: Mapping[int, Sighting]
    ) -> None:
        """Compare how well the shapes fit in one frame; take the best so far."""
        sighting = sightings[track.number]
        covered = self.covered(track, live, sightings)
        behind = [
            (self.placer.window(other.solid, sightings[other.number].pose), other.appearance)
            for other in live
            if other is not track and sightings[other.number].seen
        ]
        place = self.placer.surroundings(track.solid, [sighting.pose])
        gain = Gain.of(evidence, track.appearance, covered, behind, place)
        results: dict[Shape, Pose] = {}
        for shape in Shape:
            solid = Solid(shape, track.radius)
            yaws = (sighting.pose.yaw,) if shape is not Shape.CUBE or track.shape is Shape.CUBE else _YAWS
            starts = [Pose(sighting.pose.x, sighting.pose.y, yaw) for yaw in yaws]
            results[shape], misfit = self._try_shape(evidence, gain, solid, starts, covered)
            track.shape_scores[shape] -= misfit
        track.shape_frames += 1
        best = max(track.shape_scores, key=lambda shape: track.shape_scores[shape])
        if best is not track.shape:
            track.shape = best
            track.expected = results[best]

    def _try_shape(
        self,
        evidence: Evidence,
        gain: Gain,
        solid: Solid,
        starts: Sequence[Pose],
        covered: UInt8[np.ndarray, "height width"],
    ) -> tuple[Pose, float]:
        """Best pose of one shape and how badly its outline fits there."""
        best, least = starts[0], np.inf
        for start in starts:
            pose, _ = climb(gain, self.camera, solid, start, _SHAPE_STEPS)
            fit = self.placer.refine(evidence, solid, pose, covered)
            if fit is not None and fit.misfit < least:
                best, least = fit.pose, fit.misfit
        return best, min(least, WORST_MISFIT)

    def _explained(
        self, evidence: Evidence, live: Sequence[Track], sightings: Mapping[int, Sighting]
    ) -> UInt8[np.ndarray, "height width"]:
        explained = np.zeros(evidence.floor.shape, np.uint8)
        for track in live:
            if sightings[track.number].seen:
                window = self.placer.window(track.solid, sightings[track.number].pose)
                explained[window.place] |= window.mask
        return explained

    def _adopt(self, evidence: Evidence, frame: int, proposals: Sequence[Proposal]) -> None:
        """Give each new sighting to a lost track that it continues, or else a track of its own."""
        lost = [track for track in self.tracks if not track.gone and frame not in track.sightings]
        costs = np.full((len(proposals), len(lost)), _NO_PAIR)
        for row, proposal in enumerate(proposals):
            for column, track in enumerate(lost):
                distance = np.hypot(proposal.pose.x - track.expected.x, proposal.pose.y - track.expected.y)
                likeness = proposal.appearance.likeness(track.appearance)
                if distance < _REUNION_DISTANCE and likeness > _REUNION_LIKENESS:
                    costs[row, column] = distance / _REUNION_DISTANCE + 1 - likeness
        pairs = dict(zip(*linear_sum_assignment(costs), strict=True)) if costs.size else {}
        for row, proposal in enumerate(proposals):
            if row in pairs and costs[row, pairs[row]] < _NO_PAIR:
                track = lost[pairs[row]]
            else:
                track = Track(len(self.tracks), self.radius, proposal.shape, proposal.appearance)
                self.tracks.append(track)
            track.expected = proposal.pose
            nothing = np.zeros(evidence.floor.shape, np.uint8)
            gain = Gain.of(evidence, track.appearance, nothing, [])
            sighting = self.placer.sight(evidence, gain, track.solid, [proposal.pose], nothing)
            track.sightings[frame] = sighting


def _is_solid(track: Track) -> bool:
    """Whether a track was seen often enough with an outline that fits; a glint or a stray patch has none."""
    fits = [sighting.contour for sighting in track.sightings.values() if sighting.contour is not None]
    return sum(fit.support >= _SOLID_SUPPORT for fit in fits) >= _FEWEST_OUTLINES
