import numpy as np
import pytest
import torch

from vrdp_prob.inference.samplers.nuts_lockstep import Ask, in_lockstep


def paraboloid(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return -(places**2).sum(axis=1) / 2, -places


def climb(steps: int, ask: Ask) -> list[float]:
    """Log densities on a noisy way up."""
    place, seen = 3 + torch.randn(2, dtype=torch.float64).numpy(), []
    for _ in range(steps):
        value, slope = ask(place)
        seen.append(value)
        place = place + 0.3 * slope + 0.1 * torch.randn(2, dtype=torch.float64).numpy()
    return seen


def test_each_has_its_own_random_numbers_whoever_runs_beside_it() -> None:
    torch.manual_seed(0)
    before = torch.get_rng_state()
    alone = [in_lockstep([lambda ask, n=n: climb(n, ask)], [n], paraboloid)[0] for n in (3, 7)]
    together = in_lockstep([lambda ask, n=n: climb(n, ask) for n in (3, 7)], [3, 7], paraboloid)
    assert together == alone
    assert [len(one) for one in together] == [3, 7]
    assert (torch.get_rng_state() == before).all()


def test_requests_of_all_that_still_run_are_answered_in_one_batch() -> None:
    sizes = []

    def counted(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sizes.append(len(places))
        return paraboloid(places)

    in_lockstep([lambda ask, n=n: climb(n, ask) for n in (2, 5, 3)], [0, 1, 2], counted)
    assert sizes == [3, 3, 2, 1, 1]


def test_an_error_in_one_of_them_ends_all() -> None:
    ended = []

    def fails(ask: Ask) -> None:
        ask(np.zeros(2))
        raise ValueError("lost")

    def goes_on(ask: Ask) -> None:
        try:
            climb(100, ask)
        finally:
            ended.append(True)

    with pytest.raises(ValueError, match="lost"):
        in_lockstep([goes_on, fails], [0, 1], paraboloid)
    assert ended == [True]
