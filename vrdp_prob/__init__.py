"""vrdp-prob: a differentiable rigid-body simulator as a likelihood, questions answered with probabilities.

>>> import vrdp_prob
>>> tracks = vrdp_prob.load("examples/demo/video_00000.mp4")
>>> posterior = vrdp_prob.infer(tracks, seed=0)
>>> posterior.ask("How many collisions happen?").probability
"""

from vrdp_prob.concepts.physical import Example, LearnedWord, learn_concept
from vrdp_prob.datasets import load, load_all
from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.finding import Finding
from vrdp_prob.errors import InputError
from vrdp_prob.inference import Posterior
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.reasoning import Answer, AskablePosterior, ask, infer
from vrdp_prob.report.pipeline import Report, report
from vrdp_prob.scene import Body, Camera, Event, Question, Tracks, Wall
from vrdp_prob.version import __version__

__all__ = [
    "Answer",
    "AskablePosterior",
    "Body",
    "Camera",
    "Event",
    "Example",
    "Finding",
    "InputError",
    "LearnedWord",
    "PhysicsModel",
    "Posterior",
    "Question",
    "Report",
    "Tracks",
    "Wall",
    "__version__",
    "ask",
    "discover",
    "infer",
    "learn_concept",
    "load",
    "load_all",
    "report",
]
