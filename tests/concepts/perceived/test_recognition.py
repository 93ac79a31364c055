"""From learned concepts to attributes of tracks, and to answers."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.reasoning.hand_made import BODIES
from vrdp_prob.concepts.perceived.concepts import Concepts, Lessons
from vrdp_prob.concepts.perceived.network import ConceptNetwork
from vrdp_prob.concepts.perceived.observation import Observation
from vrdp_prob.concepts.perceived.vocabulary import Vocabulary, attribute_words
from vrdp_prob.errors import InputError
from vrdp_prob.perception import Crops, SeenObjects
from vrdp_prob.reasoning.executor import answer_question
from vrdp_prob.reasoning.facts import TableFacts
from vrdp_prob.scene import Camera, Shape, Tracks

FRAMES = 40
WORDS = attribute_words()
CERTAIN = {
    "color": ["red", "blue", "green", "blue"],
    "material": ["metal", "rubber", "metal", "rubber"],
    "shape": ["cube", "sphere", "cylinder", "cube"],
}


def table(name: str, doubts: Mapping[int, Mapping[str, float]]) -> np.ndarray:
    """Probabilities of an attribute of four bodies: certain ones but for some doubts."""
    rows = np.array([[float(word == certain) for word in WORDS[name]] for certain in CERTAIN[name]])
    for body, shares in doubts.items():
        rows[body] = [shares.get(word, 0.0) for word in WORDS[name]]
    return rows


@pytest.fixture
def seen() -> SeenObjects:
    """Four bodies; body 0 crosses the floor and runs into body 3."""
    positions = np.zeros((FRAMES, 4, 2)) + np.array([[-2.0, 0], [-1, 1.5], [1.0, 1.5], [0.6, 0]])
    time = np.arange(FRAMES) / 25
    contact = 2.2 / 2.5
    positions[:, 0, 0] += 2.5 * np.minimum(time, contact)
    positions[:, 3, 0] += 2.0 * np.maximum(time - contact, 0)
    positions += np.random.default_rng(0).normal(0, 0.003, positions.shape)
    tracks = Tracks.from_arrays("v", BODIES, time, positions, camera=Camera.clevrer())
    crops = tuple(Crops(np.zeros((2, 32, 32, 3), np.uint8), np.full((2, 32, 32), 255, np.uint8)) for _ in BODIES)
    return SeenObjects(tracks, crops)


@pytest.fixture
def concepts(monkeypatch: pytest.MonkeyPatch) -> Concepts:
    """Concepts that doubt whether body 3 is rubber, and take body 2 for a cube."""
    torch.manual_seed(0)
    made = Concepts((ConceptNetwork(Vocabulary(WORDS)),) * 2, Lessons(1, 1, 0, 0.0, 1.0, 1.0))
    doubts = {
        "material": {3: {"metal": 0.4, "rubber": 0.6}},
        "shape": {2: {"cube": 0.99, "cylinder": 0.01}},
        "color": {},
    }
    attributes = {name: table(name, doubts[name]) for name in WORDS}
    monkeypatch.setattr(Concepts, "attributes", lambda _self, _observation: attributes)
    return made


def test_doubt_and_what_the_physics_does_not_share_are_kept_as_probabilities(
    seen: SeenObjects, concepts: Concepts
) -> None:
    bodies = concepts.recognise(seen).bodies
    assert [(body.color, body.material) for body in bodies] == list(
        zip(CERTAIN["color"], CERTAIN["material"], strict=True)
    )
    assert [dict(body.attribute_probabilities) for body in bodies[:2]] == [{}, {}]
    assert bodies[3].attribute_probabilities["material"] == {"metal": 0.4, "rubber": 0.6}
    assert bodies[2].shape is Shape.CYLINDER
    assert bodies[2].probabilities("shape")["cube"] == 0.99


def test_a_doubtful_metal_makes_the_metal_cube_ambiguous(seen: SeenObjects, concepts: Concepts) -> None:
    facts = concepts.facts(seen, draws=4000)
    count = answer_question(facts, ("objects", "metal", "filter_material", "count"))
    assert count.distribution["3"] == pytest.approx(0.4, abs=0.03)
    named = answer_question(
        facts, ("objects", "metal", "filter_material", "red", "filter_color", "unique", "query_shape")
    )
    assert named.probability == 1.0
    cube = answer_question(
        replace_shape(facts), ("objects", "metal", "filter_material", "cube", "filter_shape", "unique", "query_color")
    )
    assert cube.valid_share == pytest.approx(0.6, abs=0.03)
    assert any("material" in note and "uncertain" in note for note in cube.notes)


def test_a_word_that_was_never_learned_is_refused(seen: SeenObjects) -> None:
    torch.manual_seed(0)
    learned = Vocabulary({**WORDS, "color": ("red", "blue", "green")})
    facts = Concepts((ConceptNetwork(learned),) * 2, Lessons(1, 1, 0, 0.0, 1.0, 1.0)).facts(seen)
    with pytest.raises(InputError, match="tells which objects are cyan; the colors told are: red, blue, green"):
        answer_question(facts, ("objects", "cyan", "filter_color", "count"))
    several = answer_question(facts, ("objects", "red", "filter_color", "count"))
    assert sum(several.distribution.values()) == pytest.approx(1.0)
    assert {label.names[place] for label in facts.attribute("color") for place in label.index} <= set(
        learned.values["color"]
    )


def replace_shape(facts: TableFacts) -> TableFacts:
    """The same video with a body 2 that is no cube for sure."""
    bodies = tuple(replace(body, attribute_probabilities={}) if body.id == "2" else body for body in facts.bodies)
    return replace(facts, bodies=bodies)


def test_draws_of_learned_events_follow_their_probabilities(seen: SeenObjects, concepts: Concepts) -> None:
    facts = concepts.facts(seen, draws=4000, seed=1)
    with torch.no_grad():
        events = concepts.networks[0].events_of(Observation.of(seen))
    np.testing.assert_allclose(facts.events().happens.mean(axis=0), events.happens.numpy(), atol=0.03)
    assert np.isfinite(facts.events().time[facts.events().happens]).all()
    again = concepts.facts(seen, draws=4000, seed=1)
    np.testing.assert_array_equal(facts.events().happens, again.events().happens)
    assert facts.events().universe.bodies == ("0", "1", "2", "3")


def test_what_concepts_do_not_see_is_refused(seen: SeenObjects, concepts: Concepts) -> None:
    facts = concepts.facts(seen)
    with pytest.raises(InputError, match="not what happens after it; infer the video"):
        answer_question(facts, ("unseen_events", "count"))
    with pytest.raises(InputError, match="not what would happen if object 0 were removed; infer the video"):
        answer_question(facts, ("objects", "red", "filter_color", "unique", "get_counterfact", "count"))
