"""From an answer to what it hangs on, where its doubt comes from, and what would settle it."""

import numpy as np
from jaxtyping import Int

from vrdp_prob.reasoning.chance import Purpose, Seeded
from vrdp_prob.reasoning.event_operations import FUTURE
from vrdp_prob.reasoning.explanation.explanation import Explanation, Part
from vrdp_prob.reasoning.explanation.happenings import seen_quantities, world_quantities
from vrdp_prob.reasoning.explanation.hinges import hinges
from vrdp_prob.reasoning.explanation.information import answer_entropy
from vrdp_prob.reasoning.explanation.meanings import meaning_quantities
from vrdp_prob.reasoning.explanation.motions import FILMED_FRAMES, filmed, motion_quantities
from vrdp_prob.reasoning.explanation.observations import Film, observations
from vrdp_prob.reasoning.explanation.parameters import parameter_quantities, relevant_bodies
from vrdp_prob.reasoning.explanation.quantities import Quantity
from vrdp_prob.reasoning.explanation.shares import Twins
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.reasoning.prepared import PreparedQuestion
from vrdp_prob.reasoning.run import World
from vrdp_prob.reasoning.verdict import YES, Verdict, verdicts
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.scene.naming import names
from vrdp_prob.spread import evenly_spread

UNCERTAIN = 0.2
"""Entropy in nats from which on an answer is explained: a choice at 0.95, say."""

MOST_DRAWS = 800
"""Draws that are compared with each other, evenly spaced; the cost grows with their square."""


def explain(facts: Facts, asked: PreparedQuestion) -> Explanation:
    """Why the answer to a question is as uncertain as it is.

    Parameters
    ----------
    facts
        What the answer came from.
    asked
        The question.
    """
    judged = verdicts(facts, asked)
    entropies = [answer_entropy(verdict.codes[verdict.valid]) for verdict in judged]
    open_ones = [(place, verdict) for place, verdict in enumerate(judged) if entropies[place] >= UNCERTAIN]
    if not open_ones:
        return Explanation(
            asked.question.text,
            (),
            f"The answer is certain, as far as the draws tell: its entropy is {max(entropies):.2f} nats.",
        )
    twins = Twins(facts, asked) if isinstance(facts, PosteriorWorlds) else None
    parts = [_part(facts, asked, place, verdict, twins) for place, verdict in open_ones]
    return Explanation(asked.question.text, tuple(parts))


def _part(facts: Facts, asked: PreparedQuestion, place: int, verdict: Verdict, twins: Twins | None) -> Part:
    valid = np.flatnonzero(verdict.valid)
    everything = verdict.codes[valid]
    chosen = valid[evenly_spread(MOST_DRAWS, len(valid))]
    codes, worlds = verdict.codes[chosen], sorted(verdict.run.looked_at, key=str)
    wanted = YES if asked.options else int(np.bincount(everything).argmax())
    generator = Seeded(facts.posterior.seed if isinstance(facts, PosteriorWorlds) else 0, place).numbers(
        Purpose.EXPLANATION
    )
    quantities = [quantity.of_draws(chosen) for quantity in _quantities(facts, worlds)]
    varying = [quantity for quantity in quantities if quantity.varies]
    return Part(
        choice_id=asked.options[place][0].choice_id if asked.options else None,
        subject=asked.options[place][0].text if asked.options else asked.question.text,
        answer=verdict.names[wanted],
        probability=float((everything == wanted).mean()),
        entropy=answer_entropy(everything),
        hinges=hinges(varying, codes, wanted, generator),
        shares=None if twins is None else twins.shares(place, verdict.codes, verdict.valid),
        observations=observations(varying, _films(facts, worlds, chosen, generator), codes, generator),
    )


def _films(
    facts: Facts, worlds: list[World], chosen: Int[np.ndarray, "chosen"], generator: np.random.Generator
) -> list[Film]:
    """The film that goes on, for answers about what comes next."""
    if not isinstance(facts, PosteriorWorlds) or FUTURE not in worlds or not relevant_bodies(facts, FUTURE):
        return []
    return [Film(f"filming {FILMED_FRAMES} more frames", filmed(facts, generator)[chosen])]


def _quantities(facts: Facts, worlds: list[World]) -> list[Quantity]:
    """Everything that an answer which looks at these worlds may hang on."""
    name = names(facts.bodies)
    found = {quantity.name: quantity for quantity in seen_quantities(facts, name)}
    for world in worlds:
        found |= {quantity.name: quantity for quantity in world_quantities(facts, world, name)}
        if isinstance(facts, PosteriorWorlds):
            own = [*parameter_quantities(facts, world, name), *motion_quantities(facts, world, name)]
            found |= {quantity.name: quantity for quantity in [*own, *meaning_quantities(facts, world)]}
    return list(found.values())
