"""What the draws leave open of the meaning of a learned word."""

import numpy as np
from jaxtyping import Float

from vrdp_prob.reasoning.changes import PhysicalParameter, Rule
from vrdp_prob.reasoning.explanation.quantities import Kind, Quantity
from vrdp_prob.reasoning.run import World
from vrdp_prob.reasoning.worlds import PosteriorWorlds


def meaning_quantities(worlds: PosteriorWorlds, world: World) -> list[Quantity]:
    """Which parameter the word for a change stands for, and the amount of each; nothing where that is certain.

    Parameters
    ----------
    worlds
        The draws.
    world
        Which world.
    """
    if isinstance(world, str) or not world[0].is_uncertain:
        return []
    change, _ = world
    taken = np.concatenate([batch.meanings(change) for batch in worlds.batches])
    shifts = [meaning.shift for meaning in change.meanings]
    subjects = [None if shift is None else shift.parameter for shift in shifts]
    distinct = list(dict.fromkeys(subjects))
    found = [
        Quantity(
            Kind.MEANING,
            f"parameter that '{change}' changes",
            np.array([float(distinct.index(subject)) for subject in subjects])[taken],
            labels=tuple("there is none" if subject is None else f"it is the {subject}" for subject in distinct),
        )
    ]
    kinds = [(shift.parameter, shift.rule) for shift in shifts if shift is not None]
    for parameter, rule in dict.fromkeys(kinds):
        unchanged = 1.0 if rule is Rule.FACTOR else 0.0
        amounts = [
            shift.amount if shift is not None and (shift.parameter, shift.rule) == (parameter, rule) else unchanged
            for shift in shifts
        ]
        found.append(_amount(str(change), parameter, rule, np.array(amounts)[taken]))
    return found


def _amount(word: str, parameter: PhysicalParameter, rule: Rule, values: Float[np.ndarray, "draw"]) -> Quantity:
    """The amount of a change in each draw; that of no change in draws where the word means something else."""
    if rule is Rule.FACTOR:
        return Quantity(Kind.MEANING, f"factor of the {parameter} that '{word}' means", values, relative=True)
    unit = "m/s" if parameter is PhysicalParameter.SPEED else ""
    return Quantity(Kind.MEANING, f"change of the {parameter} that '{word}' means", values, unit)
