"""First guesses of hidden walls and discs, from kicks."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from tests.discovery.stand_ins import start_with
from vrdp_prob.discovery.candidates import proposals
from vrdp_prob.discovery.candidates.kicked_at_contact import kicked_at_contact
from vrdp_prob.discovery.candidates.proposals import hidden_things
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.finding import UpperBound
from vrdp_prob.discovery.page.wording import cause_title
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.selection.refits import Refits
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.discovery.words import title
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.wall import SecondWall, ThirdWall, Wall
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.simulator.events import EventTable, RolloutEventKind

WAY, SEED = "hidden_obstacle", 1


@pytest.fixture(scope="module")
def kicked() -> Trial:
    _, fit = fitted(WAY, 20.0, seed=SEED)
    score = score_causes(fit, ResidualModel.of(fit), [ExternalImpulse()], seed=0)[0]
    assert score.sites
    found = Trial((), fit).with_cause(score)
    assert found is not None
    return found


@pytest.mark.slow
def test_a_disc_is_guessed_where_it_touches_the_hidden_one(kicked: Trial) -> None:
    data, _ = fitted(WAY, 20.0, seed=SEED)
    disc = data.truth.videos[0].hidden_discs[0]
    starts = [one.start for one in hidden_things(kicked.fit, [HiddenObstacle()])]
    assert starts
    # All guesses touch the body at one point; the true disc does so too, whatever its radius.
    reach = [
        abs(
            np.hypot(one["obstacle_x"] - disc.x, one["obstacle_y"] - disc.y) - abs(one["obstacle_radius"] - disc.radius)
        )
        for one in starts
    ]
    assert min(reach) < 0.05


def test_a_wall_is_guessed_square_to_the_kick(kicked: Trial) -> None:
    guesses = hidden_things(kicked.fit, [Wall()])
    assert guesses
    assert all(0 < one.start["hidden_wall_restitution"] < 1 for one in guesses)


def test_a_second_wall_is_guessed_with_numbers_of_its_own(kicked: Trial) -> None:
    first, second = (hidden_things(kicked.fit, [effect]) for effect in (Wall(), SecondWall()))
    assert [list(one.start.values()) for one in second] == [list(one.start.values()) for one in first]
    assert all(name.startswith("second_hidden_wall_") for one in second for name in one.start)


def test_a_second_wall_is_looked_for_beside_the_first_alone(kicked: Trial) -> None:
    catalogue = (Wall(), SecondWall(), ThirdWall(), SurfaceTilt())
    refits = Refits(catalogue, seed=0, needed=6.0, advance=lambda _count: None)
    assert [one.name for one in refits.leavings.further(kicked)] == ["wall", "surface_tilt"]
    model = kicked.fit.model
    for there, further in ((catalogue[:1], "second_wall"), (catalogue[:2], "third_wall")):
        extended = model
        for effect in there:
            extended = extended.with_effect(effect)
        trial = replace(kicked, fit=replace(kicked.fit, model=extended))
        assert [one.name for one in refits.leavings.further(trial)] == [further, "surface_tilt"]


def test_further_things_are_ways_of_their_cause_and_change_no_threshold() -> None:
    followers = [effect for effect in known_effects().values() if effect.follows is not None]
    further = [effect for effect in followers if effect.overrides("obstacles")]
    assert {effect.name for effect in further} == {
        "second_wall",
        "third_wall",
        "fourth_wall",
        "second_hidden_obstacle",
    }
    for effect in further:
        assert effect.way() == effect.name
        assert cause_title(UpperBound(effect.cause_name(), "any", None, "m", way=effect.way())) == title(effect.name)
        names = [parameter.name for parameter in effect.parameters]
        assert all(re.search(rf"\b{name}\b", effect.law) for name in names)
        assert len({*names, *(one.name for one in known_effects()[effect.cause_name()].parameters)}) == 2 * len(names)


@pytest.mark.parametrize(
    ("contact", "partners", "comes_with_it"),
    [(1.02, (0, 1), True), (1.02, (1, 2), False), (2.0, (0, 1), False)],
    ids=["its own contact", "a contact of others", "later"],
)
def test_which_kicks_come_with_a_contact(contact: float, partners: tuple[int, int], comes_with_it: bool) -> None:
    times = np.arange(0.0, 4.0, 0.04)
    assert kicked_at_contact(_kicked_at_one_second(contact, partners), times, [0]) is comes_with_it


def test_nothing_hidden_is_guessed_of_kicks_that_come_with_a_contact(
    kicked: Trial, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(proposals, "kicked_at_contact", lambda *_given: True)
    assert hidden_things(kicked.fit, [HiddenObstacle(), Wall()]) == []


def _kicked_at_one_second(contact: float, partners: tuple[int, int]) -> EventTable:
    """Body 0 is kicked after 1 s, and two bodies meet."""
    kinds = np.array([RolloutEventKind.KICK, RolloutEventKind.COLLISION])
    vectors, numbers = np.zeros((2, 2)), np.zeros(2)
    first, second = np.array([0, partners[0]]), np.array([-1, partners[1]])
    times = np.array([1.0, contact])
    return EventTable(np.zeros(2, dtype=int), times, kinds, first, second, vectors, vectors, numbers, numbers)


def test_nothing_is_guessed_of_other_causes(kicked: Trial) -> None:
    assert hidden_things(kicked.fit, [ExternalImpulse()]) == []


def test_a_disc_in_the_place_of_the_kick_explains_the_videos_as_well(kicked: Trial) -> None:
    starts = hidden_things(kicked.fit, [HiddenObstacle()])
    _, fit = fitted(WAY, 20.0, seed=SEED)
    least = fit.joint.log_density
    found = [
        one for start in starts if (one := kicked.with_cause_in_place(start, kicked.causes[-1], least)) is not None
    ]
    assert found
    best = max(found, key=lambda one: float(one.log_density.sum()))
    assert best.names == ("hidden_obstacle",)
    assert not any(name.startswith("impulse") for one in best.fit.structures for name, _ in one.held)
    assert best.log_density.sum() > kicked.log_density.sum() - 15
    assert best.turns(HiddenObstacle()) == kicked.turns(ExternalImpulse()) == 1


def test_a_disc_takes_the_place_of_kicks_beside_a_later_cause(kicked: Trial) -> None:
    both = kicked.with_cause(start_with(LinearDrag(), {"linear_drag": 0.01}))
    assert both is not None
    starts = hidden_things(both.fit, [HiddenObstacle()])
    least = both.fit.joint.log_density - 1000.0
    found = [one for start in starts if (one := both.with_cause_in_place(start, both.causes[0], least)) is not None]
    assert {one.names for one in found} == {("linear_drag", "hidden_obstacle")}
    assert all(not one.choices for one in found)
    again = found[0].start_with(found[0].causes[-1])
    assert again.start == {one.name: found[0].fit.value(one.name) for one in HiddenObstacle.parameters}
