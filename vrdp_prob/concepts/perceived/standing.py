"""How well a network answers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch

from vrdp_prob.concepts.perceived.lessons import Taught
from vrdp_prob.concepts.perceived.losses import judge_softly
from vrdp_prob.concepts.perceived.network import Attributes, ConceptNetwork
from vrdp_prob.concepts.perceived.observation import Observation
from vrdp_prob.concepts.perceived.soft_facts import SoftFacts


@dataclass(frozen=True)
class Standing:
    """How well a network answers.

    Parameters
    ----------
    loss
        Mean loss of an example.
    right
        Share of examples whose likeliest answer is right.
    """

    loss: float
    right: float


See = Callable[[Sequence[Observation]], list[Attributes]]
"""Attributes of the objects of some videos."""


def standing(network: ConceptNetwork, videos: Sequence[Taught], see: See, *, learned_events: bool) -> Standing:
    """How well a network answers what is asked about some videos, with their attributes as `see` gives them."""
    network.eval()
    with torch.no_grad():
        facts = facts_of(network, videos, see, learned_events=learned_events)
        judged = [
            judge_softly(example, seen) for one, seen in zip(videos, facts, strict=True) for example in one.examples
        ]
    losses = [one.loss.item() for one in judged]
    return Standing(sum(losses) / len(losses), sum(one.right for one in judged) / len(judged))


def facts_of(network: ConceptNetwork, videos: Sequence[Taught], see: See, *, learned_events: bool) -> list[SoftFacts]:
    """Videos as a network sees them, with their attributes as `see` gives them."""
    observations = [one.observation for one in videos]
    return [
        network.facts(one, own, learned_events=learned_events)
        for one, own in zip(observations, see(observations), strict=True)
    ]
