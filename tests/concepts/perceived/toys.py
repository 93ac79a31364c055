"""Videos of painted patches, with questions about them: concepts can be learned from them in seconds."""

from collections.abc import Sequence

import numpy as np
import torch

from vrdp_prob.concepts.perceived.examples import Example
from vrdp_prob.concepts.perceived.lessons import Taught
from vrdp_prob.concepts.perceived.observation import Observation
from vrdp_prob.concepts.perceived.slides import SLIDE_STATISTICS
from vrdp_prob.reasoning.events import EventUniverse
from vrdp_prob.reasoning.program import check

PAINTS = {"red": (170, 40, 40), "blue": (50, 80, 210), "gray": (90, 90, 90)}
FRAMES, VIEWS, SIDE = 16, 3, 32

Thing = tuple[str, str, str]
"""Colour, material and shape."""


def crop(thing: Thing, noise: np.random.Generator) -> np.ndarray:
    """A square or a disc in its colour on a light floor, metal with a highlight; red, green, blue and mask."""
    color, material, shape = thing
    rows, columns = np.mgrid[-1 : 1 : SIDE * 1j, -1 : 1 : SIDE * 1j]
    size = noise.uniform(0.5, 0.6)
    distance = np.maximum(abs(rows), abs(columns)) if shape == "cube" else 1.3 * np.hypot(rows, columns)
    inside = distance < size
    picture = np.full((SIDE, SIDE, 3), 165.0)
    picture[inside] = PAINTS[color]
    if material == "metal":
        picture[np.hypot(rows + 0.2, columns + 0.2) < 0.15] = 240
    picture = picture * noise.uniform(0.8, 1.2) + noise.normal(0, 3, picture.shape)
    return np.concatenate([np.moveaxis(picture.clip(0, 255), -1, 0), 255.0 * inside[None]]).astype(np.uint8)


def observation(things: Sequence[Thing], noise: np.random.Generator) -> Observation:
    """Things that lie still and meet nothing."""
    count = len(things)
    universe = EventUniverse(tuple(str(place) for place in range(count)))
    crops = np.stack([[crop(thing, noise) for _ in range(VIEWS)] for thing in things])
    times = torch.arange(FRAMES, dtype=torch.double) / 25
    happens = torch.zeros(universe.size, dtype=torch.double)
    happens[-2:] = 1
    event_times = torch.full((universe.size,), torch.nan, dtype=torch.double)
    event_times[-2:] = times[[0, -1]]
    place = torch.from_numpy(noise.uniform(-1, 1, (1, count, 4))).float()
    return Observation(
        crops=torch.from_numpy(crops),
        there=torch.ones(count, VIEWS, dtype=torch.bool),
        slides=torch.zeros(count, SLIDE_STATISTICS),
        trajectory=place.repeat(FRAMES, 1, 1),
        sight=torch.ones(FRAMES, count, dtype=torch.bool),
        times=times,
        happens=happens,
        event_times=event_times,
        in_view=torch.ones(FRAMES, count, dtype=torch.double),
        moving=torch.zeros(FRAMES, count, dtype=torch.double),
    )


def questions(things: Sequence[Thing]) -> tuple[Example, ...]:
    """Numbers and existence of every value, and what the only object of a colour is."""
    found = []
    for place, (filtering, words) in enumerate(
        (("filter_color", PAINTS), ("filter_material", ("metal", "rubber")), ("filter_shape", ("cube", "sphere")))
    ):
        for word in words:
            fitting = [thing for thing in things if thing[place] == word]
            found.append((f"objects {word} {filtering} count", str(len(fitting))))
            found.append((f"objects {word} {filtering} exist", "yes" if fitting else "no"))
            if place == 0 and len(fitting) == 1:
                found.append((f"objects {word} filter_color unique query_material", fitting[0][1]))
                found.append((f"objects {word} filter_color unique query_shape", fitting[0][2]))
    return tuple(Example(str(number), check(text.split()), answer) for number, (text, answer) in enumerate(found))


def videos(count: int, seed: int = 0) -> list[tuple[list[Thing], Taught]]:
    """Videos of three different things each."""
    noise = np.random.default_rng(seed)
    kinds = [
        (color, material, shape) for color in PAINTS for material in ("metal", "rubber") for shape in ("cube", "sphere")
    ]
    made = []
    for _ in range(count):
        things = [kinds[place] for place in noise.choice(len(kinds), 3, replace=False)]
        made.append((things, Taught(observation(things, noise), questions(things))))
    return made
