"""Videos of sliding discs with questions about a word, answered by running the same discs again with the change."""

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from tests.reasoning.sliding_discs import COLORS, Disc, KnownPosterior, path, tracks_of
from vrdp_prob.concepts.physical import Example

FRAMES = 64
MOST_TRIES = 1000

Changed = Callable[[Disc], Disc]


def heavier(disc: Disc) -> Disc:
    return replace(disc, mass=6 * disc.mass)


def bouncier(disc: Disc) -> Disc:
    return replace(disc, restitution=min(disc.restitution + 0.6, 1.0))


def slipperier(disc: Disc) -> Disc:
    return replace(disc, friction=disc.friction / 8)


def faster(disc: Disc) -> Disc:
    return replace(disc, velocity=(1.7 * disc.velocity[0], 1.7 * disc.velocity[1]))


def unchanged(disc: Disc) -> Disc:
    return disc


def discs_of(generator: np.random.Generator) -> tuple[Disc, ...]:
    """Two discs that slide at two others, which rest; anything may happen."""
    resting = [(0.0, 0.0), (float(generator.uniform(0.55, 1.1)), float(generator.uniform(-0.45, 0.45)))]
    moving = []
    for side, target in ((-1.0, resting[0]), (1.0, resting[1])):
        angle = generator.uniform(-0.7, 0.7) + (np.pi if side < 0 else 0.0)
        start = np.array(target) + 1.3 * np.array([np.cos(angle), np.sin(angle)])
        aim = np.array(target) + generator.uniform(-0.25, 0.25, 2) - start
        velocity = generator.uniform(0.9, 1.5) * aim / np.linalg.norm(aim)
        moving.append((tuple(start.tolist()), tuple(velocity.tolist())))
    made = [Disc(place, velocity) for place, velocity in moving] + [Disc(place) for place in resting]
    return tuple(
        replace(
            disc,
            mass=float(generator.lognormal(0, 0.3)),
            restitution=float(generator.uniform(0.3, 0.9)),
            friction=float(generator.uniform(0.03, 0.06)),
        )
        for disc in made
    )


def examples_of(word: str, change: Changed, count: int, seed: int = 0) -> list[Example]:
    """One question about each of so many videos: what would happen if its first disc were changed."""
    generator = np.random.default_rng(seed)
    return [example_of(word, change, discs_of(generator), number) for number in range(count)]


def example_of(word: str, change: Changed, discs: tuple[Disc, ...], seed: int = 0) -> Example:
    """A question about the first disc, every pair a choice."""
    posterior = KnownPosterior(tracks_of(discs, FRAMES, seed=seed), discs, seed=seed)
    return Example.of(posterior, question_about(word, 0), choices=choices_of(discs, change))


def question_about(word: str, place: int) -> str:
    return f"If the {COLORS[place]} cylinder were {word}, what would happen?"


def choices_of(discs: tuple[Disc, ...], change: Changed) -> dict[str, bool]:
    """Every pair as a choice, and whether it collides with the first disc changed."""
    _, contacts = path([change(discs[0]), *discs[1:]], FRAMES)
    meet = {frozenset(pair) for _, *pair in contacts}
    pairs = combinations(range(len(discs)), 2)
    return {
        f"The {COLORS[one]} cylinder collides with the {COLORS[other]} cylinder": frozenset((one, other)) in meet
        for one, other in pairs
    }


def write_videos(folder: Path, word: str, change: Changed, several: Sequence[tuple[Disc, ...]]) -> Path:
    """Write a tracks folder and its question file; returns the question file."""
    rows, objects, scenes = ["video,object,time,x,y"], ["video,object,shape,radius,material,color"], []
    for number, discs in enumerate(several):
        tracks, video = tracks_of(discs, FRAMES, seed=number), f"video_{number:05d}"
        for time, places in zip(tracks.times, tracks.positions, strict=True):
            rows += [f"{video},{place},{time:.2f},{x:.5f},{y:.5f}" for place, (x, y) in enumerate(places)]
        objects += [f"{video},{body.id},cylinder,0.2,metal,{body.color}" for body in tracks.bodies]
        choices = [
            {"choice_id": place, "choice": text, "answer": "correct" if right else "wrong"}
            for place, (text, right) in enumerate(choices_of(discs, change).items())
        ]
        question = {"question_id": 7, "question": question_about(word, 0), "choices": choices}
        other = {"question_id": 8, "question": "How many collisions happen?", "answer": "1"}
        scenes.append({"scene_index": number, "video_filename": f"{video}.mp4", "questions": [other, question]})
    (folder / "tracks.csv").write_text("\n".join(rows) + "\n")
    (folder / "objects.csv").write_text("\n".join(objects) + "\n")
    file = folder / "questions.json"
    file.write_text(json.dumps(scenes))
    return file
