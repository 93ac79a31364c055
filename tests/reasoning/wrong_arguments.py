"""Calls with arguments of a wrong kind; prints, by name, what each is refused with.

It runs in a process of its own: in the others the type checker of the tests would refuse first.
"""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import vrdp_prob
from tests.concepts.physical.words import UNSURE
from tests.reasoning.hand_made import STORY, video
from tests.reasoning.sliding_discs import Disc, KnownPosterior, tracks_of
from vrdp_prob.discovery.discover import discover
from vrdp_prob.inference import infer_together
from vrdp_prob.reasoning import ask
from vrdp_prob.scene import Body, Choice, Question, Shape, Tracks

FACTS: Any = video(STORY)
DISCS = (Disc((0.0, 0.0), (1.0, 0.0)),)
POSTERIOR: Any = KnownPosterior(tracks_of(DISCS, 5), DISCS)
TRACKS: Any = POSTERIOR.tracks
NEXT = "What will happen next?"
CHOICES = ["The red cube collides with the sphere"]
EXAMPLE: Any = vrdp_prob.Example.of(POSTERIOR, "What if the disc were zippier?")
PLAIN: Any = vrdp_prob.Example(TRACKS, Question("Why?"))
NOTHING: Any = None
FIVE: Any = 5
PLACES = np.stack([np.zeros((4, 2)), np.ones((4, 2))], axis=1)


def tracks(**arrays: Any) -> Tracks:
    """Two spheres that stay, with some arrays in the place of the right ones."""
    bodies = (Body("a", Shape.SPHERE, 0.1), Body("b", Shape.SPHERE, 0.1))
    return Tracks.from_arrays(
        **{"video": "v", "bodies": bodies, "times": np.arange(4.0), "positions": PLACES, **arrays}
    )


CALLS: dict[str, Callable[[Path], Any]] = {
    "question of numbers": lambda _: ask(FACTS, [FIVE, FIVE]),
    "no question": lambda _: ask(FACTS, NOTHING),
    "nested program": lambda _: ask(FACTS, [["objects"], "count"]),  # type: ignore[list-item]
    "text of a question": lambda _: Question(NOTHING),
    "text of a choice": lambda _: Choice(0, FIVE),
    "choices as a text": lambda _: ask(FACTS, NEXT, choices=CHOICES[0]),
    "no choices": lambda _: ask(FACTS, NEXT, choices=NOTHING),
    "choice of a number": lambda _: ask(FACTS, NEXT, choices=[FIVE]),
    "a single word": lambda _: ask(FACTS, NEXT, choices=CHOICES, words=UNSURE),
    "words as a text": lambda _: ask(FACTS, NEXT, choices=CHOICES, words="floppier.json"),  # type: ignore[arg-type]
    "file of a word": lambda _: ask(FACTS, NEXT, choices=CHOICES, words=["floppier.json"]),  # type: ignore[list-item]
    "asking tracks": lambda _: ask(TRACKS, NEXT, choices=CHOICES),
    "inferring a path": lambda _: vrdp_prob.infer("examples/demo"),  # type: ignore[arg-type]
    "inferring a list": lambda _: vrdp_prob.infer([TRACKS]),  # type: ignore[arg-type]
    "draws of nan": lambda _: vrdp_prob.infer(TRACKS, draws=float("nan")),  # type: ignore[arg-type]
    "seed as a text": lambda _: vrdp_prob.infer(TRACKS, seed="0"),  # type: ignore[arg-type]
    "model as a text": lambda _: vrdp_prob.infer(TRACKS, model="base"),  # type: ignore[arg-type]
    "plan as a text": lambda _: vrdp_prob.infer(TRACKS, plan="lbfgs"),  # type: ignore[arg-type]
    "one video together": lambda _: infer_together(TRACKS),
    "model of several as a text": lambda _: infer_together([TRACKS], model="base"),  # type: ignore[arg-type]
    "plan of several as a text": lambda _: infer_together([TRACKS], plan="lbfgs"),  # type: ignore[arg-type]
    "model to discover as a text": lambda _: discover(3 * [TRACKS], model="base"),  # type: ignore[arg-type]
    "a folder together": lambda _: infer_together("folder"),  # type: ignore[arg-type]
    "unknown shape": lambda _: Body("a", "pyramid"),  # type: ignore[arg-type]
    "shape as a text": lambda _: Body("a", "cube"),  # type: ignore[arg-type]
    "one coordinate": lambda _: tracks(positions=PLACES[:, :, :1]),
    "three coordinates": lambda _: tracks(positions=np.zeros((4, 2, 3))),
    "axes the other way round": lambda _: tracks(positions=np.swapaxes(PLACES, 0, 1)),
    "positions as a text": lambda _: tracks(positions="here"),
    "too few times": lambda _: tracks(times=np.arange(3.0)),
    "times of objects": lambda _: tracks(times=PLACES),
    "angles of one object": lambda _: tracks(angles=np.arange(4.0)),
    "covariance of an axis": lambda _: tracks(position_covariance=PLACES),
    "lists as arrays": lambda _: tracks(positions=PLACES.tolist(), times=[0, 1, 2, 3]).positions.shape,
    "reporting a path": lambda folder: vrdp_prob.report("examples/demo", directory=folder),  # type: ignore[arg-type]
    "a single question": lambda folder: vrdp_prob.report(TRACKS, questions=NEXT, directory=folder),
    "a single example": lambda _: vrdp_prob.learn_concept("zippier", EXAMPLE),
    "no examples": lambda _: vrdp_prob.learn_concept("zippier", NOTHING),
    "texts as examples": lambda _: vrdp_prob.learn_concept("zippier", ["Why?"]),  # type: ignore[list-item]
    "example about tracks": lambda _: vrdp_prob.learn_concept("zippier", [PLAIN]),
    "no name": lambda _: vrdp_prob.learn_concept(NOTHING, [EXAMPLE]),
}


def refusal(call: Callable[[Path], Any], folder: Path) -> str:
    """What a call is refused with; anything but a refusal by its kind."""
    try:
        return f"accepted: {call(folder)}"
    except vrdp_prob.InputError as error:
        return str(error)
    except (AttributeError, TypeError) as error:
        return f"{type(error).__name__}: {error}"


if __name__ == "__main__":
    print(json.dumps({name: refusal(call, Path(sys.argv[1])) for name, call in CALLS.items()}))
