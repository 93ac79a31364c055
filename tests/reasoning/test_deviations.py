"""Motion that deviates from the model: how large deviations are, and what simulated worlds make of them."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from sliding_discs import FRAME, FRICTION, Disc, KnownPosterior, path, tracks_of

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning import PosteriorWorlds
from vrdp_prob.reasoning.deviations import Deviation, DeviationModel, turned
from vrdp_prob.reasoning.scales import ScalePrior
from vrdp_prob.reasoning.scattering import INSTANTS, Scattering, advance_scattered
from vrdp_prob.reasoning.stretch import State, advance

DRAWS = 40
TIMES = np.linspace(0.0, 1.6, 17)
CERTAIN = ScalePrior(0.3, 0.05)


def collision(draws: int = DRAWS) -> tuple[Worlds, State]:
    """Two discs of masses 1 and 2, of which the first hits the other off its centre after 0.3 s."""
    discs = (Disc((0.0, 0.0), (2.0, 0.0)), Disc((1.0, 0.1), mass=2.0))
    worlds = KnownPosterior(tracks_of(discs, 20), discs, spread=0.0, total=draws).worlds(draws)
    state = State.nowhere((draws, 2), 0.0)
    state.position[:], state.velocity[:] = worlds.position.numpy(), worlds.velocity.numpy()
    state.rolling[:], state.present[:] = state.velocity, True
    return worlds, state


def scattering(
    scale: float = 0.0,
    wander: float = 0.0,
    *,
    seen: tuple[Deviation, ...] = (),
    draws: int = DRAWS,
    noise: np.ndarray | None = None,
) -> Scattering:
    numbers = np.random.default_rng(0)
    return Scattering.of(
        seen,
        np.full(draws, scale),
        np.full(draws, wander),
        fresh=numbers.standard_normal((draws, 2, 2, 2)),
        shaking=numbers.standard_normal((draws, 2, INSTANTS, 2)),
        noise=np.zeros((len(seen), draws, 2)) if noise is None else noise,
    )


def momentum(velocity: np.ndarray) -> np.ndarray:
    return np.asarray(velocity[:, 0] + 2.0 * velocity[:, 1])


def test_motion_without_deviations_is_that_of_the_model() -> None:
    worlds, state = collision()
    plain = advance(worlds, state, TIMES[1:], PhysicsModel.base())
    same = advance_scattered(worlds, state, TIMES, PhysicsModel.base(), scattering())
    np.testing.assert_allclose(same.position, plain.position, atol=1e-6)
    np.testing.assert_allclose(same.velocity, plain.velocity, atol=1e-6)
    np.testing.assert_allclose(same.contacts.time, plain.contacts.time, atol=1e-9)
    assert (same.contacts.first == plain.contacts.first).all()


def test_a_contact_that_deviates_turns_both_impulses_and_keeps_the_momentum() -> None:
    worlds, state = collision()
    slippery = replace(
        worlds, parameters={**worlds.parameters, "sliding_friction": torch.full((DRAWS,), 1e-9, dtype=torch.float64)}
    )
    plain = advance(slippery, state, TIMES[1:], PhysicsModel.base())
    other = advance_scattered(slippery, state, TIMES, PhysicsModel.base(), scattering(0.2))
    np.testing.assert_allclose(momentum(other.velocity[:, -1]), momentum(plain.velocity[:, -1]), atol=1e-4)
    kick, expected = other.velocity[:, -1, 1], plain.velocity[:, -1, 1]
    ratio = (kick[:, 0] + 1j * kick[:, 1]) / (expected[:, 0] + 1j * expected[:, 1])
    numbers = np.stack([np.log(np.abs(ratio)), np.angle(ratio)], axis=1)
    np.testing.assert_allclose(numbers, 0.2 * scattering(0.2).fresh[:, 0, 1], atol=1e-3)


def test_a_white_acceleration_scatters_places_with_the_cube_of_the_time() -> None:
    draws, strength = 1500, 0.1
    worlds, state = collision(draws)
    state.present[:, 1] = False
    fast = replace(
        worlds, parameters={**worlds.parameters, "sliding_friction": torch.full((draws,), 1e-9, dtype=torch.float64)}
    )
    shaken = advance_scattered(fast, state, TIMES, PhysicsModel.base(), scattering(0.0, strength, draws=draws))
    expected = strength * np.sqrt(TIMES[-1] ** 3 / 3)
    # the standard error of a standard deviation of 3000 numbers is 1.3 %; kicks instead of noise make 1 % less
    assert shaken.position[:, -1, 0].std(axis=0).mean() == pytest.approx(expected, rel=0.06)
    assert shaken.velocity[:, -1, 0].std(axis=0).mean() == pytest.approx(strength * np.sqrt(TIMES[-1]), rel=0.06)


def test_a_contact_like_one_that_was_seen_deviates_as_that_did() -> None:
    worlds, state = collision()
    model = PhysicsModel.base()
    met = advance(worlds, state, TIMES[1:], model).contacts
    approach = np.tile([-2.0 + 0.3 * FRICTION * 9.81, 0.0], (DRAWS, 1))
    seen = Deviation(0, 1, np.ones(DRAWS, dtype=bool), met.normal, approach, np.tile([0.0, 0.4], (DRAWS, 1)))
    turned_normal = turned(met.normal, np.tile([0.0, 1.5], (DRAWS, 1)))
    elsewhere = replace(seen, normal=turned_normal)
    same, another = (scattering(0.001, seen=(one,)).log_ratio(met, approach) for one in (seen, elsewhere))
    # the share s^2 / (s^2 + 0) of a deviation that was seen exactly is all of it
    np.testing.assert_allclose(same, np.tile([0.0, 0.4], (DRAWS, 1)), atol=1e-3)
    assert np.abs(another).max() < 0.005


def test_a_deviation_that_the_tracks_hardly_tell_is_hardly_reused() -> None:
    numbers = np.random.default_rng(1)
    noisy = np.array([0.0, 0.4]) + 0.3 * numbers.standard_normal((DRAWS, 2))
    one = np.tile([1.0, 0.0], (DRAWS, 1))
    seen = Deviation(0, 1, np.ones(DRAWS, dtype=bool), one, one, noisy)
    assert np.abs(scattering(0.02, seen=(seen,)).shrunk).max() < 0.02
    chance = scattering(0.02, seen=(seen,), noise=numbers.standard_normal((1, DRAWS, 2)))
    # what was not learned is as uncertain as a fresh deviation; the standard error of 80 numbers is 8 %
    assert chance.shrunk.std() == pytest.approx(0.02, rel=0.3)


def test_the_scale_of_videos_is_found_again() -> None:
    numbers = np.random.default_rng(2)
    scales = 0.1 * np.exp(0.3 * numbers.standard_normal(40))
    videos = [[(float(s * z + 0.02 * e), 0.02**2) for z, e in numbers.standard_normal((8, 2))] for s in scales]
    prior = ScalePrior.learned(videos)
    assert prior.median == pytest.approx(0.1, rel=0.2)
    assert prior.log_sd < 0.7
    level = np.linspace(0.05, 0.95, 19)
    told = prior.quantiles(videos[0], level)
    assert (np.diff(told) > 0).all()
    assert told[0] < scales[0] < told[-1]
    np.testing.assert_allclose(np.median(CERTAIN.quantiles([], level)), 0.3, rtol=0.05)


def seen_turn(turn: float) -> tuple[float, float]:
    """Turn of a contact as it is read off tracks in which the impulse was turned, and its standard deviation."""
    discs = (Disc((-1.2, 0.0), (2.0, 0.0)), Disc((0.0, 0.05)))
    shown, contacts = path(discs, 40)
    frame = int(np.ceil(contacts[0][0] / FRAME))
    after = [
        Disc(tuple(shown[frame, k]), tuple(v))
        for k, v in enumerate(np.diff(shown[frame : frame + 2], axis=0)[0] / FRAME)
    ]
    before = np.array([(shown[frame - 1, 0] - shown[frame - 2, 0]) / FRAME, np.zeros(2)])
    kicks = turned(np.array([disc.velocity for disc in after]) - before, np.tile([0.0, turn], (2, 1)))
    later = [replace(disc, velocity=tuple(v)) for disc, v in zip(after, before + kicks, strict=True)]
    rest, _ = path(later, 40 - frame)
    tracks = tracks_of(discs, 40, noise=0.0)
    noise = 0.002 * np.random.default_rng(3).standard_normal(shown.shape)
    shown[frame:] = rest
    tracks = type(tracks).from_arrays("turned", tracks.bodies, tracks.times, shown + noise)
    worlds = PosteriorWorlds(KnownPosterior(tracks, discs), draws=60)
    (deviation,) = worlds.batches[0].deviations
    return float(deviation.mean[1]), float(np.sqrt(deviation.variance[1]))


def test_the_turn_of_a_contact_is_read_off_the_tracks() -> None:
    for turn in (0.0, 0.4):
        told, sd = seen_turn(turn)
        assert sd < 0.15
        assert told == pytest.approx(turn, abs=3 * sd + 0.03)


def test_answers_of_a_single_best_fit_have_no_chance_in_them() -> None:
    worlds, state = collision(1)
    one = Scattering.of(
        (),
        np.full(1, 0.3),
        np.full(1, 0.3),
        fresh=np.zeros((1, 2, 2, 2)),
        shaking=np.zeros((1, 2, INSTANTS, 2)),
        noise=np.zeros((0, 1, 2)),
    )
    plain = advance(worlds, state, TIMES[1:], PhysicsModel.base())
    same = advance_scattered(worlds, state, TIMES, PhysicsModel.base(), one)
    np.testing.assert_allclose(same.position, plain.position, atol=1e-6)


def test_without_deviations_nothing_is_looked_for() -> None:
    discs = (Disc((-1.2, 0.0), (2.0, 0.0)), Disc((0.0, 0.05)))
    known = KnownPosterior(tracks_of(discs, 40), discs)
    assert PosteriorWorlds(known, draws=5, deviating=None).batches[0].scattering is None
    found = PosteriorWorlds(known, draws=5, deviating=DeviationModel(reused=False)).batches[0].scattering
    assert found is not None
    assert found.seen == ()
