"""What the tracks tell by themselves: contacts, entrances, exits, who moves, against motion whose truth is known."""

import numpy as np
import pytest
from sliding_discs import FRAME, FRICTION, GRAVITY, Disc, path, tracks_of

from vrdp_prob.reasoning.chance import MostProbable, Seeded
from vrdp_prob.reasoning.contacts import see
from vrdp_prob.reasoning.rest import DrawnMotion, possible_rests
from vrdp_prob.reasoning.seen import SeenVideo
from vrdp_prob.reasoning.sight import Sight
from vrdp_prob.reasoning.smoother import BodyTrack, Smoother, body_tracks
from vrdp_prob.scene import Body, Camera, Shape, Tracks

CHAIN = (
    Disc((-1.5, 0.0), (1.6, 0.0)),
    Disc((0.0, 0.05)),
    Disc((0.9, 0.15)),
    Disc((-1.0, 2.0), (1.0, 0.0)),
    Disc((0.2, 1.9)),
)
"""Disc 0 hits 1, which hits 2; apart from them disc 3 hits 4."""


def still_camera() -> Camera:
    """Looks straight down; the picture shows -2 to 2 m in x and y."""
    projection = np.array([[100.0, 0, 0, 200], [0, 100.0, 0, 200], [0, 0, 1e-6, 1]])
    return Camera(projection, 400, 400, frame_rate=25.0)


def a_kicked_body(noise: float, seed: int) -> tuple[BodyTrack, np.ndarray]:
    times = np.arange(60) * FRAME
    velocity = np.where(times[:, None] < 1.2, [1.0, 0.0], [0.2, 0.5])
    truth = np.concatenate([[[0.0, 0.0]], np.cumsum(velocity[:-1] * FRAME, axis=0)])
    measured = truth + noise * np.random.default_rng(seed).standard_normal(truth.shape)
    return BodyTrack(times, measured, np.full(len(times), noise)), truth


def test_the_evidence_for_a_contact_peaks_at_the_kick() -> None:
    track, _ = a_kicked_body(0.01, 1)
    times = np.arange(0.2, 2.2, 0.02)
    more = Smoother(track).one_more(times)
    gain = more.evidence + 0.5 * (more.pull**2).sum(axis=1) / (more.precision + 1 / 0.64)
    assert times[gain.argmax()] == pytest.approx(1.2, abs=0.03)
    known = Smoother(track, (1.2,)).one_more(times)
    left = known.evidence + 0.5 * (known.pull**2).sum(axis=1) / (known.precision + 1 / 0.64)
    assert gain.max() > 20
    assert left.max() < 3


def test_states_on_both_sides_of_a_kick_and_their_errors() -> None:
    squared = []
    for seed in range(20):
        track, truth = a_kicked_body(0.01, seed)
        smoother = Smoother(track, (1.2,))
        before, after = (smoother.state(np.array([1.2]), before=flag) for flag in (True, False))
        covariance = smoother.state_covariance(1.2)
        squared += [
            (after[0][0] - truth[30]) ** 2 / covariance[0, 0],
            (after[1][0] - [0.2, 0.5]) ** 2 / covariance[1, 1],
        ]
        assert before[0] == pytest.approx(after[0])
        assert before[1][0] == pytest.approx([1.0, 0.0], abs=0.2)
    assert np.mean(squared) == pytest.approx(1.0, abs=0.5)


def test_contacts_are_found_and_nothing_else() -> None:
    tracks = tracks_of(CHAIN)
    _, truth = path(CHAIN, 128)
    seen = see(tracks.bodies, body_tracks(tracks))
    found = {(c.first, c.second): c for c in seen.contacts}
    assert set(found) == {(first, second) for _, first, second in truth} == {(0, 1), (1, 2), (3, 4)}
    for time, first, second in truth:
        assert found[first, second].time == pytest.approx(time, abs=0.03)
        assert found[first, second].probability > 0.99


@pytest.mark.parametrize("gap", [0.05, 0.1, 0.5])
def test_a_near_miss_is_no_contact(gap: float) -> None:
    tracks = tracks_of([Disc((-1.5, 0.0), (1.5, 0.0)), Disc((0.0, 0.4 + gap))])
    seen = SeenVideo(Sight(tracks), 200)
    assert not seen.events.happens[:, seen.universe.collisions].mean() > 0.2


def test_a_resting_disc_rests_and_a_sliding_one_moves() -> None:
    seen = SeenVideo(Sight(tracks_of([Disc((-1.5, 0.0), (1.5, 0.0)), Disc((1.5, 1.0))])), 200)
    motion = seen.motion
    stops = round(1.5 / (FRICTION * GRAVITY) / FRAME)
    assert motion.moving[:, : stops - 5, 0].mean() > 0.98
    assert motion.moving[:, stops + 3 :, 0].mean() < 0.02
    assert motion.moving[:, :, 1].mean() < 0.02


def test_a_slow_disc_is_not_taken_for_a_resting_one() -> None:
    times = np.arange(100) * FRAME
    track = BodyTrack(
        times,
        np.stack([0.2 * times, 0 * times], axis=1) + 0.005 * np.random.default_rng(3).standard_normal((100, 2)),
        np.full(100, 0.005),
    )
    smoother = Smoother(track)
    rests = possible_rests(smoother, until=4.0)
    drawn = DrawnMotion(smoother, rests, 100, doubt=np.random.default_rng(1), numbers=np.random.default_rng(0))
    assert np.linalg.norm(drawn.state(times)[1], axis=-1).min(axis=1).mean() > 0.1


def test_entrances_and_exits_are_crossings_of_the_edge() -> None:
    times = np.arange(100) * FRAME
    x = np.array([-3.0 + 1.5 * times, 0.5 * times, -0.5 + 0 * times]).T
    positions = np.stack([x, np.broadcast_to([0.0, 1.0, -1.0], x.shape)], axis=-1)
    positions[np.abs(positions[..., 0]) > 2] = np.nan
    positions[0, 1] = np.nan
    positions[:3, 2] = np.nan
    positions[60:64, 2] = np.nan
    bodies = tuple(Body(name, Shape.SPHERE, radius=0.2) for name in "abc")
    tracks = Tracks.from_arrays("v", bodies, times, positions, camera=still_camera())
    seen = SeenVideo(Sight(tracks), 3)
    table, universe = seen.events, seen.universe
    assert table.happens[0, universe.entrances].tolist() == [True, False, False]
    assert table.happens[0, universe.exits].tolist() == [True, False, False]
    assert table.time[0, universe.entrances][0] == pytest.approx((3 - 2) / 1.5, abs=FRAME)
    assert table.time[0, universe.exits][0] == pytest.approx((3 + 2) / 1.5, abs=FRAME)
    assert seen.motion.in_view[:, :, 2].all()


def test_without_a_camera_being_seen_late_is_entering() -> None:
    discs = (Disc((0.0, 0.0), (0.3, 0.0)), Disc((1.5, 1.5), (-0.5, 0.0), release=1.0))
    seen = SeenVideo(Sight(tracks_of(discs)), 2)
    assert seen.events.happens[0, seen.universe.entrances].tolist() == [False, True]
    assert seen.events.time[0, seen.universe.entrances][1] == pytest.approx(1.0, abs=FRAME)


def test_the_same_seed_gives_the_same_draws() -> None:
    tracks = tracks_of(CHAIN)
    one, other = SeenVideo(Sight(tracks), 20, Seeded(5)), SeenVideo(Sight(tracks), 20, Seeded(5))
    assert np.array_equal(one.events.time, other.events.time, equal_nan=True)
    assert np.array_equal(one.motion.moving, other.motion.moving)


def test_without_chance_everything_is_as_is_most_probable() -> None:
    tracks = tracks_of(CHAIN)
    drawn, best = SeenVideo(Sight(tracks), 400, Seeded(0)), SeenVideo(Sight(tracks), 1, MostProbable())
    assert np.array_equal(best.events.happens[0], drawn.events.happens.mean(axis=0) > 0.5)
    happened = best.events.happens[0]
    middle = np.nanmedian(drawn.events.time[:, happened], axis=0)
    np.testing.assert_allclose(best.events.time[0, happened], middle, atol=0.005)
    np.testing.assert_array_equal(best.motion.in_view[0], drawn.motion.in_view.all(axis=0))
