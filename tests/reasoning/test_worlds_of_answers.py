"""What comes next and what if, against the same discs run again with the change."""

import inspect
from dataclasses import replace

import numpy as np
import pytest
from sliding_discs import Disc, KnownPosterior, changed, path, tracks_of
from test_seen import CHAIN

from vrdp_prob import inference
from vrdp_prob.errors import InputError
from vrdp_prob.inference import Status
from vrdp_prob.models.parameters import RESTITUTION
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import prior_restitutions
from vrdp_prob.reasoning import Change, PosteriorWorlds, ask, infer
from vrdp_prob.reasoning.changes import BUILT_IN
from vrdp_prob.scene import Shape, Tracks

DRAWS = 30


def worlds_of(discs: tuple[Disc, ...], frames: int = 128, **options: object) -> PosteriorWorlds:
    posterior = KnownPosterior(tracks_of(discs, frames), discs, **options)  # type: ignore[arg-type]
    return PosteriorWorlds(posterior, draws=DRAWS, own_courses=False)  # see test_own_course for draws that have one


def collisions(worlds: PosteriorWorlds, change: Change, place: int) -> dict[tuple[int, int], tuple[float, float]]:
    """Share of draws in which each pair collides, and the median time."""
    table = worlds.counterfactual_events(change, place)
    found = {}
    for number, pair in enumerate(table.universe.pairs):
        share = float(table.happens[:, number].mean())
        if share > 0:
            found[pair] = (share, float(np.nanmedian(table.time[:, number])))
    return found


@pytest.fixture(scope="module")
def chain() -> PosteriorWorlds:
    return worlds_of(CHAIN)


def test_a_removed_disc_stops_the_chain_and_nothing_else(chain: PosteriorWorlds) -> None:
    found = collisions(chain, Change.REMOVED, 0)
    assert set(found) == {(3, 4)}
    # what the change cannot reach keeps its observed course and its observed event, draw by draw
    place = chain.seen.universe.collision(3, 4)
    table = chain.counterfactual_events(Change.REMOVED, 0)
    assert np.array_equal(table.time[:, place], chain.events().time[:, place])
    course = chain.counterfactual(Change.REMOVED, 0)
    assert not course.collided.any()
    for body in (3, 4):
        seen, _ = chain.seen.drawn[body].state(course.times)
        assert np.array_equal(course.trajectory[:, :, body, :2], seen)


def test_a_disc_that_meets_nobody_changes_nothing() -> None:
    worlds = worlds_of((*CHAIN[:3], Disc((-1.0, 2.0), (0.5, 0.0))))
    for change in BUILT_IN:
        assert set(collisions(worlds, change, 3)) == {(0, 1), (1, 2)}
    assert worlds.relies_on_default((Change.HEAVIER, 3)) == ()


@pytest.mark.parametrize(("change", "factor"), [(Change.HEAVIER, 5.0), (Change.LIGHTER, 0.2)])
@pytest.mark.parametrize("place", [0, 1])
def test_heavier_and_lighter_follow_the_same_run_with_another_mass(
    chain: PosteriorWorlds, change: Change, factor: float, place: int
) -> None:
    _, truth = path(changed(CHAIN, place, mass=factor), 128)
    found = collisions(chain, change, place)
    for time, first, second in truth:
        share, when = found[first, second]
        assert share > 0.8
        assert when == pytest.approx(time, abs=0.1)
    sure = {pair for pair, (share, _) in found.items() if share > 0.5}
    assert sure == {(first, second) for _, first, second in truth}


def test_a_removed_disc_lets_another_pass_to_a_third() -> None:
    discs = (Disc((-1.5, 0.0), (2.2, 0.0)), Disc((0.0, 0.1)), Disc((1.2, 0.0)))
    worlds = worlds_of(discs)
    share, time = collisions(worlds, Change.REMOVED, 1)[0, 2]
    _, truth = path([discs[0], discs[2]], 128)
    assert share > 0.9
    assert time == pytest.approx(truth[0][0], abs=0.08)


def test_what_comes_next_is_simulated_from_the_last_frames() -> None:
    slow = Disc((-1.0, 1.5), (1.0, 0.0), friction=0.16)
    discs = (Disc((-1.5, 0.0), (1.8, 0.0)), Disc((1.0, 0.05)), slow, Disc((0.2, 1.5)))
    frames = 26
    worlds = worlds_of(discs, frames)
    _, truth = path(discs, frames + 58)
    assert [pair[1:] for pair in truth] == [(0, 1)]
    table = worlds.unseen_events()
    place = table.universe.collision(0, 1)
    assert table.happens[:, place].mean() > 0.9
    assert np.nanmedian(table.time[:, place]) == pytest.approx(truth[0][0], abs=0.06)
    # by the friction that all share disc 2 would reach disc 3; by its own it stops before
    assert table.happens[:, table.universe.collision(2, 3)].mean() < 0.2


def test_pairs_that_met_in_the_video_are_not_news() -> None:
    worlds = worlds_of((Disc((-0.6, 0.0), (1.0, 0.0)), Disc((0.0, 0.0))), 30)
    assert worlds.events().happens[:, 0].all()
    assert not worlds.unseen_events().happens[:, 0].any()


def test_answers_name_the_objects_of_default_mass() -> None:
    discs = (Disc((-1.5, 0.0), (1.8, 0.0)), Disc((1.0, 0.05)), Disc((0.0, 2.0)))
    worlds = worlds_of(discs, 26, statuses=(Status.DEFAULT, Status.IDENTIFIED, Status.DEFAULT))
    answer = ask(worlds, "What will happen next?", choices=["The red object collides with the blue object"])
    assert answer.choices[0].probability > 0.9
    assert answer.relies_on_default == ("0",)
    assert ask(worlds, "How many collisions happen?").relies_on_default == ()


def test_a_posterior_may_be_asked_directly() -> None:
    posterior = KnownPosterior(tracks_of(CHAIN), CHAIN)
    answer = ask(posterior, "How many collisions happen?", draws=20)
    assert (answer.answer, answer.probability) == (3, pytest.approx(1.0, abs=0.05))
    with pytest.raises(InputError, match="draws is 0; ask for at least 1"):
        ask(posterior, "How many collisions happen?", draws=0)


def test_an_answer_says_that_a_simulation_broke_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vrdp_prob.reasoning.stretch.EVENT_LIMIT", 0)
    discs = (Disc((-1.5, 0.0), (1.8, 0.0)), Disc((1.0, 0.05)))
    answer = ask(
        worlds_of(discs, 26), "What will happen next?", choices=["The red object collides with the blue object"]
    )
    assert any("broke off early" in note for note in answer.notes)


@pytest.mark.slow
def test_an_inferred_posterior_answers() -> None:
    discs = (Disc((-1.5, 0.0), (1.6, 0.0)), Disc((0.0, 0.05)), Disc((0.9, 0.15)))
    posterior = infer(tracks_of(discs, 60), sampler="laplace", draws=100)
    assert posterior.ask("How many collisions happen?").answer == 2
    answer = posterior.ask(
        "If the red object is removed, which event will not happen?",
        choices=["The blue object collides with the green object"],
    )
    assert answer.choices[0].probability > 0.9
    assert posterior.all_worlds is posterior.all_worlds


def test_defaults_drawn_from_the_prior_widen_what_is_simulated() -> None:
    discs = (Disc((-1.5, 0.0), (1.8, 0.0)), Disc((1.0, 0.05)))
    posterior = KnownPosterior(tracks_of(discs, 26), discs, statuses=(Status.DEFAULT, Status.IDENTIFIED))
    spread = {}
    for defaults in ("fixed", "prior"):
        worlds = PosteriorWorlds(posterior, draws=100, defaults=defaults)
        spread[defaults] = worlds.future.trajectory[:, -1, 1, 0].std()
    assert spread["prior"] > 1.2 * spread["fixed"]


def test_restitutions_from_the_prior_give_no_energy() -> None:
    count = 20_000
    plain = np.exp(RESTITUTION.prior.sample(np.random.default_rng(3), (count,)))
    assert (plain > 1).any()
    drawn = prior_restitutions(PhysicsModel.base(), (count,), np.random.default_rng(3))
    assert (drawn <= 1).all()
    assert drawn[plain <= 1] == pytest.approx(plain[plain <= 1])


def test_a_cube_that_no_change_reaches_turns_as_it_was_seen() -> None:
    discs = (*CHAIN[:2], Disc((-1.0, 2.0)))
    tracks = tracks_of(discs)
    bodies = (*tracks.bodies[:2], replace(tracks.bodies[2], shape=Shape.CUBE))
    angles = np.full(tracks.seen.shape, np.nan)
    angles[:, 2] = 0.7 * tracks.times
    turning = Tracks.from_arrays("turning", bodies, tracks.times, tracks.positions, angles=angles)
    world = PosteriorWorlds(KnownPosterior(turning, discs), draws=DRAWS, own_courses=False).counterfactual(
        Change.REMOVED, 0
    )
    turned = world.trajectory[:, :, 2, 2] - world.trajectory[:, :1, 2, 2]
    assert turned == pytest.approx(np.broadcast_to(0.7 * tracks.times, turned.shape), abs=1e-9)


def test_the_public_door_shows_the_parameters_of_the_inference() -> None:
    assert inspect.signature(infer).parameters == inspect.signature(inference.infer).parameters
    assert "checkpoint" in inspect.signature(infer).parameters
    assert inspect.getdoc(infer) == inspect.getdoc(inference.infer)
