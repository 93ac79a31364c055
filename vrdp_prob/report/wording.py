"""The report's words: names of objects and worlds, and numbers rounded to what they mean."""

import math
import re
import string
from collections.abc import Mapping, Sequence

from vrdp_prob.inference.draws.summaries import ParameterSummary, Summary
from vrdp_prob.plain_words import listed, percent, sentence
from vrdp_prob.report.content import FACTUAL, FUTURE, REMOVED, WorldContent
from vrdp_prob.scene import Body, Tracks
from vrdp_prob.scene.body import COLORS
from vrdp_prob.scene.naming import names

MOST_DECIMALS = 4
NEUTRAL_COLORS = ("ink1", "ink2", "ink3", "ink4", "ink5", "ink6", "ink7")
"""Colours for objects whose own colour is not known; their values stand in the page's style sheet."""


def tags(bodies: Sequence[Body]) -> dict[str, str]:
    """A mark of at most three letters for each body, drawn beside it: its id, or A, B, C... where ids are long."""
    if all(len(body.id) <= 3 for body in bodies):
        return {body.id: body.id for body in bodies}
    letters = string.ascii_uppercase
    return {
        body.id: letters[index] if len(bodies) <= len(letters) else str(index + 1) for index, body in enumerate(bodies)
    }


def with_names(text: str, bodies: Sequence[Body]) -> str:
    """A sentence with 'object 3' or 'objects 3, 4' replaced by the names of these bodies."""
    name = names(bodies)
    one = "|".join(re.escape(identity) for identity in sorted(name, key=len, reverse=True))
    many = re.compile(rf"\b([Oo])bjects? ((?:{one})(?:(?:, | and )(?:{one})(?!\w|\.\d))*)(?!\w|\.\d)")

    def named(found: re.Match[str]) -> str:
        said = listed(f"the {name[identity]}" for identity in re.findall(rf"(?:{one})(?!\w)", found[2]))
        return sentence(said) if found[1] == "O" else said

    return many.sub(named, text)


def uncertain_attributes(body: Body) -> str:
    """What a body may look like where that is not certain: 'material 55 % rubber, 45 % metal'; else empty."""
    doubts = []
    for attribute, values in body.attribute_probabilities.items():
        ranked = sorted(values.items(), key=lambda item: -item[1])
        if ranked[0][1] < 0.995:
            shown = ", ".join(f"{percent(share)} {value}" for value, share in ranked if share >= 0.005)
            doubts.append(f"{attribute} {shown}")
    return "; ".join(doubts)


def color_of(body: Body, index: int) -> str:
    """Name of the colour (of the style sheet) that a body is drawn in."""
    return body.color if body.color in COLORS else NEUTRAL_COLORS[index % len(NEUTRAL_COLORS)]


def world_label(world: WorldContent, tracks: Tracks) -> str:
    """What is shown in a world, in words."""
    if world.kind == FACTUAL:
        return "What was seen"
    if world.kind == FUTURE:
        return "What happens next"
    name = names(tracks.bodies)[world.body or ""]
    if world.kind == REMOVED:
        return f"Without the {name}"
    return f"If the {name} were {world.kind}"


def world_group(kind: str) -> str:
    """Heading under which the player lists a world."""
    return "This video" if kind in (FACTUAL, FUTURE) else f"One object {kind}"


def decimals(interval: Summary) -> int:
    """Decimal places that the width of an interval supports (two digits of its half width, between 0 and 4)."""
    width = interval.q95 - interval.q05
    return min(max(1 - math.floor(math.log10(width / 2)), 0), MOST_DECIMALS)


def interval_words(interval: Summary) -> tuple[str, str]:
    """The mean, and the 90 % interval, rounded to what the interval supports; a value without spread was held fixed."""
    if interval.q05 == interval.q95:
        return f"{interval.mean:.2f}" if interval.mean >= 0.1 else f"{interval.mean:.3g}", "held fixed"
    places = min(decimals(interval), 2) if interval.mean >= 0.1 else decimals(interval)
    return f"{interval.mean:.{places}f}", f"{interval.q05:.{places}f} to {interval.q95:.{places}f}"


def seconds(time: float) -> str:
    """A time in seconds."""
    return f"{time:.1f} s"


def mass_status(parameter: ParameterSummary, body: Body, name: Mapping[str, str]) -> str:
    """What the data say about a mass, in words."""
    if body.mass is not None:
        return "Weighed: given with the input."
    if parameter.status == "default":
        return _untold(parameter)
    if parameter.status == "identified":
        return "Known from how it moves and what it meets."
    return f"Only its ratio to {_the(parameter.partners, name)} is known, not the mass itself."


def restitution_status(parameter: ParameterSummary, name: Mapping[str, str]) -> str:
    """What the data say about a restitution factor, in words."""
    if parameter.status == "default":
        return _untold(parameter)
    if parameter.status == "identified":
        return "Known from its collisions."
    return f"Only its product with that of {_the(parameter.partners, name)} is known."


def rests_on(objects: str) -> str:
    """The note of an answer that hangs on what the video does not tell of some objects."""
    return f"Rests on mass or restitution of {objects}, which this video does not determine."


def _untold(parameter: ParameterSummary) -> str:
    """What stands in for a parameter of which the data say nothing."""
    value = "A default value" if parameter.summary.q05 == parameter.summary.q95 else "Drawn from the prior"
    return f"{value}: no collision tells it, and the data say nothing."


def _the(partners: Sequence[str], name: Mapping[str, str]) -> str:
    known = (f"the {name[partner]}" if partner in name else partner for partner in partners)
    return listed(known) if partners else "its collision partners"
