"""Every parameter that an intervention can change, against the same discs run again with the change."""

from dataclasses import replace

import numpy as np
import pytest
from sliding_discs import Disc, KnownPosterior, path, tracks_of

from vrdp_prob.reasoning import Change, PosteriorWorlds
from vrdp_prob.reasoning.changes import Meaning, PhysicalParameter, Rule, Shift
from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.intervention import Intervention

MASS, RESTITUTION, FRICTION, SPEED = PhysicalParameter
DRAWS = 30

DEAD = Disc((0.6, 0.0), restitution=0.3)
ROW = (Disc((-1.5, 0.0), (1.6, 0.0)), replace(DEAD, position=(0.0, 0.0)), Disc((1.34, 0.0)))
"""Disc 0 hits the dull disc 1, which comes near disc 2 but stops before."""


def worlds_of(discs: tuple[Disc, ...], frames: int = 128) -> PosteriorWorlds:
    """Worlds that keep what was seen wherever a change does not reach."""
    return PosteriorWorlds(KnownPosterior(tracks_of(discs, frames), discs), draws=DRAWS, own_courses=False)


def changed(disc: Disc, shift: Shift) -> Disc:
    """What a shift makes of a disc, by hand."""
    if shift.parameter is SPEED:
        speed = np.hypot(*disc.velocity)
        after = speed * shift.amount if shift.rule is Rule.FACTOR else speed + shift.amount
        return replace(disc, velocity=tuple(component * after / speed for component in disc.velocity))
    value = getattr(disc, shift.parameter.value)
    after = value * shift.amount if shift.rule is Rule.FACTOR else value + shift.amount
    return replace(disc, **{shift.parameter.value: after})


def same_collisions(table: EventTable, other: EventTable) -> bool:
    """Whether the same pairs collide at the same times in every draw."""
    of_pairs = table.universe.collisions
    return np.array_equal(table.time[:, of_pairs], other.time[:, of_pairs], equal_nan=True)


@pytest.mark.parametrize(
    ("place", "shift"),
    [
        (0, Shift(MASS, Rule.FACTOR, 6.0)),
        (1, Shift(RESTITUTION, Rule.FACTOR, 3.0)),
        (1, Shift(RESTITUTION, Rule.OFFSET, 0.65)),
        (0, Shift(FRICTION, Rule.FACTOR, 0.1)),
        (0, Shift(FRICTION, Rule.FACTOR, 5.0)),
        (1, Shift(FRICTION, Rule.FACTOR, 0.2)),
        (0, Shift(SPEED, Rule.FACTOR, 1.6)),
        (0, Shift(SPEED, Rule.OFFSET, 1.0)),
        (0, Shift(SPEED, Rule.OFFSET, -0.7)),
    ],
    ids=str,
)
def test_a_change_follows_the_same_run_with_that_change(place: int, shift: Shift) -> None:
    discs = tuple(changed(disc, shift) if number == place else disc for number, disc in enumerate(ROW))
    _, contacts = path(discs, 128)
    worlds = worlds_of(ROW)
    world = worlds.counterfactual(Change("other", (Meaning(1.0, shift),)), place)
    universe = world.events.universe
    happening = {(first, second): time for time, first, second in contacts}
    for number, pair in enumerate(universe.pairs):
        share = world.events.happens[:, number].mean()
        assert (share > 0.5) == (pair in happening), f"{pair}: {share}"
        if pair in happening:
            when = np.nanmedian(world.events.time[:, number])
            assert when == pytest.approx(happening[pair], abs=0.15)


@pytest.mark.parametrize("own_courses", [True, False])
@pytest.mark.parametrize("change", [Change.HEAVIER, Change.LIGHTER], ids=str)
def test_a_mass_that_friction_follows_is_felt_before_anything_is_touched(change: Change, *, own_courses: bool) -> None:
    exponent, discs = 0.5, (Disc((-1.5, 0.0), (1.6, 0.0)), Disc((0.0, 2.0)))
    (meaning,) = change.meanings
    assert meaning.shift is not None
    same = Shift(FRICTION, Rule.FACTOR, meaning.shift.amount**exponent)

    def ends(mass_exponent: float | None, change: Change) -> np.ndarray:
        posterior = KnownPosterior(tracks_of(discs, 60), discs, spread=0.0, mass_exponent=mass_exponent)
        world = PosteriorWorlds(posterior, draws=DRAWS, own_courses=own_courses).counterfactual(change, 0)
        assert not world.collided.any()
        return world.trajectory[:, -1, 0, 0]

    found = ends(exponent, change)
    np.testing.assert_allclose(found, ends(None, Change("other", (Meaning(1.0, same),))), atol=1e-6)
    expected = path((changed(discs[0], same), discs[1]), 60)[0][-1, 0, 0]
    assert abs(path(discs, 60)[0][-1, 0, 0] - expected) > 3 * found.std()
    assert abs(found.mean() - expected) < found.std()


def test_each_change_of_the_row_changes_its_contacts_or_its_times() -> None:
    _, before = path(ROW, 128)
    assert [pair[1:] for pair in before] == [(0, 1)]


def test_a_speed_is_not_given_to_a_disc_at_rest() -> None:
    worlds = worlds_of(ROW)
    world = worlds.counterfactual(Change.by("faster", SPEED, Rule.FACTOR, 3.0), 1)
    assert same_collisions(world.events, worlds.events())
    assert not world.collided.any()


def test_no_change_is_what_was_seen() -> None:
    worlds = worlds_of(ROW)
    world = worlds.counterfactual(Change("same", (Meaning(1.0, None),)), 0)
    assert same_collisions(world.events, worlds.events())


def test_every_draw_takes_one_meaning_by_its_probability() -> None:
    discs, draws = ROW, 4000
    posterior = KnownPosterior(tracks_of(discs, 20), discs, total=draws)
    meanings = (
        Meaning(0.2, None),
        Meaning(0.5, Shift(MASS, Rule.FACTOR, 3.0)),
        Meaning(0.3, Shift(RESTITUTION, Rule.OFFSET, 5.0)),
    )
    worlds = posterior.worlds()
    change = Change("other", meanings)
    (batch,) = PosteriorWorlds(posterior, draws=draws).batches
    after = Intervention(change, 1, worlds, batch.meanings(change)).worlds
    heavier = (after.mass[:, 1] / worlds.mass[:, 1]).numpy()
    bouncier = (after.restitution[:, 1] != worlds.restitution[:, 1]).numpy()
    # three standard errors of a share of 4000 draws are at most 0.024
    assert np.mean(np.isclose(heavier, 3.0)) == pytest.approx(0.5, abs=0.024)
    assert bouncier.mean() == pytest.approx(0.3, abs=0.024)
    assert not (bouncier & ~np.isclose(heavier, 1.0)).any()
    assert after.restitution[:, 1].max() == 1.0  # no collision gives energy
    assert np.array_equal(after.mass[:, 0], worlds.mass[:, 0])


def test_an_impulse_scales_with_the_reduced_mass_and_the_restitution() -> None:
    posterior = KnownPosterior(tracks_of(ROW, 20), ROW, spread=0.0)
    worlds = posterior.worlds(1)
    mass, bounce = worlds.mass[0].numpy(), worlds.restitution[0].numpy()

    def impulse(own: float, own_bounce: float) -> float:
        return (1 + own_bounce * bounce[0]) * own * mass[0] / (own + mass[0])

    for shift, after in (
        (Shift(MASS, Rule.FACTOR, 4.0), impulse(4 * mass[1], bounce[1])),
        (Shift(RESTITUTION, Rule.FACTOR, 2.0), impulse(mass[1], 2 * bounce[1])),
        (Shift(SPEED, Rule.FACTOR, 2.0), impulse(mass[1], bounce[1])),
    ):
        ratio = Intervention(Change("other", (Meaning(1.0, shift),)), 1, worlds, np.zeros(1, dtype=int))
        assert ratio.impulse_ratio(0)[0] == pytest.approx(after / impulse(mass[1], bounce[1]))
