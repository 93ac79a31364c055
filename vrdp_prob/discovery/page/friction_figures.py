"""Fitted frictions of single bodies against what they are."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.checks.bodies import friction_against
from vrdp_prob.discovery.checks.own_values import BodyFrictions
from vrdp_prob.discovery.page.scatter import Points, with_bars
from vrdp_prob.discovery.page.seen import Figure, Seen
from vrdp_prob.scene import Body

KINDS: Mapping[str, Callable[[Body], str | None]] = {
    "material": lambda body: body.material,
    "shape": lambda body: str(body.shape),
}
"""What a body is, in words."""


def _frictions(seen: Sequence[Seen], what: str) -> str:
    found = [BodyFrictions.of(one.fit, one.contacts) for one in seen]
    names: Sequence[str] = ()
    if what in KINDS:
        words = [[KINDS[what](body) for body in one.bodies] for one in found]
        names = sorted({word for some in words for word in some if word is not None})
        values = [[np.nan if word is None else float(names.index(word)) for word in some] for some in words]
        at = [_spread(np.array(some)) for some in values]
    else:
        at = [np.exp(one.log_mass) for one in found]
    factors = [np.exp(one.logarithm) for one in found]
    points = [Points(places, factor, factor * one.sd) for places, factor, one in zip(at, factors, found, strict=True)]
    told = all(body.mass is not None for one in found for body in one.bodies)
    label = what if names else ("mass (kg)" if told else "mass (of those that met, relative)")
    return with_bars(
        seen,
        {"": points},
        (label, "friction / that of its kind"),
        f"Fitted friction of single bodies, in units of what bodies of their kind share, against their {what}.",
        level=1.0,
        names=names,
    )


def _spread(places: Float[np.ndarray, "body"]) -> Float[np.ndarray, "body"]:
    """Places of bodies of a kind side by side, so that their bars do not hide each other."""
    found = places.copy()
    for place in np.unique(places[np.isfinite(places)]):
        mine = np.flatnonzero(places == place)
        found[mine] += np.linspace(-0.22, 0.22, len(mine) + 2)[1:-1]
    return found


FRICTION_FIGURES: Mapping[str, Figure] = {
    friction_against(what): partial(_frictions, what=what) for what in (*KINDS, "mass")
}
"""How what a check of frictions is about is shown, by its name."""
