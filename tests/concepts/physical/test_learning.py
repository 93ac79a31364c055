"""Words learned from videos whose discs were run again with the change, by an integrator of its own."""

from pathlib import Path

import numpy as np
import pytest

from tests.concepts.physical.word_videos import (
    Changed,
    bouncier,
    discs_of,
    example_of,
    examples_of,
    faster,
    heavier,
    slipperier,
    unchanged,
    write_videos,
)
from tests.reasoning.sliding_discs import Disc
from vrdp_prob import learn_concept
from vrdp_prob.concepts.physical import Example
from vrdp_prob.concepts.physical.from_files import learn_from_files
from vrdp_prob.errors import InputError

ROW = (Disc((-1.5, 0.0), (0.85, 0.0)), Disc((0.0, 0.05)), Disc((0.9, 0.15)), Disc((-1.0, 2.0)))
"""Disc 0 stops just before disc 1; faster it hits it, which hits 2."""


@pytest.mark.slow
def test_one_telling_question() -> None:
    learned = learn_concept("faster", [example_of("faster", faster, ROW[:3])], draws=10)
    before, after = 0.2, learned.probabilities
    # a disc that stops before another reaches it if it is faster or slides more easily, not if it is heavier
    assert after["nothing"] < before / 2
    assert after["speed"] > before < after["friction"]
    assert after["mass"] < before
    assert (learned.evidence.videos, learned.evidence.examples, learned.evidence.answers) == (1, 1, 3)


def test_examples_that_cannot_be_used() -> None:
    usable = example_of("faster", unchanged, ROW)
    for examples, message in (
        ([], "there is no example of the word 'faster'; give at least one question"),
        ([example_of("quicker", unchanged, ROW)], "is not understood at 'quicker'"),
        ([Example.of(usable.posterior, "How many collisions happen?", answer="1")], "does not use the word 'faster'"),
        ([Example.of(usable.posterior, "Would the red object hit the blue object if the red object were faster?")], ""),
        ([Example.of(usable.posterior, "What if the gray cube were faster?", choices={"": True})], "choice"),
    ):
        with pytest.raises(InputError, match=message or "has no right answer beside it"):
            learn_concept("faster", examples)
    with pytest.raises(InputError, match="draws is 5; a word is learned from at least 10"):
        learn_concept("faster", [usable], draws=5)
    missing = Example.of(
        usable.posterior,
        "What if the gray cube were faster?",
        choices={"The red object collides with the blue object": True},
    )
    with pytest.raises(InputError, match=r"discs, 'What if the gray cube were faster\?': there is no gray cube"):
        learn_concept("faster", [missing], draws=10)


@pytest.mark.parametrize("name", ["", "Faster", "two words", "5", "fast-er"])
def test_names_that_are_no_words(name: str) -> None:
    with pytest.raises(InputError, match="is not one word of the letters a to z"):
        learn_concept(name, [])


@pytest.mark.parametrize("name", ["red", "removed", "cube", "moving", "first", "times", "gone"])
def test_names_that_mean_something_else(name: str) -> None:
    with pytest.raises(InputError, match=f"the word '{name}' means something else in questions"):
        learn_concept(name, [])


def test_a_question_file_without_the_word_or_its_videos(tmp_path: Path) -> None:
    questions = write_videos(tmp_path, "faster", faster, [ROW])
    with pytest.raises(InputError, match=r"questions.json: no question uses the word 'slower'; check its spelling"):
        learn_from_files("slower", tmp_path, questions)
    with pytest.raises(InputError, match="no question about scenes 4 to 5 uses the word 'faster'"):
        learn_from_files("faster", tmp_path, questions, scenes=(4, 6))
    text = questions.read_text()
    questions.write_text(text.replace("video_00000", "video_00009"))
    with pytest.raises(InputError, match="none of the videos that the questions with 'faster' are about is"):
        learn_from_files("faster", tmp_path, questions)
    questions.write_text(text.replace('"correct"', "null").replace('"wrong"', "null"))
    with pytest.raises(InputError, match=r"video_00000, question 7: .* has no right answer beside it"):
        learn_from_files("faster", tmp_path, questions)


@pytest.mark.slow
def test_a_word_from_files_goes_on_where_it_was_broken_off(tmp_path: Path) -> None:
    several = [ROW, (Disc((-1.5, 0.0), (0.85, 0.0)), Disc((0.1, 0.05)), Disc((1.0, 0.1)))]
    questions = write_videos(tmp_path, "faster", faster, several)
    learned = learn_from_files("faster", tmp_path, questions, draws=20, checkpoint=tmp_path / "kept", processes=1)
    assert learned.evidence.videos == 2
    assert learned.probabilities["nothing"] < 0.1
    (tmp_path / "kept" / "video_00001" / "agreement.npz").unlink()
    again = learn_from_files("faster", tmp_path, questions, draws=20, checkpoint=tmp_path / "kept", processes=1)
    assert again == learned
    with pytest.raises(InputError, match="the checkpoint belongs to another run"):
        learn_from_files("faster", tmp_path, questions, draws=30, checkpoint=tmp_path / "kept")


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    ("name", "change", "subject", "least", "amounts"),
    [
        ("samer", unchanged, "nothing", 0.4, {}),
        ("heavier", heavier, "mass", 0.8, {"mass factor": 6.0}),
        # The draws tell it from a change of speed with a Monte Carlo error of 0.14.
        ("slipperier", slipperier, "friction", 0.5, {"friction factor": 1 / 8}),
        ("faster", faster, "speed", 0.95, {"speed factor": 1.7}),
    ],
)
def test_words_are_found(name: str, change: Changed, subject: str, least: float, amounts: dict[str, float]) -> None:
    learned = learn_concept(name, examples_of(name, change, 16), draws=30)
    assert learned.subject == subject
    assert learned.probabilities[subject] > least
    for belief in learned.beliefs:
        if belief.name in amounts:
            low, high = belief.quantile(0.005), belief.quantile(0.995)
            assert low < amounts[belief.name] < high


@pytest.mark.slow
def test_the_same_seed_gives_the_same_word() -> None:
    examples = examples_of("faster", faster, 2)
    learned = learn_concept("faster", examples, draws=20, seed=3)
    assert learn_concept("faster", examples, draws=20, seed=3) == learned
    assert learn_concept("faster", examples, draws=20, seed=4) != learned


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_what_collisions_hardly_tell_stays_open() -> None:
    """A bouncier first disc: its restitution decides few contacts, and the posterior says so."""
    learned = learn_concept("bouncier", examples_of("bouncier", bouncier, 12), draws=20)
    assert learned.probabilities["restitution"] > 0.05
    assert max(learned.probabilities.values()) < 0.99


def test_discs_of_examples_do_not_overlap() -> None:
    for seed in range(50):
        places = np.array([disc.position for disc in discs_of(np.random.default_rng(seed))])
        apart = np.linalg.norm(places[:, None] - places, axis=-1)[np.triu_indices(4, 1)]
        assert apart.min() > 0.4
