"""Torch's random numbers within a seed, and what is left of them."""

import pytest
import torch

from vrdp_prob.randomness import seeded

DEVICES = [
    "cpu",
    pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="torch finds no GPU")),
]


@pytest.mark.parametrize("device", DEVICES)
def test_a_seed_gives_its_numbers_and_leaves_others_alone(device: str) -> None:
    torch.manual_seed(1)
    undisturbed = [torch.rand(3, device=device) for _ in range(2)]
    torch.manual_seed(1)
    first = torch.rand(3, device=device)
    found = []
    for _ in range(2):
        with seeded(7, device):
            found.append(torch.rand(3, device=device))
    torch.testing.assert_close([first, torch.rand(3, device=device)], undisturbed, rtol=0, atol=0)
    assert torch.equal(found[0], found[1])
    assert not torch.equal(found[0], first)
