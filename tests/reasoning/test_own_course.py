"""Draws that follow their own course: which may, what they say of doubtful contacts, and what they make of a change."""

from dataclasses import replace

import numpy as np
import pytest
from sliding_discs import Disc, KnownPosterior, changed, path, tracks_of

from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.reasoning import Change, PosteriorWorlds
from vrdp_prob.reasoning.contacts import Contact
from vrdp_prob.reasoning.future import FUTURE_FRAMES
from vrdp_prob.reasoning.own_course import OwnCourses
from vrdp_prob.reasoning.sight import Sight

FRAMES = 60
DISCS = (Disc((-1.2, 0.0), (2.2, 0.0)), Disc((0.0, 0.05)), Disc((0.9, 0.1)))
"""Disc 0 hits disc 1, which hits disc 2."""
DRAWS = 100


def known(discs: tuple[Disc, ...] = DISCS) -> KnownPosterior:
    """Discs that are known as `discs` say, seen as they are."""
    return KnownPosterior(tracks_of(DISCS, FRAMES), discs, spread=0.0)


def courses(posterior: KnownPosterior, sight: Sight | None = None) -> OwnCourses:
    batch = PosteriorWorlds(posterior, draws=DRAWS).batches[0]
    return OwnCourses(sight or batch.common.sight, batch.released)


def test_half_of_the_draws_in_which_all_happens_follow_their_own_course() -> None:
    assert courses(known()).as_seen.all()
    share = PosteriorWorlds(known(), draws=DRAWS).batches[0].seen.on_own_course.mean()
    assert share == pytest.approx(0.5, abs=0.2)  # four standard errors of 100 draws
    kept = PosteriorWorlds(known(), draws=DRAWS, own_courses=False).batches[0]
    assert not kept.seen.on_own_course.any()


@pytest.mark.parametrize(
    "other",
    [
        pytest.param((DISCS[0], replace(DISCS[1], position=(0.0, 0.6)), DISCS[2]), id="a contact is missed"),
        pytest.param((replace(DISCS[0], velocity=(1.2, 0.0)), *DISCS[1:]), id="a contact is late"),
    ],
)
def test_a_draw_in_which_something_else_happens_keeps_what_was_seen(other: tuple[Disc, ...]) -> None:
    assert not courses(known(other)).as_seen.any()


def test_a_contact_that_nobody_saw_is_strange() -> None:
    apart = (DISCS[0], DISCS[1], replace(DISCS[2], position=(0.9, 1.5)))
    posterior = KnownPosterior(tracks_of(apart, FRAMES), DISCS, spread=0.0)
    assert not courses(posterior).as_seen.any()


def test_a_doubtful_contact_happens_where_the_draw_has_it() -> None:
    times = [time for time, *_ in path(DISCS, FRAMES)[1]]
    sight = Sight(known().tracks)
    doubtful = (Contact(0, 1, times[0], 0.0), Contact(0, 2, times[0], 0.0), Contact(1, 2, times[1] + 0.1, -2.0))
    object.__setattr__(sight, "contacts", doubtful)
    met = courses(known(), sight).met
    assert met[:, 0].all()
    assert not met[:, 1].any()
    assert met[:, 2].all()


def test_a_pair_may_have_met_twice() -> None:
    """Disc 1 comes back from the heavy disc 2, so that disc 0 hits it again."""
    discs = (DISCS[0], replace(DISCS[1], position=(0.0, 0.0)), Disc((0.9, 0.0), mass=8.0))
    posterior = KnownPosterior(tracks_of(discs, FRAMES), discs, spread=0.0)
    sight = Sight(posterior.tracks)
    released = PosteriorWorlds(posterior, draws=DRAWS).batches[0].released
    events = released.rollout.events.of_kind(RolloutEventKind.COLLISION)
    times = np.unique(events.time[(events.first == 0) & (events.second == 1)].round(3))
    assert len(times) == 2
    between = float(events.time[(events.first == 1) & (events.second == 2)][0])
    seen = (Contact(0, 1, times[0], 9.0), Contact(1, 2, between, 9.0), Contact(0, 1, times[1], 9.0))
    object.__setattr__(sight, "contacts", seen)
    assert courses(posterior, sight).as_seen.all()
    object.__setattr__(sight, "contacts", (*seen[:2], replace(seen[2], time=times[1] + 0.5)))
    assert not courses(posterior, sight).as_seen.any()


def test_a_change_is_simulated_from_the_release_on() -> None:
    worlds = PosteriorWorlds(known(), draws=DRAWS)
    own = worlds.batches[0].seen.on_own_course
    lighter = worlds.counterfactual(Change.LIGHTER, 1)
    expected, contacts = path(changed(DISCS, 1, mass=1 / 5), FRAMES)
    np.testing.assert_allclose(lighter.trajectory[own, -1, :, :2], np.tile(expected[-1], (own.sum(), 1, 1)), atol=0.01)
    for _, first, second in contacts:
        assert lighter.events.happens[own][:, worlds.events().universe.collision(first, second)].all()
    removed = worlds.counterfactual(Change.REMOVED, 0)
    assert not removed.exists[own, :, 0].any()
    np.testing.assert_allclose(
        removed.trajectory[own, -1, 2, :2], np.tile(DISCS[2].position, (own.sum(), 1)), atol=1e-6
    )


def test_after_the_video_a_draw_goes_on_as_it_came() -> None:
    """The video ends before the first contact; a draw on its own course goes on from its release."""
    posterior = KnownPosterior(tracks_of(DISCS, 10), DISCS, spread=0.0)
    worlds = PosteriorWorlds(posterior, draws=DRAWS)
    own = worlds.batches[0].seen.on_own_course
    assert 0 < own.mean() < 1
    expected, contacts = path(DISCS, 10 + FUTURE_FRAMES)
    np.testing.assert_allclose(
        worlds.future.trajectory[own, :, :, :2], np.tile(expected[10:], (own.sum(), 1, 1, 1)), atol=0.01
    )
    assert len(contacts) == 2
    for time, first, second in contacts:
        place = worlds.events().universe.collision(first, second)
        assert worlds.future.events.happens[own, place].all()
        np.testing.assert_allclose(worlds.future.events.time[own, place], time, atol=0.01)


def test_without_a_camera_who_left_leaves_in_every_draw() -> None:
    tracks = known().tracks
    data = tracks.data.copy(deep=True)
    for name in ("x", "y"):
        data[name].values[40:, 2] = np.nan
    gone = replace(known(), tracks=replace(tracks, data=data))
    worlds = PosteriorWorlds(gone, draws=DRAWS)
    assert 0 < worlds.batches[0].seen.on_own_course.mean() < 1
    exits = worlds.events().universe.exits.start + 2
    assert worlds.events().happens[:, exits].all()
    assert worlds.counterfactual(Change.HEAVIER, 2).events.happens[worlds.batches[0].seen.on_own_course, exits].all()
    assert not worlds.counterfactual(Change.REMOVED, 2).events.happens[:, exits].any()
