import numpy as np
import pytest

from vrdp_prob.inference.draws.diagnostics import (
    Reported,
    chain_statistics,
    drift,
    joined,
    ordered,
    settled,
    share_with_error,
    weighted_statistics,
)
from vrdp_prob.inference.draws.samples import ESS_GOAL, R_HAT_GOAL, Samples, assess
from vrdp_prob.inference.emcee_sampler import PER_WALKER
from vrdp_prob.inference.infer import default_model
from vrdp_prob.models.unknowns import Structure, unknowns
from vrdp_prob.scene import Body, Shape, Tracks

DRAWS = 20_000
MEMORY = 0.9


@pytest.fixture(scope="module")
def autoregressive() -> np.ndarray:
    """Four chains of a process with known memory."""
    noise = np.random.default_rng(0).standard_normal((4, DRAWS))
    chain = np.zeros((4, DRAWS))
    for step in range(1, DRAWS):
        chain[:, step] = MEMORY * chain[:, step - 1] + noise[:, step]
    return chain


def test_effective_size_of_an_autoregressive_chain_is_the_known_one(autoregressive: np.ndarray) -> None:
    found = chain_statistics(autoregressive[..., None])
    known = 4 * DRAWS * (1 - MEMORY) / (1 + MEMORY)
    assert found.ess_bulk == pytest.approx(known, rel=0.15)
    assert 0.5 * known < found.ess_tail < 4 * known
    assert found.r_hat < 1.01


def test_chains_have_settled_where_every_statistic_meets_its_goal(autoregressive: np.ndarray) -> None:
    groups = autoregressive.reshape(2, 2, DRAWS, 1)
    draws = joined(groups), ordered(groups)
    found = chain_statistics(draws[0])
    r_hat, effective = max(found.r_hat, drift(draws[1])), min(found.ess_bulk, found.ess_tail)
    assert settled(*draws, r_hat=r_hat, effective=effective)
    assert not settled(*draws, r_hat=r_hat - 1e-9, effective=effective)
    assert not settled(*draws, r_hat=r_hat, effective=effective + 1e-6)


def test_many_walkers_that_never_move_are_not_enough() -> None:
    generator = np.random.default_rng(0)
    walkers = 90
    modes = 4.0 * (generator.standard_normal((4, walkers, 1, 1)) > 0)
    stuck = modes + 0.3 * generator.standard_normal((4, walkers, 96, 1))
    draws = joined(stuck), ordered(stuck)
    assert settled(*draws, r_hat=R_HAT_GOAL, effective=ESS_GOAL), "no longer a danger"
    assert not settled(*draws, r_hat=R_HAT_GOAL, effective=PER_WALKER * 4 * walkers)


def test_error_of_a_share_grows_with_memory(autoregressive: np.ndarray) -> None:
    share, error = share_with_error((autoregressive > 0).astype(float))
    assert share == pytest.approx(0.5, abs=4 * error)
    independent = 0.5 / np.sqrt(4 * DRAWS)
    assert 2 * independent < error < 6 * independent
    assert share_with_error(np.ones((2, 10))) == (1.0, 0.0)


def test_a_difference_that_moves_slowly_is_named_although_both_numbers_mix_well() -> None:
    generator = np.random.default_rng(1)
    noise = generator.standard_normal((4, 1000))
    drift = 0.05 * np.cumsum(generator.standard_normal((4, 1000)), axis=1)
    draws = np.stack([noise, noise - 0.1 * drift], axis=-1)
    plain = Reported(("first", "second"), np.eye(2))
    both = Reported((*plain.names, "difference"), np.vstack([np.eye(2), [1.0, -1.0]]))
    samples = Samples(draws, np.zeros((4, 1000)))
    assert assess("emcee", samples, plain).converged
    convergence = assess("emcee", samples, both)
    assert not convergence.converged
    assert convergence.worst == "difference"
    assert "The weakest is difference." in convergence.sentence


def test_weights_tell_what_draws_are_worth() -> None:
    draws = np.random.default_rng(2).standard_normal((4000, 1))
    equal = weighted_statistics(draws, np.full(4000, 1 / 4000))
    assert equal.ess_bulk == pytest.approx(4000)
    # Twenty draws that weigh a hundred times as much as the others: (sum of w) squared over sum of w squared is 175.
    weights = np.where(np.arange(4000) < 20, 100.0, 1.0)
    spoiled = weighted_statistics(draws, weights / weights.sum())
    assert spoiled.ess_bulk == pytest.approx(175, rel=0.4)
    assert spoiled.ess_tail < 300


def test_weights_that_are_large_in_one_tail_are_worth_what_the_spread_repeats_to() -> None:
    draws = np.random.default_rng(5).standard_normal((400, 2000))
    weights = np.where(draws > 2, 8.0, 1.0)
    weights /= weights.sum(axis=1, keepdims=True)
    mean = (weights * draws).sum(axis=1, keepdims=True)
    variance = (weights * (draws - mean) ** 2).sum(axis=1)
    fourth = (weights * ((draws - mean) ** 2 - variance[:, None]) ** 2).sum(axis=1)
    worth = [weighted_statistics(one[:, None], own).ess_bulk for one, own in zip(draws, weights, strict=True)]
    assert np.median(fourth / worth) == pytest.approx(variance.var(), rel=0.2)


def test_tails_of_weighted_draws_are_those_of_what_they_stand_for() -> None:
    draws = np.random.default_rng(3).standard_normal(40_000)
    weights = np.exp(1.5 * draws)  # those of a standard normal density around 1.5
    weights /= weights.sum()
    expected = []
    for edge in 1.5 + np.array([-1.645, 1.645]):
        squares = ((draws <= edge) - weights @ (draws <= edge)) ** 2
        expected.append((weights @ squares) / (weights**2 @ squares))
    assert weighted_statistics(draws[:, None], weights).ess_tail == pytest.approx(min(expected), rel=0.1)


def test_a_few_divergences_do_no_harm_nor_do_many_ends_where_a_contact_comes_or_goes() -> None:
    draws = np.random.default_rng(4).standard_normal((4, 500, 1))
    few, many = (assess("nuts", Samples(draws, np.zeros((4, 500)), divergences=count)) for count in (20, 21))
    assert few.converged
    assert not many.converged
    assert "21 divergences" in many.sentence
    assert assess("nuts", Samples(draws, np.zeros((4, 500)), divergences=21, transitions=4000)).converged
    at_cliffs = assess("nuts", Samples(draws, np.zeros((4, 500)), divergences=3, cliffs=300))
    assert at_cliffs.converged
    assert "3 divergences" in at_cliffs.sentence
    assert "300 more where a contact comes or goes" in at_cliffs.sentence


def test_draws_that_chains_agree_on_are_not_trusted_where_there_are_doubts() -> None:
    draws = np.random.default_rng(4).standard_normal((4, 500, 1))
    doubtful = assess("nuts", Samples(draws, np.zeros((4, 500)), notes=("So it was.",), doubts=("A mode is missing.",)))
    assert not doubtful.converged
    assert doubtful.sentence.endswith("So it was. A mode is missing.")
    demanding = assess("emcee", Samples(draws, np.zeros((4, 500)), ess_goal=3000.0))
    assert not demanding.converged
    assert "(goal 3000)" in demanding.sentence


def test_what_is_reported_of_a_video_holds_its_ratios_and_products() -> None:
    bodies = tuple(Body(str(body), Shape.SPHERE, 0.2, mass=1.5 if body == 2 else None) for body in range(3))
    positions = np.random.default_rng(0).standard_normal((5, 3, 2))
    tracks = Tracks.from_arrays("seen", bodies, np.arange(5.0), positions)
    everything = frozenset(range(3))
    coordinates = unknowns(tracks, default_model(), Structure(moving=everything, colliding=everything))
    reported = Reported.of(coordinates, [(0, 1), (1, 2), (0, 1)], bodies)
    # The third body was weighed, so its ratio to another is that one's mass, which is there already.
    assert reported.names[len(coordinates) :] == (
        "the mass ratio of objects 0 and 1",
        "the restitution of objects 0 and 1",
        "the restitution of objects 1 and 2",
    )
    assert {"the restitution of object 1", "the velocity along x of object 2", "the noise scale"} <= set(reported.names)
    point = np.random.default_rng(1).standard_normal(len(coordinates))
    mass, restitution = ([point[coordinates.places[name, body]] for body in (0, 1)] for name in ("mass", "restitution"))
    values = reported.values(point)[len(coordinates) :]
    assert values[:2] == pytest.approx([mass[0] - mass[1], restitution[0] + restitution[1]])
