"""Events and looks that differ from draw to draw: contacts, their order, rests, attributes."""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from vrdp_prob.reasoning.events import EventTable
from vrdp_prob.reasoning.explanation.quantities import Kind, Measurement, Quantity
from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.reasoning.run import World
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.scene.body import ATTRIBUTES

YES_NO = ("it does not", "it does")
LEAST_SHARE = 0.02
"""The order of two events is looked at where each happens in this share of the draws."""


def seen_quantities(facts: Facts, name: Mapping[str, str]) -> list[Quantity]:
    """What the tracks and perception leave open of the video: doubtful contacts, rests, attributes.

    Parameters
    ----------
    facts
        The video.
    name
        Name of each object by id.
    """
    found = _events(facts.events(), name, "in the video", observable=True)
    if isinstance(facts, PosteriorWorlds):
        found += _rests(facts, name)
    for attribute in ATTRIBUTES:
        for body, label in zip(facts.bodies, facts.attribute(attribute), strict=True):
            labels = tuple(f"it is {value}" for value in label.names)
            how = Measurement(f"looking up the {attribute} of object {body.id}")
            named = f"{attribute} of object {body.id}"
            found.append(Quantity(Kind.ATTRIBUTE, named, label.index.astype(float), labels=labels, measurement=how))
    return found


def world_quantities(facts: Facts, world: World, name: Mapping[str, str]) -> list[Quantity]:
    """Which events happen in a simulated world, and which come first.

    Parameters
    ----------
    facts
        The video.
    world
        Which world.
    name
        Name of each object by id.
    """
    table = facts.unseen_events() if isinstance(world, str) else facts.counterfactual_events(*world)
    where = "after the video" if isinstance(world, str) else f"with the {name[facts.bodies[world[1]].id]} {world[0]}"
    return [*_events(table, name, where, observable=False), *_orders(table, name, where)]


def _events(table: EventTable, name: Mapping[str, str], where: str, *, observable: bool) -> list[Quantity]:
    universe = table.universe
    called = [name[body] for body in universe.bodies]
    found = []
    for place, (first, second) in enumerate(universe.pairs):
        pair = f"the {called[first]} touches the {called[second]}"
        how = Measurement(f"seeing whether {pair} {where}") if observable else None
        found.append(_happens(table, place, f"whether {pair} {where}", how))
    for part, verb in ((universe.entrances, "enters"), (universe.exits, "leaves")):
        for body, word in enumerate(called):
            found.append(_happens(table, part.start + body, f"whether the {word} {verb} the picture {where}", None))
    return found


def _happens(table: EventTable, place: int, words: str, how: Measurement | None) -> Quantity:
    return Quantity(Kind.EVENT, words, table.happens[:, place].astype(float), labels=YES_NO, measurement=how)


def _orders(table: EventTable, name: Mapping[str, str], where: str) -> list[Quantity]:
    """Which of two contacts of the same object comes first, where both may happen."""
    universe = table.universe
    possible = np.flatnonzero(table.happens[:, universe.collisions].mean(axis=0) > LEAST_SHARE)
    found = []
    for one, other in combinations(possible.tolist(), 2):
        shared = set(universe.pairs[one]) & set(universe.pairs[other])
        if len(shared) != 1:
            continue
        body = shared.pop()
        first, second = (
            name[universe.bodies[next(iter(set(universe.pairs[place]) - {body}))]] for place in (one, other)
        )
        times = [np.where(table.happens[:, place], table.time[:, place], np.inf) for place in (one, other)]
        both = f"the {name[universe.bodies[body]]} touches the {first} before the {second} {where}"
        earlier = (times[0] < times[1]).astype(float)
        found.append(Quantity(Kind.EVENT, f"whether {both}", earlier, labels=YES_NO))
    return found


def _rests(worlds: PosteriorWorlds, name: Mapping[str, str]) -> list[Quantity]:
    found = []
    for body, rests in enumerate(worlds.seen.sight.rests):
        lies = np.concatenate([batch.seen.drawn[body].has_rest for batch in worlds.batches])
        for number, rest in enumerate(rests):
            words = f"the {name[worlds.bodies[body].id]} lies still from {rest.start:.2f} s to {rest.stop:.2f} s"
            how = Measurement(f"seeing whether {words}")
            values = lies[:, number].astype(float)
            found.append(Quantity(Kind.EVENT, f"whether {words}", values, labels=YES_NO, measurement=how))
    return found
