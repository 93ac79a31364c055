"""Measure perception against the annotations of the practice videos.

    python benchmarks/perception.py [--json FILE] [--videos 1,2,4:9]

Development videos (1, 2, 4-9) and report videos (0, 3, 10-15) are told apart, and so are the two renderers (Cycles:
0-3, the fast renderer: the others). The data lie in ../shared/data/clevrer_bullet; without them nothing is measured.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from vrdp_prob.datasets.clevrer import read_annotation
from vrdp_prob.perception import calibrate_from_videos, read_video
from vrdp_prob.scene import Camera, Tracks
from vrdp_prob.scene.camera import REST_HEIGHT

DATA = Path(__file__).parents[2] / "shared" / "data" / "clevrer_bullet"
DEVELOPMENT = (1, 2, 4, 5, 6, 7, 8, 9)
REPORT = (0, 3, 10, 11, 12, 13, 14, 15)
CYCLES = (0, 1, 2, 3)
MATCHED = 0.5
"""Metres of mean distance within which a track belongs to an annotated object."""
SWITCH_MARGIN = 0.1
"""Metres by which a row must be nearer to another object to count as an identity switch."""
CHI_SQUARE_95 = 5.991
"""95th percentile of the squared normalised error of two coordinates."""


@dataclass
class Tally:
    """What was measured over some videos."""

    errors: list[float] = field(default_factory=list)
    normalised: list[float] = field(default_factory=list)
    entry_lags: list[int] = field(default_factory=list)
    right: dict[str, list[bool]] = field(default_factory=lambda: {"color": [], "material": [], "shape": []})
    mirrored: list[bool] = field(default_factory=list)
    sure: list[bool] = field(default_factory=list)
    material_odds: list[float] = field(default_factory=list)
    rows: int = 0
    rows_in_view: int = 0
    objects: int = 0
    found: int = 0
    extra: int = 0
    switches: int = 0
    invented: int = 0
    seconds: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)

    def add(self, other: "Tally") -> None:
        """Take another tally in."""
        for name, value in vars(other).items():
            if isinstance(value, dict):
                for key, items in value.items():
                    getattr(self, name)[key] += items
            else:
                setattr(self, name, getattr(self, name) + value)


def truth(annotation: dict[str, Any]) -> np.ndarray:
    """True positions (time, object, 2), NaN out of view."""
    frames = annotation["motion_trajectory"]
    positions = np.full((len(frames), len(annotation["object_property"]), 2), np.nan)
    for index, frame in enumerate(frames):
        for item in frame["objects"]:
            if item["inside_camera_view"]:
                positions[index, item["object_id"]] = item["location"][:2]
    return positions


def score(tracks: Tracks, annotation: dict[str, Any]) -> Tally:
    """Compare the tracks of one video with its annotation."""
    true, measured = truth(annotation), tracks.positions
    distance = np.linalg.norm(measured[:, :, None] - true[:, None], axis=-1)
    both = np.isfinite(distance)
    mean = np.where(both, np.minimum(np.nan_to_num(distance), 1), 0).sum(axis=0) / np.maximum(both.sum(axis=0), 1)
    mean[~both.any(axis=0)] = 10
    pairs = [
        (row, column) for row, column in zip(*linear_sum_assignment(mean), strict=True) if mean[row, column] < MATCHED
    ]
    tally = Tally(objects=int(np.isfinite(true[..., 0]).any(axis=0).sum()), found=len(pairs))
    tally.extra = measured.shape[1] - len(pairs)
    for row, column in pairs:
        _score_object(tally, tracks, annotation["object_property"][column], true, distance, pair=(row, column))
    return tally


def _score_object(
    tally: Tally,
    tracks: Tracks,
    properties: dict[str, Any],
    true: np.ndarray,
    distance: np.ndarray,
    *,
    pair: tuple[int, int],
) -> None:
    row, column = pair
    in_view, seen = np.isfinite(true[:, column, 0]), tracks.seen[:, row]
    both = in_view & seen
    error = tracks.positions[both, row] - true[both, column]
    covariance = tracks.position_covariance
    assert covariance is not None
    tally.errors += np.linalg.norm(error, axis=1).tolist()
    tally.normalised += np.einsum("ni,nij,nj->n", error, np.linalg.inv(covariance[both, row]), error).tolist()
    tally.rows_in_view += int(in_view.sum())
    tally.rows += int(both.sum())
    tally.invented += int((seen & ~in_view).sum())
    tally.entry_lags.append(abs(int(seen.argmax()) - int(in_view.argmax())))
    nearest = np.nanmin(np.where(np.isfinite(distance[:, row]), distance[:, row], np.inf), axis=1)
    tally.switches += int((nearest[both] + SWITCH_MARGIN < distance[both, row, column]).sum())
    body = tracks.bodies[row]
    for name in tally.right:
        tally.right[name].append(str(getattr(body, name)) == properties[name])
    if properties["shape"] == "sphere":
        tally.mirrored.append(body.material == properties["material"])
    probabilities = body.probabilities("material")
    tally.material_odds.append(float(probabilities.get(properties["material"], 0.0)))
    if max(probabilities.values()) >= 0.9:
        tally.sure.append(body.material == properties["material"])


def checks(name: str, tally: Tally) -> list[dict[str, Any]]:
    """The goals, measured on one group of videos."""

    def percent(values: Sequence[bool]) -> float | None:
        return round(100 * float(np.mean(values)), 1) if values else None

    def quantile(values: Sequence[float], share: float) -> float | None:
        return round(float(np.quantile(values, share)), 4) if values else None

    def mean(values: Sequence[float]) -> float | None:
        return round(float(np.mean(values)), 2) if values else None

    def slowest(values: Sequence[float]) -> float | None:
        return round(max(values), 1) if values else None

    def count(value: int) -> int | None:
        return value if tally.objects else None

    measured = [True] * tally.rows + [False] * (tally.rows_in_view - tally.rows)
    covered = [value < CHI_SQUARE_95 for value in tally.normalised]
    rows: list[tuple[str, float | None, float | None, str]] = [
        ("position error, median (m)", quantile(tally.errors, 0.5), 0.03, "<="),
        ("position error, 95th percentile (m)", quantile(tally.errors, 0.95), 0.10, "<="),
        ("position error, largest (m)", quantile(tally.errors, 1.0), None, ""),
        ("identity switches (rows)", count(tally.switches), 0, "<="),
        ("objects missed", count(tally.objects - tally.found), 0, "<="),
        ("objects invented", count(tally.extra), 0, "<="),
        ("color right (%)", percent(tally.right["color"]), 97, ">="),
        ("shape right (%)", percent(tally.right["shape"]), 97, ">="),
        ("material right (%)", percent(tally.right["material"]), 90, ">="),
        ("material right, spheres (%)", percent(tally.mirrored), None, ""),
        ("material right, where stated with 90 % (%)", percent(tally.sure), None, ""),
        ("material, mean probability of the truth", mean(tally.material_odds), None, ""),
        ("first frame in view, worst lag (frames)", max(tally.entry_lags, default=None), 3, "<="),
        ("rows measured of those in view (%)", percent(measured), None, ""),
        ("rows with the centre out of view", count(tally.invented), None, ""),
        ("normalised squared error, mean (2 is calibrated)", mean(tally.normalised), None, ""),
        ("errors inside the stated 95 % ellipse (%)", percent(covered), None, ""),
        ("seconds per video, slowest", slowest(tally.seconds), 15, "<="),
        ("processor seconds per video, slowest", slowest(tally.processor), None, ""),
    ]
    return [_check(f"{name}: {label}", value, goal, sense) for label, value, goal, sense in rows]


def calibration_checks(camera: Camera) -> list[dict[str, Any]]:
    """A camera estimated from the development videos and their annotations against the true one."""
    known = [read_annotation(DATA / f"annotations/annotation_{number:05d}.json") for number in DEVELOPMENT]
    videos = [DATA / f"videos/video_{number:05d}.mp4" for number in DEVELOPMENT]
    found = calibrate_from_videos(videos, known)
    places = np.stack(np.meshgrid(np.linspace(-4, 4, 33), np.linspace(-4, 4, 33)), axis=-1).reshape(-1, 2)
    places = places[camera.in_view(places)]
    points = np.column_stack([places, np.full(len(places), REST_HEIGHT)])
    pixels = np.linalg.norm(found.project(points) - camera.project(points), axis=1)
    metres = np.linalg.norm(found.to_plane(camera.project(points), REST_HEIGHT) - places, axis=1)
    rows: list[tuple[str, float, float | None, str]] = [
        ("reprojection against the true camera, median (px)", round(float(np.median(pixels)), 3), None, ""),
        ("reprojection against the true camera, largest (px)", round(float(pixels.max()), 3), 1, "<="),
        ("position on the plane, largest (m)", round(float(metres.max()), 4), 0.03, "<="),
        ("stated reprojection error (px)", round(found.pixel_sd, 3), None, ""),
    ]
    return [_check(f"calibration: {label}", value, goal, sense) for label, value, goal, sense in rows]


def _check(name: str, value: float | None, goal: float | None, sense: str) -> dict[str, Any]:
    met = value is not None and (goal is None or (value <= goal if sense == "<=" else value >= goal))
    return {"name": name, "value": value, "goal": None if goal is None else f"{sense} {goal:g}", "ok": met}


def numbers(text: str) -> set[int]:
    """Numbers and ranges `first:last` (both counted), separated by commas."""
    found: set[int] = set()
    for part in text.split(","):
        first, _, last = part.partition(":")
        found |= set(range(int(first), int(last or first) + 1))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="write the checks to this file")
    parser.add_argument("--videos", help="only these, for example 1,2,4:9; any of the 60 may be named")
    arguments = parser.parse_args()
    wanted = numbers(arguments.videos) if arguments.videos else {*DEVELOPMENT, *REPORT}
    groups: dict[str, Tally] = {
        f"{use} {renderer}": Tally() for use in ("development", "report") for renderer in ("Cycles", "fast")
    }
    if DATA.is_dir():
        camera = Camera.read(DATA / "camera.json")
        for number in sorted(wanted):
            annotation = json.loads((DATA / f"annotations/annotation_{number:05d}.json").read_text())
            start, processor = time.perf_counter(), time.process_time()
            tracks = read_video(DATA / f"videos/video_{number:05d}.mp4", camera)
            seconds, busy = time.perf_counter() - start, time.process_time() - processor
            tally = score(tracks, annotation)
            tally.seconds, tally.processor = [seconds], [busy]
            use = "report" if number in REPORT else "development" if number in DEVELOPMENT else "other"
            groups.setdefault(f"{use} {'Cycles' if number in CYCLES else 'fast'}", Tally()).add(tally)
            print(
                f"video {number}: {tally.found}/{tally.objects} objects, {tally.seconds[0]:.1f} s, "
                f"median error {np.median(tally.errors):.4f} m",
                file=sys.stderr,
            )
    rows = [check for name, tally in groups.items() for check in checks(name, tally)]
    if DATA.is_dir() and not arguments.videos:
        rows += calibration_checks(Camera.read(DATA / "camera.json"))
    width = max(len(row["name"]) for row in rows)
    for row in rows:
        value = "-" if row["value"] is None else f"{row['value']:g}"
        verdict = "" if row["goal"] is None else "ok" if row["ok"] else "MISSED"
        print(f"{row['name']:<{width}}  {value:>9}  {row['goal'] or '':>8}  {verdict}")
    if arguments.json:
        arguments.json.write_text(json.dumps({"checks": rows}, indent=2) + "\n")


if __name__ == "__main__":
    main()
