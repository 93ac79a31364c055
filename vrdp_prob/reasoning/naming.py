"""Objects in words, where what they look like may be uncertain."""

from collections import Counter

import numpy as np
from jaxtyping import Bool

from vrdp_prob.reasoning.facts import Facts
from vrdp_prob.scene import Body
from vrdp_prob.scene.body import ATTRIBUTES

RARE = 0.01
"""Share of the draws up to which an object counts as certain to belong to a set, or not to."""

_COUNT_WORDS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


def number_word(number: int) -> str:
    """A small number as a word, a larger one in digits."""
    return _COUNT_WORDS.get(number, str(number))


def likely_name(facts: Facts, place: int) -> str:
    """An object by its most probable attributes; by its id where it has no colour."""
    words = []
    for attribute in ("color", "material", "shape"):
        label = facts.attribute(attribute)[place]
        words.append(label.names[int(np.bincount(label.index).argmax())])
    described = " ".join(word for word in words if word)
    return described if words[0] else f"{described} {facts.bodies[place].id}"


def uncertainties(facts: Facts, mask: Bool[np.ndarray, "draw body"], words: tuple[str, ...]) -> tuple[str, ...]:
    """Sentences on the uncertain attributes that decide which objects belong to a set.

    Parameters
    ----------
    facts
        The video.
    mask
        Which objects belong to the set.
    words
        The words that picked them.
    """
    share = mask.mean(axis=0)
    open_ones = [place for place in np.argsort(np.abs(share - 0.5), kind="stable") if RARE < share[place] < 1 - RARE]
    sentences = []
    for place in open_ones:
        body = facts.bodies[place]
        for attribute in ATTRIBUTES:
            for word in words:
                probability = body.probabilities(attribute).get(word, 0.0)
                if 0.005 < probability < 0.995:
                    name = _name_without(body, attribute, facts.bodies)
                    sentences.append(f"The {attribute} of the {name} is uncertain ({100 * probability:.0f} % {word}).")
    return tuple(sentences)


def _name_without(body: Body, attribute: str, bodies: tuple[Body, ...]) -> str:
    """A body by what it looks like apart from one attribute, with its id where that fits others too."""
    names = Counter(_words_without(other, attribute) for other in bodies)
    own = _words_without(body, attribute)
    return own if names[own] == 1 else f"{own} (object {body.id})"


def _words_without(body: Body, attribute: str) -> str:
    used = {"color": (body.material, body.shape), "material": (body.color, body.shape)}
    words = used.get(attribute, (body.color, body.material, "object"))
    return " ".join(str(word) for word in words if word)
