import numpy as np
import pytest

from tests.inference.generator import observe
from tests.inference.test_infer import chain, with_outliers
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.outliers import gross_outliers, without
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.scene import Body, Shape, Tracks


@pytest.mark.parametrize("seed", range(4))
def test_neither_noise_nor_collisions_are_outliers(seed: int) -> None:
    tracks = observe(chain(), noise=0.005, dropout=0.1, seed=seed)
    clues = Clues.of(tracks)
    assert not clues.outliers.any()
    assert clues.noise_family is NoiseFamily.GAUSSIAN
    assert without(tracks, clues.outliers) is tracks


def test_gross_outliers_are_found_next_to_one_another_and_at_the_ends() -> None:
    tracks = observe(chain(), noise=0.005, seed=1)
    positions = tracks.positions.copy()
    struck = [(0, 0), (40, 1), (41, 1), (60, 2), (len(positions) - 1, 3)]
    for frame, body in struck:
        positions[frame, body] += [0.3, -0.4]
    moved = Tracks.from_arrays("moved", tracks.bodies, tracks.times, positions)
    found = Clues.of(moved).outliers
    assert {(int(frame), int(body)) for frame, body in np.argwhere(found)} == set(struck)
    assert not without(moved, found).seen[found].any()


def test_most_of_many_outliers_are_found() -> None:
    tracks = observe(chain(), noise=0.005, seed=2)
    spoilt = with_outliers(tracks, 0.05)
    far = np.linalg.norm(spoilt.positions - tracks.positions, axis=-1) > 0.1
    found = Clues.of(spoilt).outliers
    assert (found & far).sum() > 0.8 * far.sum()
    assert (found & ~far).sum() <= 0.03 * far.size


def test_jumps_within_the_stated_noise_are_none() -> None:
    tracks = observe(chain(), noise=0.0002, seed=3)
    positions = tracks.positions.copy()
    positions[30:45:5, 1] += 0.004
    stated = np.broadcast_to(0.004**2 * np.eye(2), (*positions.shape[:2], 2, 2)).copy()
    jumped = Tracks.from_arrays("jumped", tracks.bodies, tracks.times, positions, position_covariance=stated)
    assert not Clues.of(jumped).outliers.any()
    unstated = Tracks.from_arrays("unstated", tracks.bodies, tracks.times, positions)
    assert gross_outliers(unstated, np.full(tracks.seen.shape, 0.0002)).any()


def test_soft_contacts_are_none_and_outliers_within_them_are() -> None:
    times = np.arange(80) / 100
    velocity = 0.1 - 0.45 * np.tanh((times - 0.4) / 0.015) - 0.15 * np.exp(-(((times - 0.43) / 0.02) ** 2))
    positions = np.stack([np.cumsum(velocity) / 100, 0.01 * times], axis=-1)[:, None]
    positions += np.random.default_rng(0).normal(0, 1e-5, positions.shape)
    soft = Tracks.from_arrays("soft", (Body("a", Shape.CYLINDER),), times, positions)
    assert not Clues.of(soft).outliers.any()
    positions[41, 0, 1] += 0.02
    assert Clues.of(Tracks.from_arrays("struck", soft.bodies, times, positions)).outliers[41, 0]


def early_contact() -> tuple[np.ndarray, np.ndarray]:
    """Times, and positions (time, body, 2) of a sphere that something strikes after two frames, and of another."""
    times = np.arange(40) / 25
    along = np.where(times < 0.06, 1.5 * times, 0.09 - 0.4 * (times - 0.06))
    struck = np.stack([along, 0.2 * times], axis=-1)
    other = np.stack([np.ones(40), 1.2 * times], axis=-1)
    positions = np.stack([struck, other], axis=1)
    return times, positions + np.random.default_rng(0).normal(0, 1e-3, positions.shape)


def outliers(times: np.ndarray, positions: np.ndarray) -> np.ndarray:
    bodies = tuple(Body(str(place), Shape.SPHERE) for place in range(positions.shape[1]))
    return Clues.of(Tracks.from_arrays("spheres", bodies, times, positions)).outliers


def test_what_comes_before_a_first_contact_is_none() -> None:
    times, positions = early_contact()
    assert not outliers(times, positions).any()


@pytest.mark.parametrize("elsewhere", ["nothing", "a jump for good", "a short track"])
def test_the_first_positions_may_be_outliers_whatever_happens_elsewhere(elsewhere: str) -> None:
    times, positions = early_contact()
    positions[:2, 0] += [[0.5, 0.0], [0.0, 0.5]]
    if elsewhere == "a jump for good":
        positions[20:, 1, 0] += 2.0
    if elsewhere == "a short track":
        short = np.full((40, 1, 2), np.nan)
        short[30:35, 0] = [[0.0, 0.0], [1.0, 2.0], [-1.0, 0.5], [2.0, -1.0], [0.0, 1.0]]
        positions = np.concatenate([positions, short], axis=1)
    assert outliers(times, positions)[:2, 0].all()


@pytest.mark.parametrize("end", ["first", "last"])
def test_a_single_position_before_or_after_a_contact_is_none(end: str) -> None:
    times = np.arange(40) / 25
    meeting = 1.4 / 25  # between the second frame and the third, so that a single one lies across the contact
    struck = np.where(times < meeting, 2.0 * (times - meeting), -0.3 * (times - meeting))
    hit = 0.4 + np.where(times < meeting, 0.0, 0.9 * (times - meeting))
    positions = np.stack([np.stack([struck, hit], axis=1), np.zeros((40, 2))], axis=-1)
    positions += np.random.default_rng(0).normal(0, 1e-3, positions.shape)
    place = 0 if end == "first" else -1
    seen = positions[1:] if end == "first" else positions[::-1][:-1]
    bodies = (Body("0", Shape.SPHERE, 0.2), Body("1", Shape.SPHERE, 0.2))
    assert not Clues.of(Tracks.from_arrays("early", bodies, times[1:], seen)).outliers.any()
    far = seen + 5 * (np.arange(39) == np.arange(39)[place])[:, None, None]
    assert Clues.of(Tracks.from_arrays("spoilt", bodies, times[1:], far)).outliers[place].all()
    apart = seen + np.array([[0.0, 0.0], [0.0, 3.0]])
    assert Clues.of(Tracks.from_arrays("apart", bodies, times[1:], apart)).outliers[place, 0]
