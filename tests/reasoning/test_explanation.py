"""Why an answer is uncertain: the quantity it hangs on, where the doubt comes from, what would settle it."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest
from ambiguity import DISCS, FRAMES, MASS_SPREAD, OPEN, QUESTION, SURE, posterior
from hand_made import STORY, collision, video
from sliding_discs import FRICTION, Disc, KnownPosterior, path, tracks_of

from vrdp_prob.errors import InputError
from vrdp_prob.inference import Status
from vrdp_prob.reasoning import PosteriorWorlds, ask
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.chance import MostProbable, Purpose, Seeded
from vrdp_prob.reasoning.changes import Change, Meaning, PhysicalParameter, Rule, Shift
from vrdp_prob.reasoning.coupled import Coupled
from vrdp_prob.reasoning.entropy import entropy
from vrdp_prob.reasoning.explanation.explanation import Part
from vrdp_prob.reasoning.explanation.motions import FILMED_FRAMES
from vrdp_prob.reasoning.explanation.quantities import Kind
from vrdp_prob.reasoning.future import FUTURE_FRAMES
from vrdp_prob.scene import QuestionType

ACCURACY = 0.05
TRUTHS = 32


@dataclass(frozen=True)
class Word:
    """A learned word, made by hand."""

    change: Change


def asked(known: KnownPosterior | PosteriorWorlds, *choices: str) -> Answer:
    """An answer where all motion is known to follow the model, and is known from the tracks alone.

    Draws of the discs know their release exactly; on their own course they would not need the tracks.
    """
    worlds = known if isinstance(known, PosteriorWorlds) else PosteriorWorlds(known, deviating=None, own_courses=False)
    return ask(worlds, QUESTION, choices=choices or (OPEN,))


def explained(**options: object) -> Part:
    (part,) = asked(posterior(**options)).explain().parts
    return part


@pytest.fixture(scope="module")
def part() -> Part:
    return explained()


def entropy_of(known: KnownPosterior) -> float:
    probability = asked(PosteriorWorlds(known, draws=200, deviating=None, own_courses=False)).choices[0].probability
    return entropy(np.array([probability, 1 - probability]))


def reaches(ratio: float) -> bool:
    """Whether disc 1 hits disc 2 in time if disc 0 has `ratio` times its mass."""
    discs = [replace(DISCS[0], mass=ratio), *DISCS[1:]]
    return any({first, second} == {1, 2} for _, first, second in path(discs, FRAMES + FUTURE_FRAMES)[1])


def test_it_hangs_on_the_ratio_of_the_masses_and_turns_where_the_scene_turns(part: Part) -> None:
    low, high = 0.5, 2.0
    assert reaches(high)
    assert not reaches(low)
    for _ in range(12):
        middle = (low + high) / 2
        low, high = (low, middle) if reaches(middle) else (middle, high)
    hinge = part.hinges[0]
    assert hinge.kind == "parameter"
    assert hinge.name == "mass of the red cylinder relative to the blue cylinder"
    assert hinge.threshold == pytest.approx(high, rel=0.15)
    assert hinge.inside > 0.85
    assert hinge.outside < 0.15
    assert part.sentences[0].startswith(
        f"“{OPEN}” has probability {part.probability:.2f} and hangs on the mass of the red"
    )


def test_of_a_mass_that_only_ratios_determine_the_ratio_is_told() -> None:
    told = explained(statuses=(Status.RATIO_ONLY,) * 3)
    text = " ".join(told.sentences)
    assert "relative to the blue cylinder" in told.hinges[0].name
    assert "measuring the ratio of the masses of the red cylinder and the blue cylinder to 5 %" in {
        observation.words for observation in told.observations
    }
    assert "kg" not in text
    assert "eighing" not in text


def test_weighing_lowers_the_entropy_as_predicted(part: Part) -> None:
    """Each truth is weighed with an error; its posterior, in closed form, is asked again."""
    weighing = {observation.words: observation for observation in part.observations}
    predicted = weighing["weighing the red cylinder and the blue cylinder, each to 5 %"]
    assert predicted.before == pytest.approx(part.entropy, abs=0.01)
    random = np.random.default_rng(3)
    left = (MASS_SPREAD**-2 + ACCURACY**-2) ** -0.5
    found = []
    for seed in range(TRUTHS):
        truth = MASS_SPREAD * random.standard_normal(3)
        told = (truth + ACCURACY * random.standard_normal(3)) * (left / ACCURACY) ** 2
        weighed = tuple(replace(disc, mass=float(np.exp(mass))) for disc, mass in zip(DISCS, told, strict=True))
        known = replace(posterior(seed=100 + seed), discs=weighed, mass_spread=left)
        found.append(entropy_of(known))
    error = np.hypot(np.std(found) / np.sqrt(TRUTHS), predicted.error)
    assert np.mean(found) == pytest.approx(predicted.entropy, abs=3 * error)
    assert np.mean(found) < predicted.before - 0.3


@pytest.mark.slow
def test_filming_on_lowers_the_entropy_as_predicted(part: Part, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each truth is run by the integrator of the tests, filmed for longer, and asked about the same time."""
    predicted = part.observations[0]
    assert predicted.words == f"filming {FILMED_FRAMES} more frames"
    friction = PosteriorWorlds(posterior()).batches[0].common.friction
    assert friction is not None
    monkeypatch.setattr("vrdp_prob.reasoning.future.FUTURE_FRAMES", FUTURE_FRAMES - FILMED_FRAMES)
    random = np.random.default_rng(4)
    found = []
    for seed in range(TRUTHS):
        masses, ratios = MASS_SPREAD * random.standard_normal(3), friction.sd * random.standard_normal(3)
        truth = tuple(
            replace(disc, mass=float(np.exp(mass)), friction=float(FRICTION * np.exp(ratio)))
            for disc, mass, ratio in zip(DISCS, masses, ratios, strict=True)
        )
        filmed = tracks_of(truth, FRAMES + FILMED_FRAMES, seed=seed)
        found.append(entropy_of(replace(posterior(seed=seed), tracks=filmed)))
    error = np.hypot(np.std(found) / np.sqrt(TRUTHS), predicted.error)
    assert np.mean(found) == pytest.approx(predicted.entropy, abs=3 * error)
    assert np.mean(found) < predicted.before - 0.3


def test_doubt_of_parameters_and_of_motion_are_told_apart(part: Part) -> None:
    assert part.shares is not None
    assert part.shares.parameters > 0.8
    assert part.shares.chaos < 0.05
    sum_of_shares = sum(getattr(part.shares, name) for name in ("parameters", "events", "model", "motion", "chaos"))
    assert sum_of_shares == pytest.approx(1)


def test_the_share_of_the_parameters_is_that_of_a_nested_simulation() -> None:
    """Many twins of every draw instead of one: the intraclass correlation of their answers."""
    discs = (*DISCS[:2], Disc((3.4, 0.0)))
    known = replace(posterior(mass_spread=0.03), discs=discs, tracks=tracks_of(discs, FRAMES, noise=0.01))
    worlds = PosteriorWorlds(known, draws=200, deviating=None, own_courses=False)
    (told,) = asked(worlds).explain().parts
    assert told.shares is not None
    kept = {Purpose.FRICTION: 1.0, Purpose.LAST_FRICTION: 1.0}
    (batch,) = worlds.batches
    place = worlds.seen.universe.collision(1, 2)
    twins = [batch.coupled(Coupled(batch.chance, number, kept)) for number in range(5, 13)]
    table = np.stack([twin.future.events.happens[:, place] for twin in twins], axis=1).astype(float)
    within = table.var(axis=1, ddof=1).mean()
    between = table.mean(axis=1).var(ddof=1) - within / table.shape[1]
    assert 0.1 < told.shares.parameters < 0.9
    assert told.shares.parameters == pytest.approx(between / (between + within), abs=3 * told.shares.error)


def test_what_a_learned_word_means_is_what_an_answer_hangs_on() -> None:
    """Only if the mass of disc 0 grows enough does the disc that it hits reach the last one."""
    discs = (Disc((-1.5, 0.0), (1.6, 0.0)), Disc((0.0, 0.0), restitution=0.3), Disc((1.34, 0.0)))
    factors = np.geomspace(1 / 6, 6, 9)
    meanings = tuple(Meaning(0.08, Shift(PhysicalParameter.MASS, Rule.FACTOR, float(factor))) for factor in factors)
    floppier = Word(Change("floppier", (*meanings, Meaning(0.28, None))))
    worlds = PosteriorWorlds(KnownPosterior(tracks_of(discs, 128), discs), draws=200, deviating=None)
    question = "If the red object were floppier, what would happen?"
    (told,) = ask(worlds, question, choices=[OPEN], words=[floppier]).explain().parts
    best = told.hinges[0]
    assert (best.kind, best.name) == (Kind.MEANING, "factor of the mass that 'floppier' means")
    assert best.threshold is not None
    assert 1 <= best.threshold < 6
    assert best.inside > 0.9
    assert best.outside < 0.1
    assert told.shares is not None
    assert told.shares.parameters > 0.8
    assert "and from what 'floppier' means" in told.shares.sentence
    lighter = Word(Change("floppier", (*floppier.change.meanings[:2], Meaning(0.84, None))))
    assert not ask(worlds, question, choices=[OPEN], words=[lighter]).explain().parts


def test_where_all_that_matters_is_known_the_rest_is_motion_or_chaos() -> None:
    """A row of narrow hits multiplies what the tracks leave open, until nothing measurable decides."""
    discs = (
        Disc((-1.7, 0.0), (3.0, 0.0)),
        Disc((-0.024, 0.281)),
        Disc((0.632, -0.297)),
        Disc((0.802, 0.631)),
        Disc((1.418, 0.124)),
    )
    known = KnownPosterior(tracks_of(discs, 11, noise=0.003), discs, spread=0.0)
    choice = "The yellow object collides with the purple object"
    (told,) = (
        ask(PosteriorWorlds(known, draws=300, deviating=None, own_courses=False), QUESTION, choices=[choice])
        .explain()
        .parts
    )
    assert told.shares is not None
    assert told.shares.parameters < 0.4
    assert told.shares.motion > 0.5
    assert told.shares.chaos > told.shares.error / 2
    assert "would remain even then (chaos)" in told.shares.sentence


def test_a_doubtful_contact_is_what_an_answer_about_the_video_hangs_on() -> None:
    tracks = tracks_of([Disc((-1.5, 0.0), (1.5, 0.0)), Disc((0.0, 0.4))], noise=0.02)
    (told,) = ask(KnownPosterior(tracks, DISCS[:2]), "How many collisions happen?").explain().parts
    assert told.hinges[0].name == "whether the red cylinder touches the blue cylinder in the video"
    assert told.observations[0].words == "seeing whether the red cylinder touches the blue cylinder in the video"
    assert told.observations[0].entropy < 0.05
    assert told.shares is not None
    assert told.shares.events > 0.9


def test_a_certain_answer_says_so_in_one_sentence() -> None:
    explanation = asked(posterior(), SURE).explain()
    assert explanation.parts == ()
    assert str(explanation) == "The answer is certain, as far as the draws tell: its entropy is 0.00 nats."
    both = asked(posterior(), SURE, OPEN).explain()
    assert [one.choice_id for one in both.parts] == [1]


def test_a_single_best_fit_has_no_doubt_to_explain() -> None:
    best = PosteriorWorlds(posterior(total=1), draws=1, chance=MostProbable())
    assert not asked(best).explain().parts


@pytest.mark.parametrize("draws", [2, 7, 30])
def test_few_draws_tell_little_and_break_nothing(draws: int) -> None:
    answer = asked(PosteriorWorlds(posterior(), draws=draws))
    for told in answer.explain().parts:
        assert told.shares is None or draws >= 20
        assert all(0 <= hinge.inside <= 1 and 0 <= hinge.outside <= 1 for hinge in told.hinges)
        assert "nan" not in " ".join(told.sentences)


def test_hand_written_events_are_explained_without_shares() -> None:
    random = np.random.default_rng(0)
    first = random.random(300) < 0.5
    second = random.random(300) < np.where(first, 0.9, 0.1)
    worlds = [
        [*([collision(150, "1", "2")] if one else []), *([collision(160, "2", "3")] if other else [])]
        for one, other in zip(first, second, strict=True)
    ]
    facts = video(*[STORY] * 300, future=worlds)
    (told,) = ask(facts, QUESTION, choices=["The cylinder collides with the blue cube"]).explain().parts
    assert told.shares is None
    hinge = told.hinges[0]
    assert hinge.name == "whether the blue sphere touches the green cylinder after the video"
    assert (hinge.inside, hinge.outside) == (pytest.approx(0.9, abs=0.1), pytest.approx(0.1, abs=0.1))
    assert told.observations == ()


def test_the_same_question_is_explained_the_same_way(part: Part) -> None:
    again = explained()
    assert again == part
    document = asked(posterior()).explain().to_document()
    assert json.loads(json.dumps(document, allow_nan=False))["parts"][0]["hinges"][0]["kind"] == "parameter"


def test_an_answer_made_by_hand_cannot_be_explained() -> None:
    answer = Answer(None, "?", QuestionType.DESCRIPTIVE, "yes", 1.0, 0.0, 0.0, {"yes": 1.0})
    with pytest.raises(InputError, match="explain one that `ask` gave"):
        answer.explain()


def test_twins_keep_what_they_are_told_to() -> None:
    base = Seeded(3)
    twin = Coupled(base, 0, {Purpose.MOTION: 1.0, Purpose.LAST_FLIGHT: 0.9})
    size = (20_000,)

    def both(purpose: Purpose) -> np.ndarray:
        return np.corrcoef(base.numbers(purpose).standard_normal(size), twin.numbers(purpose).standard_normal(size))

    assert both(Purpose.MOTION)[0, 1] == pytest.approx(1)
    assert both(Purpose.LAST_FLIGHT)[0, 1] == pytest.approx(0.9, abs=0.01)
    assert both(Purpose.CONTACT_TIMES)[0, 1] == pytest.approx(0, abs=0.03)
    assert twin.numbers(Purpose.LAST_FLIGHT).standard_normal(size).std() == pytest.approx(1, abs=0.02)
    with pytest.raises(TypeError):
        twin.numbers(Purpose.LAST_FLIGHT).random(size)
