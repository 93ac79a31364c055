"""Arguments of another kind than the public functions take: one sentence, never a traceback."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.reasoning.hand_made import STORY, video
from vrdp_prob import AskablePosterior, InputError
from vrdp_prob.reasoning import ask

ROOT = Path(__file__).parents[2]
A_PROGRAM = "; give a text in English, or a program: a list of tokens, each a text."
OF_TRACKS = "; give the tracks of one video, which vrdp_prob.load reads."
OF_SEVERAL = "; give those of several videos, which vrdp_prob.load_all reads."
OF_ARRAYS = "with these times and objects it must be"
BY_EXAMPLE = "; make each by Example.of."
EXPECTED = {
    "question of numbers": f"the question is [5, 5]{A_PROGRAM}",
    "no question": f"the question is None{A_PROGRAM}",
    "nested program": f"the question is [['objects'], 'count']{A_PROGRAM}",
    "text of a question": "the text of a question is None; give a text.",
    "text of a choice": "the text of a choice is 5; give a text.",
    "choices as a text": "choices is 'The red cube collides with the sphere'; give a list, even of one choice.",
    "no choices": "choices is None; give a list, even of one choice.",
    "choice of a number": f"the choice is 5{A_PROGRAM}",
    "a single word": "words is the word 'floppier'; give a list of learned words, even of one.",
    "words as a text": "words is 'floppier.json'; give a list of learned words, even of one.",
    "file of a word": "among the words is 'floppier.json'; open the file of a word with LearnedWord.read.",
    "asking tracks": "a Tracks cannot be asked; give a posterior, which vrdp_prob.infer makes of tracks.",
    "inferring a path": f"tracks is 'examples/demo'{OF_TRACKS}",
    "inferring a list": f"tracks is a list{OF_TRACKS}",
    "draws of nan": "draws is nan; give a whole number of at least 4.",
    "seed as a text": "seed is '0'; give a whole number of at least 0.",
    "model as a text": "model is 'base'; give a PhysicsModel, which PhysicsModel.read reads from a file.",
    "plan as a text": "plan is 'lbfgs'; give a FitPlan of vrdp_prob.inference.",
    "one video together": f"videos are no list of tracks{OF_SEVERAL}",
    "model of several as a text": "model is 'base'; give a PhysicsModel, which PhysicsModel.read reads from a file.",
    "plan of several as a text": "plan is 'lbfgs'; give a FitPlan of vrdp_prob.inference.",
    "model to discover as a text": "model is 'base'; give a PhysicsModel, which PhysicsModel.read reads from a file.",
    "a folder together": f"videos are no list of tracks{OF_SEVERAL}",
    "unknown shape": "object a: shape 'pyramid' is not known; use sphere, cube or cylinder.",
    "shape as a text": "accepted: Body(id='a', shape=<Shape.CUBE: 'cube'>, radius=None, mass=None, inertia=None, "
    "material=None, color=None, attribute_probabilities={})",
    "one coordinate": f"v: positions have the shape (4, 2, 1); {OF_ARRAYS} (4, 2, 2): (time, body, 2).",
    "three coordinates": f"v: positions have the shape (4, 2, 3); {OF_ARRAYS} (4, 2, 2): (time, body, 2).",
    "axes the other way round": f"v: positions have the shape (2, 4, 2); {OF_ARRAYS} (4, 2, 2): (time, body, 2).",
    "positions as a text": (
        "v: positions are not an array of numbers (could not convert string to float: 'here'); give one."
    ),
    "too few times": f"v: positions have the shape (4, 2, 2); {OF_ARRAYS} (3, 2, 2): (time, body, 2).",
    "times of objects": f"v: times have the shape (4, 2, 2); {OF_ARRAYS} (4,): (time).",
    "angles of one object": f"v: angles have the shape (4,); {OF_ARRAYS} (4, 2): (time, body).",
    "covariance of an axis": (
        f"v: position_covariance have the shape (4, 2, 2); {OF_ARRAYS} (4, 2, 2, 2): (time, body, 2, 2)."
    ),
    "lists as arrays": "accepted: (4, 2, 2)",
    "reporting a path": "a str cannot be reported; give tracks, which vrdp_prob.load reads.",
    "a single question": "questions is a single question; give a list, even of one.",
    "a single example": "examples is a single example of the word 'zippier'; give a list, even of one.",
    "no examples": f"examples of the word 'zippier' are no list of vrdp_prob.Example{BY_EXAMPLE}",
    "texts as examples": f"examples of the word 'zippier' are no list of vrdp_prob.Example{BY_EXAMPLE}",
    "example about tracks": (
        "example 1 of the word 'zippier' is not a posterior with a question; make it by Example.of."
    ),
    "no name": "the word 'None' is not one word of the letters a to z; choose another, such as 'floppier'.",
}


def test_arguments_of_a_wrong_kind_are_refused_in_a_sentence(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.reasoning.wrong_arguments", str(tmp_path)]
    ran = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True)
    assert json.loads(ran.stdout) == EXPECTED


def test_a_choice_that_is_not_understood_is_called_one() -> None:
    with pytest.raises(InputError, match=r"^choice 'bananas' is not understood at 'bananas' \(word 1\)"):
        ask(video(STORY), "What will happen next?", choices=["bananas"])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, r"nope.nc: the posterior cannot be read \(no such file\); check the path"),
        (b"", "nope.nc: not a posterior of this tool, or not a whole one"),
        (b"video,object,time,x,y\n", "nope.nc: not a posterior of this tool, or not a whole one"),
        (b"\x89HDF\r\n\x1a\n" + bytes(100), "nope.nc: not a posterior of this tool, or not a whole one"),
    ],
)
def test_files_that_are_no_posteriors(tmp_path: Path, content: bytes | None, message: str) -> None:
    path = tmp_path / "nope.nc"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        AskablePosterior.read(path)
    with pytest.raises(InputError, match=r"cannot be read \(a folder has its name\)"):
        AskablePosterior.read(tmp_path)
