"""The soft form against the exact one: equal on 0 and 1, and the expectation over worlds where it claims to be."""

from itertools import product

import numpy as np
import pytest
import torch

from tests.reasoning.hand_made import BODIES, FRAME_RATE, STORY, collision, entrance, exit_of, video
from vrdp_prob.concepts.perceived import soft_forms
from vrdp_prob.concepts.perceived.soft_execution import run_softly
from vrdp_prob.concepts.perceived.soft_facts import SoftEvents, SoftFacts, SoftMotion
from vrdp_prob.concepts.perceived.soft_forms import SOFT_FORMS, SoftRun
from vrdp_prob.concepts.perceived.soft_values import SoftCount, SoftLabel, SoftTruth, SoftValue
from vrdp_prob.datasets import read_questions
from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.facts import TableFacts
from vrdp_prob.reasoning.operations import REGISTRY
from vrdp_prob.reasoning.prepared import prepare
from vrdp_prob.reasoning.program import Program, check
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.values import Count, Label, Truth, Value
from vrdp_prob.scene import QuestionType

SIMULATED = {
    "unseen_events",
    "get_counterfact",
    "counterfact_heavier",
    "counterfact_lighter",
    "apply_heavier",
    "apply_lighter",
}
RED, SPHERE, CYLINDER = (
    f"objects {word} unique" for word in ("red filter_color", "sphere filter_shape", "cylinder filter_shape")
)
BLUE_CUBE = "objects blue filter_color cube filter_shape unique"
HIT = f"events {RED} filter_collision {BLUE_CUBE} filter_collision unique"
PROGRAMS = (
    "objects metal filter_material count",
    f"objects events {SPHERE} filter_in unique get_frame filter_moving count",
    f"objects events {CYLINDER} filter_in unique get_frame filter_stationary exist",
    "objects null filter_moving count",
    "objects null filter_stationary count",
    "objects start get_frame filter_moving exist negate",
    "objects end get_frame filter_stationary unique query_material",
    "objects events filter_start get_frame filter_stationary count",
    "objects events filter_end get_frame filter_moving unique query_color",
    "events objects filter_collision count",
    "events objects blue filter_color filter_collision count",
    "events objects cube filter_shape filter_collision objects blue filter_color filter_collision count",
    f"events {BLUE_CUBE} filter_collision objects metal filter_material filter_collision count",
    f"events objects rubber filter_material filter_collision {RED} filter_collision exist",
    "events objects filter_out unique get_object query_color",
    "events objects filter_in unique get_object query_color",
    "events objects filter_in first filter_order get_object query_shape",
    "events objects filter_in second filter_order get_object query_shape",
    "events objects filter_in third filter_order get_object query_shape",
    f"events {BLUE_CUBE} filter_collision last filter_order {BLUE_CUBE} get_col_partner query_shape",
    f"events {RED} filter_collision first filter_order {RED} get_col_partner query_color",
    f"events objects filter_collision {HIT} filter_before count",
    f"events objects filter_collision {HIT} filter_after exist",
    f"{HIT} events {HIT} filter_ancestor belong_to",
    f"events {SPHERE} filter_in unique events {HIT} filter_ancestor belong_to",
    f"{SPHERE} events {HIT} filter_ancestor belong_to",
    f"{CYLINDER} events {HIT} filter_ancestor belong_to negate",
    f"{RED} query_shape",
    "objects red filter_color unique query_material",
    f"all_events {RED} filter_collision {SPHERE} filter_collision unique events belong_to",
    f"all_events {RED} filter_collision {CYLINDER} filter_collision unique events belong_to",
    "objects green filter_color sphere filter_shape unique query_color",
    f"objects events {CYLINDER} filter_out unique get_frame filter_moving count",
)
STORIES = (
    STORY,
    (collision(30, "0", "1"), collision(30, "2", "3"), exit_of(30, "1")),
    (entrance(20, "2"), exit_of(90, "2"), collision(60, "0", "3"), collision(40, "0", "1"), collision(50, "1", "3")),
    (),
)


def number(value: Value | SoftValue, wanted: int = 0) -> float:
    """A result as a number: a count, the probability of yes, or that of a label."""
    if isinstance(value, Count | Truth):
        return float(value.value[0])
    if isinstance(value, Label):
        return float(value.index[0] == wanted)
    if isinstance(value, SoftCount):
        return value.mean.item()
    assert isinstance(value, SoftTruth | SoftLabel)
    return value.probability.item() if isinstance(value, SoftTruth) else value.probability[wanted].item()


def assert_same(program: Program, facts: TableFacts) -> bool:
    """Both forms answer the same, or both find that the question makes no sense; tells whether they answer."""
    soft = SoftRun(SoftFacts.of(facts))
    answered = run_softly(program, soft)
    try:
        exact = program.run(Run(facts))
    except InputError:
        assert soft.validity.item() == 0, program.tokens
        return False
    assert soft.validity.item() == 1, program.tokens
    wanted = int(exact.index[0]) if isinstance(exact, Label) else 0
    assert number(answered, wanted) == number(exact, wanted), program.tokens
    return True


@pytest.mark.parametrize("events", STORIES)
def test_soft_and_exact_forms_agree_on_what_is_certain(events: tuple) -> None:
    facts = video(events)
    answered = [assert_same(check(program.split()), facts) for program in PROGRAMS]
    assert any(answered)


def test_every_soft_form_is_used_here() -> None:
    used = {step.function for program in PROGRAMS for step in check(program.split()).steps if hasattr(step, "function")}
    assert set(SOFT_FORMS) <= used


def test_every_operation_without_a_simulated_world_has_a_soft_form() -> None:
    without = {step.token for several in REGISTRY.values() for step in several if step.function not in SOFT_FORMS}
    assert without == SIMULATED


@pytest.mark.slow
def test_the_questions_of_the_practice_set(shared_data: object) -> None:
    questions = read_questions(f"{shared_data}/clevrer_bullet/questions.json")
    kinds = (QuestionType.DESCRIPTIVE, QuestionType.EXPLANATORY)
    programs = set()
    for several in questions.values():
        for asked in (prepare(question, ()) for question in several if question.question_type in kinds):
            programs |= {program for _, program in asked.options} if asked.program is None else {asked.program}
    facts = video(STORY)
    assert sum(assert_same(program, facts) for program in programs) > 50


def test_a_simulated_world_has_no_soft_form() -> None:
    program = check(
        f"all_events {RED} filter_collision {SPHERE} filter_collision unique unseen_events belong_to".split()
    )
    with pytest.raises(InputError, match="'unseen_events' asks about a world that has to be simulated"):
        run_softly(program, SoftRun(SoftFacts.of(video(STORY))))


POSSIBLE = ((0, 0.7), (1, 0.4), (5, 0.8), (7, 0.3))
"""Events by place in the universe of four bodies (collisions 01, 02, 23; entrance of 1), and their probability."""


def uncertain() -> tuple[SoftFacts, TableFacts, np.ndarray]:
    """Independent events: as probabilities, and as all worlds with the probability of each."""
    certain = SoftFacts.of(video(()))
    happens = certain.events.happens.clone()
    time = certain.events.time.clone()
    for place, probability in POSSIBLE:
        happens[place], time[place] = probability, place / FRAME_RATE
    worlds = np.array(list(product((False, True), repeat=len(POSSIBLE))))
    probability = np.array([share for _, share in POSSIBLE])
    weight = np.where(worlds, probability, 1 - probability).prod(axis=1)
    universe = certain.events.universe
    table = EventTable.from_events(universe.bodies, [()] * len(worlds), start=0.0, end=127 / FRAME_RATE)
    for column, (place, _) in enumerate(POSSIBLE):
        table.happens[:, place] = worlds[:, column]
        table.time[worlds[:, column], place] = place / FRAME_RATE
    motion = video(*[()] * len(worlds)).motion()
    soft = SoftFacts(certain.attributes, certain.values, SoftEvents(universe, happens, time), SoftMotion.of(motion))
    return soft, TableFacts(BODIES, table, motion), weight


@pytest.mark.parametrize(
    "text",
    [
        "events objects filter_collision count",
        "events objects filter_collision exist",
        f"events {RED} filter_collision count",
        "events objects filter_collision first filter_order",
        "events objects filter_collision second filter_order",
        "events objects filter_collision third filter_order",
        "events objects filter_collision last filter_order",
        "events objects filter_collision unique",
    ],
)
def test_an_operation_on_independent_events_is_the_expectation_over_worlds(text: str) -> None:
    soft, exact, weight = uncertain()
    program = check(text.split(), ends_in=tuple(SOFT_TYPES))
    run, state = SoftRun(soft), Run(exact)
    given, known = run_softly(program, run), program.run(state)
    weight = weight * state.valid
    assert run.validity.item() == pytest.approx(weight.sum())
    weight /= weight.sum()
    if isinstance(known, Count | Truth):
        assert number(given) == pytest.approx(float(weight @ known.value))
    else:
        assert given.present.item() == pytest.approx(float(weight @ known.present))
        shares = np.bincount(known.index, weights=weight * known.present, minlength=len(given.probability))
        np.testing.assert_allclose(given.probability.numpy(), shares / shares.sum(), atol=1e-12)


def with_attributes(facts: SoftFacts, **shares: tuple[str, list[float]]) -> SoftFacts:
    """The same video, where the objects have one value of an attribute with these probabilities."""
    attributes = dict(facts.attributes)
    for name, (value, probabilities) in shares.items():
        table = torch.zeros_like(attributes[name])
        table[:, facts.values[name].index(value)] = torch.tensor(probabilities, dtype=table.dtype)
        attributes[name] = table
    return SoftFacts(attributes, facts.values, facts.events, facts.motion)


def test_collisions_of_some_doubtful_objects_with_others_are_the_expectation() -> None:
    blue, cube = [0.9, 0.3, 0.0, 0.5], [0.2, 1.0, 0.6, 0.7]
    facts = with_attributes(SoftFacts.of(video(STORY)), color=("blue", blue), shape=("cube", cube))
    text = "all_events objects blue filter_color filter_collision objects cube filter_shape filter_collision count"
    pairs = [(first, second) for second in range(4) for first in range(second)]
    expected = sum(1 - (1 - blue[i] * cube[j]) * (1 - blue[j] * cube[i]) for i, j in pairs)
    assert number(run_softly(check(text.split()), SoftRun(facts))) == pytest.approx(expected)


def test_collisions_of_one_doubtful_object_with_another_are_the_expectation() -> None:
    odds = {"color": ("blue", [0.9, 0.3, 0.2, 0.5]), "shape": ("cube", [0.2, 0.9, 0.6, 0.7])}
    facts = with_attributes(SoftFacts.of(video(STORY)), **odds)
    blue, cube = (np.array(shares) / (1 - np.array(shares)) for _, shares in odds.values())
    blue, cube = blue / blue.sum(), cube / cube.sum()  # the only one of its kind
    text = "all_events objects blue filter_color unique filter_collision objects cube filter_shape unique"
    run = SoftRun(facts)
    together = run_softly(check(f"{text} filter_collision exist".split()), run)
    different = 1 - blue @ cube
    pairs = [(first, second) for second in range(4) for first in range(second)]
    meeting = [(blue[i] * cube[j] + blue[j] * cube[i]) / different for i, j in pairs]
    assert number(together) == pytest.approx(1 - np.prod(1 - np.array(meeting)))
    assert run.makes_sense[-1].item() == pytest.approx(different)


def test_causes_are_the_expectation_over_worlds_where_one_way_leads_back() -> None:
    soft, exact, weight = uncertain()
    expected = np.einsum("w,wef->ef", weight, exact.events().ancestors())
    for later, earlier in ((1, 0), (5, 1), (7, 0)):
        assert soft.events.ancestors[later, earlier].item() == pytest.approx(expected[later, earlier]), (later, earlier)


def test_the_only_object_is_a_softmax_over_log_odds() -> None:
    facts = SoftFacts.of(video(STORY))
    odds = torch.tensor([0.5, -1.0, 2.0, 0.0], dtype=torch.double)
    red = facts.values["color"].index("red")
    table = torch.zeros_like(facts.attributes["color"])
    table[:, red] = torch.sigmoid(odds)
    changed = SoftFacts({**facts.attributes, "color": table}, facts.values, facts.events, facts.motion)
    program = check(f"{RED}".split(), ends_in=tuple(SOFT_TYPES))
    chosen = run_softly(program, SoftRun(changed))
    torch.testing.assert_close(chosen.probability, torch.softmax(odds, dim=0))


def test_an_answer_teaches_the_attributes_that_it_hangs_on() -> None:
    facts = SoftFacts.of(video(STORY))
    table = torch.full_like(facts.attributes["color"], 0.2).requires_grad_()
    changed = SoftFacts({**facts.attributes, "color": table}, facts.values, facts.events, facts.motion)
    run = SoftRun(changed)
    shape = run_softly(check(f"{RED} query_shape".split()), run)
    torch.autograd.backward(shape.probability[shape.names.index("cube")])
    red = facts.values["color"].index("red")
    slope = table.grad
    assert slope is not None
    assert (torch.sign(slope[:, red]) == torch.tensor([1.0, -1.0, -1.0, 1.0])).all()
    assert slope[:, [place for place in range(table.shape[1]) if place != red]].abs().max() == 0


SOFT_TYPES = dict.fromkeys(step.gives for several in REGISTRY.values() for step in several)


def test_helpers_of_probabilities() -> None:
    shares = torch.tensor([0.5, 0.25], dtype=torch.double)
    assert soft_forms.either(shares).item() == 0.625
    assert soft_forms.only(shares).tolist() == [0.375, 0.125]
    assert soft_forms.normalised(torch.zeros(2)).tolist() == [0.0, 0.0]
