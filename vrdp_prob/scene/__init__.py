"""The nouns: bodies, walls, the camera, measured tracks, events and questions."""

from vrdp_prob.scene.body import Body, Shape, Wall
from vrdp_prob.scene.camera import Camera
from vrdp_prob.scene.event import Event, EventKind
from vrdp_prob.scene.question import Choice, Question, QuestionType
from vrdp_prob.scene.tracks import Tracks

__all__ = ["Body", "Camera", "Choice", "Event", "EventKind", "Question", "QuestionType", "Shape", "Tracks", "Wall"]
