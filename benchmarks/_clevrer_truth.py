"""True events of the practice scenes, for scoring and for running programs without any physics."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.facts import MOVING_SPEED, Motion, TableFacts
from vrdp_prob.scene import Body, Event, EventKind, Shape

FRAME_RATE = 25.0
VISIBLE_FRAMES = 128
_PREFIX = {Change.REMOVED: "remove", Change.HEAVIER: "heavier", Change.LIGHTER: "lighter"}


def true_facts(folder: Path, scene: int) -> TableFacts:
    """What really happens in a scene and in its changed worlds, from the annotation and the truth file."""
    annotation = json.loads((folder / "annotations" / f"annotation_{scene:05d}.json").read_text())
    truth = json.loads((folder / "truth" / f"truth_{scene:05d}.json").read_text())
    bodies = tuple(
        Body(str(o["object_id"]), Shape(o["shape"]), radius=0.2, material=o["material"], color=o["color"])
        for o in annotation["object_property"]
    )
    ids = [body.id for body in bodies]
    last = (VISIBLE_FRAMES - 1) / FRAME_RATE
    changed = {
        (change, place): EventTable.from_events(ids, [_events(truth["counterfactual"][f"{prefix}_{body.id}"], last)])
        for change, prefix in _PREFIX.items()
        for place, body in enumerate(bodies)
    }
    return TableFacts(
        bodies,
        EventTable.from_events(ids, [_events(truth["events"])], start=0.0, end=last),
        _motion(annotation),
        EventTable.from_events(ids, [_events(truth["unseen_events"])]),
        changed,
    )


def _events(entries: list[dict[str, Any]], last: float = np.inf) -> list[Event]:
    return [
        Event(
            entry["frame_id"] / FRAME_RATE,
            EventKind(entry["type"]),
            tuple(sorted(str(body) for body in entry["object_ids"])),
        )
        for entry in entries
        if entry.get("in_view", True) and entry["frame_id"] / FRAME_RATE <= last
    ]


def _motion(annotation: dict[str, Any]) -> Motion:
    frames = annotation["motion_trajectory"]
    in_view = np.array([[o["inside_camera_view"] for o in frame["objects"]] for frame in frames])
    velocity = np.array([[o["velocity"][:2] for o in frame["objects"]] for frame in frames])
    moving = in_view & (np.linalg.norm(velocity, axis=-1) > MOVING_SPEED)
    return Motion(np.arange(len(frames)) / FRAME_RATE, in_view[None], moving[None])
