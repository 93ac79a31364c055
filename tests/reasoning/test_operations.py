"""Every operation against events written by hand: several draws at once, each with its own answer."""

import numpy as np
import pytest
from hand_made import BODIES, STORY, collision, entrance, exit_of, motion_of, video

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.executor import answer_question
from vrdp_prob.reasoning.facts import TableFacts
from vrdp_prob.reasoning.operations import REGISTRY, Operation
from vrdp_prob.reasoning.program import ENTRIES, Program, check
from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.values import EventSet, ObjectSet, Value, Word
from vrdp_prob.scene import Body, Shape

RED_CUBE = "objects red filter_color cube filter_shape unique"
SPHERE = "objects sphere filter_shape unique"
CYLINDER = "objects cylinder filter_shape unique"
BLUE_CUBE = "objects blue filter_color cube filter_shape unique"


RAN: list[Operation | Word] = []
"""Steps of the programs that the tests of this file ran to their end."""


@pytest.fixture(autouse=True)
def _recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    run = Program.run

    def recording(program: Program, state: Run) -> Value:
        value = run(program, state)
        RAN.extend(program.steps)
        return value

    monkeypatch.setattr(Program, "run", recording)


def answer(facts: TableFacts, program: str) -> str | int:
    given = answer_question(facts, program.split())
    assert isinstance(given.answer, str | int)
    return given.answer


def distribution(facts: TableFacts, program: str) -> dict[str, float]:
    return dict(answer_question(facts, program.split()).distribution)


def chosen(facts: TableFacts, program: str) -> set[str]:
    """Ids of the objects, or the events, that a program of one draw picks."""
    run = Run(facts)
    value = check(program.split(), ends_in=(ObjectSet, EventSet)).run(run)
    assert isinstance(value, ObjectSet | EventSet)
    places = np.flatnonzero(value.mask[0])
    if isinstance(value, ObjectSet):
        return {facts.bodies[place].id for place in places}
    universe = facts.events().universe
    names = [*(f"{a}{b}" for a, b in universe.pairs), *(f"in{i}" for i in range(4)), *(f"out{i}" for i in range(4))]
    return {[*names, "start", "end"][place] for place in places}


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        ("objects", {"0", "1", "2", "3"}),
        ("objects blue filter_color", {"1", "3"}),
        ("objects metal filter_material", {"0", "2"}),
        ("objects cube filter_shape", {"0", "3"}),
        ("objects blue filter_color cube filter_shape", {"3"}),
        ("objects start get_frame filter_moving", set()),
        ("objects start get_frame filter_stationary", {"0", "2", "3"}),
        (f"objects events {CYLINDER} filter_in unique get_frame filter_moving", {"0", "3"}),
        ("objects end get_frame filter_moving", {"1"}),
        ("objects end query_frame filter_moving", {"1"}),
        ("objects end get_frame filter_stationary", {"0", "2"}),
        ("objects end get_frame filter_resting", {"0", "2"}),
        ("objects null filter_moving", {"0", "1", "3"}),
        ("objects null filter_stationary", {"2"}),
    ],
)
def test_filters_of_objects(program: str, expected: set[str]) -> None:
    assert chosen(video(STORY), program) == expected


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        ("events", {"in1", "01", "in2", "03", "23", "out3", "start", "end"}),
        ("all_events", {"01", "02", "03", "12", "13", "23"}),
        ("events objects filter_in", {"in1", "in2"}),
        ("events objects filter_out", {"out3"}),
        ("events objects filter_collision", {"01", "03", "23"}),
        (f"events {RED_CUBE} filter_collision", {"01", "03"}),
        (f"events {RED_CUBE} filter_collision {SPHERE} filter_collision", {"01"}),
        ("events objects cube filter_shape filter_collision", {"01", "03", "23"}),
        ("events objects cube filter_shape filter_collision objects cube filter_shape filter_collision", {"03"}),
        (f"events {RED_CUBE} filter_collision objects metal filter_material filter_collision", set()),
        (f"events {RED_CUBE} filter_collision objects blue filter_color filter_collision", {"01", "03"}),
        (f"events objects filter_collision {RED_CUBE} filter_collision {SPHERE} filter_collision", {"01"}),
        (f"events {RED_CUBE} filter_collision start filter_after {RED_CUBE[:-7]} filter_collision", set()),
        (f"all_events {BLUE_CUBE} filter_collision objects cube filter_shape filter_collision", {"03"}),
        (f"events events {CYLINDER} filter_in unique filter_before", {"start", "in1", "01"}),
        (f"events events {CYLINDER} filter_in unique filter_after", {"03", "23", "out3", "end"}),
        ("events start filter_before", set()),
        ("events events filter_end filter_after", set()),
        ("events events filter_start filter_after", {"in1", "01", "in2", "03", "23", "out3", "end"}),
        # the exit of 3 goes back by 3 to 23, 03, and by their partners to in2, 01 and in1
        (f"events events {BLUE_CUBE} filter_out unique filter_ancestor", {"23", "03", "in2", "01", "in1"}),
        (f"events events {RED_CUBE} filter_collision {SPHERE} filter_collision unique filter_ancestor", {"in1"}),
        (f"events events {SPHERE} filter_in unique filter_ancestor", set()),
    ],
)
def test_filters_of_events(program: str, expected: set[str]) -> None:
    assert chosen(video(STORY), program) == expected


@pytest.mark.parametrize(("order", "expected"), [("first", "sphere"), ("second", "cube"), ("last", "cube")])
def test_order(order: str, expected: str) -> None:
    facts = video(STORY)
    program = f"events {RED_CUBE} filter_collision {order} filter_order {RED_CUBE} get_col_partner query_shape"
    assert answer(facts, program) == expected


@pytest.mark.parametrize(
    ("question", "expected"),
    [
        ("How many cubes collide with the red cube?", 1),
        ("How many red cubes collide with the red cube?", 0),
        ("How many metal objects collide with the red cube?", 0),
        ("How many objects collide with the red cube?", 2),
        ("Do any metal cubes collide with the red cube?", "no"),
        ("What color is the first cube that collides with the red cube?", "blue"),
    ],
)
def test_a_named_object_is_not_what_it_collides_with(question: str, expected: str | int) -> None:
    assert answer_question(video(STORY), question).answer == expected


def test_an_object_that_collides_with_none_of_a_kind_has_no_first_one() -> None:
    with pytest.raises(InputError, match="no first collision of the sphere with the blue object in the video"):
        answer_question(video(STORY), "What shape is the first blue object that collides with the sphere?")


def test_an_object_does_not_collide_with_itself() -> None:
    facts = video(STORY)
    with pytest.raises(InputError, match=r"^the red cube is named twice, and an object cannot collide with itself; "):
        answer_question(facts, "Does the red cube collide with the red cube?")
    with pytest.raises(
        InputError, match=r"^the sphere and the rubber sphere are the same object, and an object cannot"
    ):
        answer_question(facts, "What happens next?", choices=["The sphere collides with the rubber sphere"])


def test_draws_in_which_two_names_are_of_one_object_are_left_out() -> None:
    unsure = {"color": {"red": 0.5, "brown": 0.5}}
    cube = Body("0", Shape.CUBE, 0.2, color="red", attribute_probabilities=unsure)
    other = Body("3", Shape.CYLINDER, 0.2, color="brown", attribute_probabilities=unsure)
    facts = video(*[STORY] * 200, bodies=(cube, BODIES[1], BODIES[2], other))
    given = answer_question(facts, "Does the cube collide with the red object?")
    assert given.distribution == {"yes": 1.0}
    assert "the cube and the red object are the same object" in given.notes[0]


def test_no_change_is_simulated_after_the_video() -> None:
    facts = video(STORY, future=[[collision(150, "1", "2")]])
    for what_if in ("get_counterfact", "counterfact_heavier", "apply_lighter get_counterfact"):
        with pytest.raises(
            InputError, match=r"after the video is not known with the red cube .* instead of unseen_events"
        ):
            answer(facts, f"unseen_events objects filter_collision {RED_CUBE} {what_if} count")


@pytest.mark.parametrize("second", ["apply_lighter get_counterfact", "counterfact_lighter"])
def test_an_object_is_changed_in_one_way(second: str) -> None:
    for events in ("", "all_events "):
        with pytest.raises(InputError, match="the red cube cannot be heavier and lighter in one question"):
            answer(video(STORY), f"{events}{RED_CUBE} apply_heavier {second} count")


def test_an_order_that_is_not_reached_is_refused() -> None:
    with pytest.raises(InputError, match="there is no third collision of the red cube in the video"):
        answer(
            video(STORY),
            f"events {RED_CUBE} filter_collision third filter_order {RED_CUBE} get_col_partner query_color",
        )


def test_queries() -> None:
    facts = video(STORY)
    assert answer(facts, "events objects filter_in first filter_order get_object query_color") == "blue"
    assert answer(facts, "events objects filter_in last filter_order query_object query_material") == "metal"
    assert answer(facts, "events objects filter_out unique get_object query_shape") == "cube"
    assert answer(facts, f"{SPHERE} query_color") == "blue"


def test_counts_and_existence_differ_between_draws() -> None:
    facts = video(STORY, STORY[:2], STORY[:2], STORY[:2])
    assert distribution(facts, "events objects filter_collision count") == {"1": 0.75, "3": 0.25}
    assert answer(facts, "events objects filter_collision count") == 1
    assert distribution(facts, "events objects filter_out exist") == {"no": 0.75, "yes": 0.25}
    assert answer(facts, "objects count") == len(BODIES)


def test_a_pair_collides_once_and_times_decide_the_order() -> None:
    facts = video((collision(90, "0", "1"), collision(30, "0", "1"), collision(60, "0", "2")))
    assert answer(facts, "events objects filter_collision count") == 2
    assert (
        answer(
            facts,
            f"events {RED_CUBE} filter_collision first filter_order {RED_CUBE} query_collision_partner query_shape",
        )
        == "sphere"
    )


def test_belonging_of_events_and_objects() -> None:
    facts = video(STORY)
    cause = f"events events {RED_CUBE} filter_collision {BLUE_CUBE} filter_collision unique filter_ancestor belong_to"
    assert answer(facts, f"events {SPHERE} filter_in unique {cause}") == "yes"
    assert answer(facts, f"events {CYLINDER} filter_in unique {cause}") == "no"
    assert answer(facts, f"{SPHERE} {cause}") == "yes"
    assert answer(facts, f"{CYLINDER} {cause} negate") == "yes"


def test_an_event_that_did_not_happen_is_no_cause() -> None:
    facts = video(STORY)
    never = f"events {SPHERE} filter_collision {CYLINDER} filter_collision unique"
    cause = f"events events {BLUE_CUBE} filter_out unique filter_ancestor belong_to"
    assert answer(facts, f"{never} {cause}") == "no"


def test_start_and_end_belong_to_nothing() -> None:
    assert answer(video(STORY), "start events belong_to") == "no"


def test_the_future_and_what_if() -> None:
    meets = f"all_events {SPHERE} filter_collision {CYLINDER} filter_collision unique"
    facts = video(
        *[STORY] * 4,
        future=[[collision(150, "1", "2")], [], [], [collision(140, "1", "2")]],
        changed={
            (Change.REMOVED, 0): [[collision(90, "1", "2")]] * 3 + [[]],
            (Change.HEAVIER, 0): [[]] * 4,
            (Change.LIGHTER, 0): [[collision(90, "1", "2")]] * 4,
        },
    )
    assert distribution(facts, f"{meets} unseen_events belong_to") == {"no": 0.5, "yes": 0.5}
    assert distribution(facts, f"{meets} all_events {RED_CUBE} get_counterfact belong_to") == {"yes": 0.75, "no": 0.25}
    for heavier in (
        "counterfact_heavier",
        "apply_heavier get_counterfact",
        "apply_heavier filter_counterfact",
    ):
        assert answer(facts, f"{meets} all_events {RED_CUBE} {heavier} belong_to") == "no"
        assert answer(facts, f"{meets} {RED_CUBE} {heavier} belong_to") == "no"
    for lighter in ("counterfact_lighter", "apply_lighter get_counterfact"):
        assert answer(facts, f"{meets} all_events {RED_CUBE} {lighter} belong_to negate") == "no"
        assert answer(facts, f"{meets} {RED_CUBE} {lighter} belong_to negate") == "no"


def test_each_draw_is_changed_by_its_own_object() -> None:
    first_partner = f"events {RED_CUBE} filter_collision first filter_order {RED_CUBE} get_col_partner"
    meets = f"all_events {CYLINDER} filter_collision {BLUE_CUBE} filter_collision unique"
    facts = video(
        [collision(30, "0", "1")],
        [collision(30, "0", "2")],
        changed={
            (Change.REMOVED, 1): [[collision(60, "2", "3")]] * 2,
            (Change.REMOVED, 2): [[], []],
        },
    )
    assert distribution(facts, f"{meets} all_events {first_partner} get_counterfact belong_to") == {
        "no": 0.5,
        "yes": 0.5,
    }


def test_uncertain_attributes_are_part_of_the_answer() -> None:
    unsure = Body(
        "0",
        Shape.CUBE,
        radius=0.2,
        material="metal",
        color="red",
        attribute_probabilities={"color": {"red": 0.7, "brown": 0.3}},
    )
    facts = video(*[[entrance(10, "0")]] * 4000, bodies=(unsure, *BODIES[1:]))
    shares = distribution(facts, "events objects filter_in unique get_object query_color")
    assert shares["red"] == pytest.approx(0.7, abs=0.03)
    assert shares["brown"] == pytest.approx(0.3, abs=0.03)
    # where it is brown, there is no red cube: those draws leave the question, and the answer says so
    given = answer_question(facts, f"{RED_CUBE} query_material".split())
    assert given.distribution == {"metal": 1.0}
    assert given.notes == (
        "The color of the metal cube is uncertain (70 % red). In 30 % of the draws there is no red cube; "
        "the answer is from the other 70 %.",
    )


def test_exit_is_seen_at_its_frame() -> None:
    facts = video(
        (exit_of(127, "3"),), motion=motion_of([[0, 0, 0, 1]] * 3, [[1, 1, 1, 1], [1, 1, 1, 1], [1, 1, 1, 0]])
    )
    assert answer(facts, f"objects events {BLUE_CUBE} filter_out unique get_frame filter_moving count") == 0


def test_choice_entries_end_in_one_thing() -> None:
    assert check(SPHERE.split(), ends_in=ENTRIES).gives in ENTRIES


def test_every_operation_was_run_here(request: pytest.FixtureRequest) -> None:
    collected = {item.function for item in request.session.items if isinstance(item, pytest.Function)}
    here = {value for name, value in globals().items() if name.startswith("test_")}
    if not here <= collected:
        pytest.skip("only some tests of this file run")
    left = [step for signatures in REGISTRY.values() for step in signatures if step not in RAN]
    assert not [(step.token, step.function.__name__) for step in left]
