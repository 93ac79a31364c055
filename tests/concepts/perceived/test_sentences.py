"""What the learning of concepts says it was learned from."""

from vrdp_prob.concepts.perceived.concepts import Concepts, Lessons
from vrdp_prob.concepts.perceived.learning import Learned
from vrdp_prob.concepts.perceived.network import ConceptNetwork
from vrdp_prob.concepts.perceived.vocabulary import Vocabulary

WORDS = {"color": ("red",), "material": ("metal", "rubber"), "shape": ("cube",)}


def test_one_video_and_one_answer_are_told_in_the_singular() -> None:
    network = ConceptNetwork(Vocabulary(WORDS))
    for counts, told in (((1, 1), "1 video and 1 answer"), ((2, 14), "2 videos and 14 answers")):
        learned = Learned(Concepts((network,), Lessons(*counts, 0, 0.5, None, None)), ())
        assert learned.lines[0] == f"Learned from {told}: red, metal, rubber, cube."
