"""Whether what the fit found of single bodies depends on what they are, or on how fast they met.

Restitution and friction of single bodies are unknowns of the fit. So a law that the model lacks hides in them: each
body's fitted value follows its speed, its material or its mass. The values are regressed on these; the bodies' own
scatter is estimated beside it, and the F test needs no replications.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float, Int

from vrdp_prob.discovery.checks.false_discovery import SEEN
from vrdp_prob.discovery.checks.own_values import BodyFrictions, Rebounds
from vrdp_prob.discovery.checks.scatter_regression import Dependence, dependence
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.normal import WITHIN_95
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.words import number, opposite
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.scene import Body, Shape

REBOUND = "restitution against approach speed"


def friction_against(what: str) -> str:
    """Name of the check of what bodies rub by."""
    return f"friction of the bodies against {what}"


def body_checks(fit: SharedFit, model: ResidualModel) -> Iterator[Check]:
    """All checks of fitted values of single bodies."""
    contacts = [FittedContacts.of(video.motion) for video in model.videos]
    yield from _restitution_check(Rebounds.of(fit, contacts))
    yield from _friction_checks(fit, contacts)


def _restitution_check(rebounds: Rebounds) -> Iterator[Check]:
    if not len(rebounds.closing_speed):
        return
    # Below the usual speed a fall ends in the laws of impact; and how fast the slowest met is known least of all.
    usual = float(np.median(rebounds.closing_speed))
    speed = np.log1p(rebounds.closing_speed / usual)
    known = np.ones((len(speed), 1))
    found = dependence(rebounds.logarithm, rebounds.covariance, rebounds.owners, known, speed[:, None])
    if found is None:
        return
    slope, sd = float(found.slope[0]), float(found.sd[0])
    slow, fast = np.quantile(rebounds.closing_speed, [0.1, 0.9]).tolist()
    middle = float(rebounds.logarithm.mean())
    low, high = (float(np.exp(middle + slope * (np.log1p(v / usual) - speed.mean()))) for v in (slow, fast))
    sentence = (
        f"Restitution {opposite(slope, 'falls', 'grows')} with the approach speed: {number(low)} at {number(slow)} "
        f"m/s, {number(high)} at {number(fast)} m/s."
        if found.p_value < SEEN
        else f"Nothing seen; a power of {number(WITHIN_95 * sd)} of speeds beyond {number(usual)} m/s would have shown."
    )
    yield Check(REBOUND, slope, found.p_value, False, sentence)


def _friction_checks(fit: SharedFit, contacts: Sequence[FittedContacts]) -> Iterator[Check]:
    own = BodyFrictions.of(fit, contacts)
    bodies = own.bodies
    if not bodies:
        return
    rolls = np.array([body.shape is Shape.SPHERE for body in bodies])
    known = np.stack([rolls, ~rolls], axis=1).astype(float)
    known = known[:, known.any(axis=0)]

    def asked(
        columns: Sequence[Float[np.ndarray, "number"]],
        rows: Int[np.ndarray, "row"],
        known: Float[np.ndarray, "number column"],
    ) -> Dependence | None:
        """The dependence of some bodies' frictions on columns, beside what is known."""
        return dependence(
            own.logarithm[rows],
            own.covariance[np.ix_(rows, rows)],
            np.eye(len(rows)),
            _independent_columns(known[rows]),
            np.stack(columns, axis=1)[rows],
        )

    materials = sorted({body.material for body in bodies if body.material is not None})
    if len(materials) > 1:
        stated = np.flatnonzero([body.material is not None for body in bodies])
        found = asked([_indicator(bodies, material) for material in materials[1:]], stated, known)
        yield from _friction_check("material", found, _material_words(found, materials))
    if {Shape.CUBE, Shape.CYLINDER} <= {body.shape for body in bodies}:
        cubes = np.array([float(body.shape is Shape.CUBE) for body in bodies])
        found = asked([cubes], np.arange(len(bodies)), known)
        yield from _friction_check("shape", found, f"that of cubes is {_more(found)} than that of cylinders")
    weighed = np.flatnonzero(np.isfinite(own.log_mass))
    found = asked([own.log_mass], weighed, np.concatenate([own.weighed_together, known], axis=1))
    visible = "" if found is None else f"a power of {number(WITHIN_95 * float(found.sd[0]))} of the mass"
    yield from _friction_check("mass", found, _mass_words(found, own.largest_mass_ratio), visible)


def _friction_check(name: str, found: Dependence | None, words: str, visible: str = "") -> Iterator[Check]:
    if found is None:
        return
    visible = visible or f"{number(100 * WITHIN_95 * float(found.sd.max()))} %"
    sentence = (
        f"The fitted friction of the bodies depends on their {name}: {words}."
        if found.p_value < SEEN
        else f"Nothing seen; {visible} would have shown."
    )
    yield Check(friction_against(name), float(found.slope[0]), found.p_value, False, sentence)


def _independent_columns(columns: Float[np.ndarray, "number column"]) -> Float[np.ndarray, "number independent"]:
    """Columns without those that are sums of earlier ones."""
    rank = np.linalg.matrix_rank
    kept = [k for k in range(columns.shape[1]) if rank(columns[:, : k + 1]) > rank(columns[:, :k])]
    return columns[:, kept]


def _indicator(bodies: Sequence[Body], material: str) -> Float[np.ndarray, "number"]:
    return np.array([float(body.material == material) for body in bodies])


def _material_words(found: Dependence | None, materials: Sequence[str]) -> str:
    slopes = [] if found is None else found.slope.tolist()
    return ", ".join(
        f"that of {name} is {number(100 * abs(np.expm1(slope)))} % {opposite(slope, 'smaller', 'larger')} than that of "
        f"{materials[0]}"
        for name, slope in zip(materials[1:], slopes, strict=False)
    )


def _mass_words(found: Dependence | None, ratio: float) -> str:
    """A power alone says little where masses hardly differ."""
    power = 0.0 if found is None else float(found.slope[0])
    change = ratio**power - 1
    return (
        f"it {opposite(change, 'falls', 'grows')} by {number(100 * abs(change))} % where the mass grows by "
        f"{number(100 * (ratio - 1))} %, as much as it differs among them (the mass to the power {number(power)})"
    )


def _more(found: Dependence | None) -> str:
    slope = 0.0 if found is None else float(found.slope[0])
    return f"{number(100 * abs(float(np.expm1(slope))))} % {opposite(slope, 'smaller', 'larger')}"
