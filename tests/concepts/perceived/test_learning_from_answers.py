"""Concepts of painted patches, learned from counts and names alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from toys import PAINTS, videos

from vrdp_prob.concepts.perceived import learning, training
from vrdp_prob.concepts.perceived.concepts import Concepts, Lessons
from vrdp_prob.concepts.perceived.examples import Example, examples_of, words_of
from vrdp_prob.concepts.perceived.learning import learn
from vrdp_prob.concepts.perceived.lessons import LESSONS, Lesson, Taught
from vrdp_prob.concepts.perceived.network import ConceptNetwork
from vrdp_prob.concepts.perceived.standing import Standing
from vrdp_prob.concepts.perceived.storage import read_concepts, write_concepts
from vrdp_prob.concepts.perceived.training import train
from vrdp_prob.concepts.perceived.vocabulary import Vocabulary
from vrdp_prob.errors import InputError
from vrdp_prob.inference.runs.checkpoint import Checkpoint
from vrdp_prob.reasoning.program import check
from vrdp_prob.scene import Choice, Question

SHORT = tuple(replace(lesson, epochs=2) for lesson in LESSONS)
TAUGHT = [one for _, one in videos(12)]


def network(taught: list[Taught]) -> ConceptNetwork:
    torch.manual_seed(0)
    made = ConceptNetwork(Vocabulary.of(words_of(example for one in taught for example in one.examples)))
    made.measure([one.observation for one in taught])
    return made


def weights(trained: ConceptNetwork) -> np.ndarray:
    return np.concatenate([value.numpy().ravel() for value in trained.state_dict().values()])


def teach(lesson: Lesson, checkpoint: Path | None = None) -> tuple[ConceptNetwork, Standing]:
    pupil = network(TAUGHT)
    return pupil, train(pupil, lesson, TAUGHT[2:], TAUGHT[:2], seed=3, checkpoint=checkpoint)


def test_attributes_are_learned_from_answers() -> None:
    pupil, standing = teach(replace(LESSONS[0], epochs=12))
    assert standing.right > 0.97
    wrong = []
    for things, one in videos(8, seed=1):
        with torch.no_grad():
            (attributes,) = pupil.eval().attributes_of([one.observation])
        for place, name in enumerate(("color", "material", "shape")):
            words = pupil.vocabulary.values[name]
            seen = [words[best] for best in attributes[name].argmax(dim=1).tolist()]
            wrong += [(name, was, thing[place]) for was, thing in zip(seen, things, strict=True) if was != thing[place]]
    assert len(wrong) <= 2, wrong  # of 72


def test_before_any_lesson_nothing_is_known() -> None:
    pupil = network(TAUGHT)
    with torch.no_grad():
        (attributes,) = pupil.eval().attributes_of([TAUGHT[0].observation])
    assert attributes["color"].max() < 0.9


@pytest.mark.parametrize("lesson", SHORT, ids=lambda lesson: lesson.name)
def test_training_that_was_broken_off_ends_with_the_same_numbers(
    lesson: Lesson, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, standing = teach(lesson)
    judge = training.standing
    calls = []

    def interrupted(*arguments: object, **options: object) -> Standing:
        calls.append(1)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return judge(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(training, "standing", interrupted)
    with pytest.raises(KeyboardInterrupt):
        teach(lesson, tmp_path / "state.pt")
    monkeypatch.setattr(training, "standing", judge)
    resumed, again = teach(lesson, tmp_path / "state.pt")
    assert again == standing
    np.testing.assert_array_equal(weights(resumed), weights(whole))
    torch.save({"epoch": 3}, tmp_path / "damaged.pt")
    anew, _ = teach(lesson, tmp_path / "damaged.pt")
    np.testing.assert_array_equal(weights(anew), weights(whole))
    taken_up, _ = teach(lesson, tmp_path / "state.pt")
    np.testing.assert_array_equal(weights(taken_up), weights(whole))


def test_the_events_lesson_leaves_the_attributes_alone() -> None:
    pupil = network(TAUGHT)
    before = [value.clone() for value in pupil.appearance.parameters()]
    train(pupil, SHORT[1], TAUGHT[2:], TAUGHT[:2], seed=0)
    assert all(torch.equal(one, other) for one, other in zip(before, pupil.appearance.parameters(), strict=True))


@pytest.fixture(scope="module")
def concepts() -> Concepts:
    return Concepts((network(TAUGHT).eval(),), Lessons(12, 100, 0, 0.5, 0.9, 0.7))


@pytest.mark.parametrize("name", ["a.concepts", "CONCEPTS"])
def test_a_file_of_concepts_gives_them_back(concepts: Concepts, tmp_path: Path, name: str) -> None:
    write_concepts(tmp_path / name, concepts)
    read = read_concepts(tmp_path / name)
    assert read.lessons == concepts.lessons
    assert read.vocabulary == concepts.vocabulary
    one = TAUGHT[0].observation
    np.testing.assert_array_equal(read.attributes(one)["color"], concepts.attributes(one)["color"])


@pytest.mark.parametrize("content", [b"", b"no concepts" * 100, None])
def test_a_file_that_holds_no_concepts(concepts: Concepts, tmp_path: Path, content: bytes | None) -> None:
    file = tmp_path / "a.concepts"
    if content is None:
        write_concepts(file, concepts)
        content = file.read_bytes()[:-500]
    file.write_bytes(content)
    with pytest.raises(InputError, match="holds no learned concepts, or only part of them"):
        read_concepts(file)


def test_a_file_of_other_weights_or_of_another_version(concepts: Concepts, tmp_path: Path) -> None:
    file = tmp_path / "a.concepts"
    torch.save({"layer": torch.zeros(2)}, file)
    with pytest.raises(InputError, match="holds no learned concepts"):
        read_concepts(file)
    write_concepts(file, concepts)
    stored = torch.load(file, weights_only=True)
    torch.save({**stored, "version": 99}, file)
    with pytest.raises(InputError, match="format version 99, this program reads 1; learn them again"):
        read_concepts(file)
    for networks in ([{"layer": torch.zeros(2)}], [], [_without_a_number(stored["networks"][0])]):
        torch.save({**stored, "networks": networks}, file)
        with pytest.raises(InputError, match="holds no learned concepts"):
            read_concepts(file)
    with pytest.raises(InputError, match="no such file; learn concepts first"):
        read_concepts(tmp_path / "nowhere")


def _without_a_number(state: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    name = next(name for name, value in state.items() if value.is_floating_point())
    return {**state, name: torch.full_like(state[name], torch.nan)}


def test_of_few_videos_only_those_held_out_say_how_good_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(learning, "LESSONS", SHORT)
    told = iter([0.5, 0.5, 0.7, 0.7, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    monkeypatch.setattr(learning, "train", lambda *_, **__: Standing(1.0, next(told)))
    lessons = learn({str(place): one for place, one in enumerate(TAUGHT[:2])}).concepts.lessons
    assert (lessons.attributes_right, lessons.events_right) == (pytest.approx(0.6), pytest.approx(0.6))
    told = iter([1.0] * 10)
    alone = learn({"0": TAUGHT[0]})
    assert alone.concepts.lessons.attributes_right is None
    assert alone.lines[1].startswith("With a single video nothing is held out")


def test_what_was_learned_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(learning, "LESSONS", SHORT)
    monkeypatch.setattr(learning, "NETWORKS", 2)
    named = {str(place): one for place, one in enumerate(TAUGHT[:4])}
    kept = Checkpoint(tmp_path, {"seed": "1"})
    learned = learn(named, seed=1, checkpoint=kept)
    assert learned.concepts.vocabulary.values["color"] == ("gray", "red", "blue")
    examples = sum(len(one.examples) for one in TAUGHT[:4])
    assert (
        learned.lines[0]
        == f"Learned from 4 videos and {examples} answers: gray, red, blue, metal, rubber, sphere, cube."
    )
    assert "The words green, brown, cyan, purple, yellow, cylinder never occur in the questions" in learned.notes[0]
    again = learn(named, seed=1, checkpoint=kept)
    np.testing.assert_array_equal(weights(again.concepts.networks[1]), weights(learned.concepts.networks[1]))


@pytest.mark.skipif(not torch.cuda.is_available(), reason="torch finds no GPU")
def test_a_gpu_learns_where_it_is_asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(learning, "LESSONS", tuple(replace(lesson, epochs=12) for lesson in LESSONS))
    monkeypatch.setattr(learning, "NETWORKS", 2)
    named = {str(place): one for place, one in enumerate(TAUGHT)}
    kept = Checkpoint(tmp_path, {"seed": "1"})
    torch.cuda.reset_peak_memory_stats()
    torch.cuda.manual_seed(5)
    before = torch.cuda.get_rng_state()
    learned = learn(named, seed=1, device="cuda", checkpoint=kept)
    assert torch.cuda.max_memory_allocated() > 0
    assert torch.equal(torch.cuda.get_rng_state(), before)
    assert learned.concepts.lessons.attributes_right > 0.9
    again = learn(named, seed=1, device="cuda", checkpoint=kept)
    for one, other in zip(learned.concepts.networks, again.concepts.networks, strict=True):
        np.testing.assert_array_equal(weights(one), weights(other))  # weights on the processor: numpy refuses others


@pytest.mark.parametrize("device", ["abacus", "", "cuda:99", "meta", "hpu", "cpu:x"])
def test_a_device_that_is_not_here(device: str) -> None:
    with pytest.raises(InputError, match=f"device '{device}': torch finds none of this name here; give cpu, or cuda"):
        learn({"a": TAUGHT[0]}, device=device)


def test_answers_that_no_concept_explains_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(learning, "LESSONS", SHORT)
    monkeypatch.setattr(learning, "NETWORKS", 2)
    coin = np.random.default_rng(0)
    turned = {
        str(place): replace(
            one,
            examples=tuple(
                replace(example, answer=str(coin.choice(["yes", "no"])))
                for example in one.examples
                if example.answer in ("yes", "no")
            ),
        )
        for place, one in enumerate(TAUGHT)
    }
    assert any("contradict what the videos show" in note for note in learn(turned).notes)


def test_an_attribute_without_words() -> None:
    one = TAUGHT[0]
    few = replace(one, examples=(Example("0", check(["objects", "red", "filter_color", "count"]), "1"),))
    with pytest.raises(InputError, match="no question has a word for a material"):
        learn({"a": few})


def test_a_word_that_was_never_learned(concepts: Concepts) -> None:
    concepts.check_question(Question("How many red objects are there?", ("objects", "red", "filter_color", "count")))
    with pytest.raises(InputError, match="never learned the word 'cyan'"):
        concepts.check_question(Question("", ("objects", "cyan", "filter_color", "count")))
    assert set(PAINTS) & concepts.unlearned == set()


COUNT = ("events", "objects", "filter_collision", "count")


def test_answers_that_contradict_each_other() -> None:
    asked = [Question("How many?", COUNT, question_id=number, answer=str(number)) for number in (3, 4)]
    with pytest.raises(InputError, match="file, v: questions 3 and 4 ask the same but are answered '3' and '4'"):
        examples_of({"v": asked}, source="file")


def test_only_descriptive_and_explanatory_questions_with_answers_teach() -> None:
    future = ("unseen_events", "objects", "filter_collision", "count")
    choices = (Choice(0, "", ("objects", "red", "filter_color", "unique"), "wrong"),)
    cause = ["events", "events", "objects", "filter_collision", "unique", "filter_ancestor", "belong_to"]
    asked = [
        Question("", COUNT, question_id=0, answer="1"),
        Question("", COUNT, question_id=1),
        Question("", future, question_id=2, answer="1"),
        Question("", tuple(cause), choices, question_id=3),
    ]
    found = examples_of({"v": asked, "w": asked[1:3]}, source="file")
    assert [(example.question_id, example.answer) for example in found["v"]] == [("0", "1"), ("3", "no")]
    assert list(found) == ["v"]
    with pytest.raises(InputError, match="no descriptive or explanatory question has its right answer"):
        examples_of({"v": asked[1:3]}, source="file")
