"""What is known of an effect that no cause of the catalogue explains: where it shows, its size, a sparse formula."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from vrdp_prob.datasets.folder import some
from vrdp_prob.discovery.checks.contacts import DURATION
from vrdp_prob.discovery.checks.flight import BESIDE
from vrdp_prob.discovery.checks.measurement import GENERAL
from vrdp_prob.discovery.checks.neighbours import roughness
from vrdp_prob.discovery.finding import Check, Description
from vrdp_prob.discovery.residuals.contact_patterns import durations_freed
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.free_flight_patterns import SYMBOLS, Pattern, spanned
from vrdp_prob.discovery.residuals.missing_acceleration import Separate, Windows, missing_acceleration
from vrdp_prob.discovery.residuals.missing_impulse import SYMBOLS as CONTACT_SYMBOLS
from vrdp_prob.discovery.residuals.missing_impulse import MissingImpulse
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.discovery.sparse_formula import SparseFormula, sparse_formula
from vrdp_prob.discovery.words import number
from vrdp_prob.inference.several_videos.fitting import SharedFit

CLEARLY = 1.5
"""Ratio of sizes from which on one part of the motion is said to show more of an effect than another."""
NOTABLE = 0.1
"""Share below which a part of what is unexplained is not worth a word."""
FEWEST_WINDOWS = 6
"""Windows of free flight from which a missing acceleration is told of."""
MOST_CHECKS = 2
"""Checks that are quoted."""


def describe(fit: SharedFit, checks: Sequence[Check]) -> Description:
    """Describe what a joint fit leaves unexplained.

    Parameters
    ----------
    fit
        The fit.
    checks
        Checks of the fit, some of which are quoted.

    Returns
    -------
    The description. Its formulas are the sums of the fewest state terms whose error in left-out videos is within one
    standard error of the smallest (orthogonal matching pursuit, whole videos left out); they tell what the missing
    acceleration, and beside it the missing impulse at contacts, are like, not what causes them.
    """
    return description_of(ResidualModel.of(fit), checks)


def description_of(model: ResidualModel, checks: Sequence[Check]) -> Description:
    """What `describe` says, of the residuals of a joint fit."""
    flight = FreeFlight.of(model)
    noise = roughness(model)
    windows = missing_acceleration(flight.model, noise)
    lost = [video.linear.name in windows.lost for video in model.videos]
    shown = [k for k, one in enumerate(flight.patterns) if _may_show(flight, one)]
    found = sparse_formula(Separate.of(flight.model, [rows[:, shown] for rows in flight.rows], noise).without(lost))
    places = [shown[k] for k in found.terms]
    formula = _formula("a", [flight.patterns[k].formula for k in places], found.coefficients)
    of_contacts, contact_formula = _at_contacts(model, flight, places, lost, noise)
    sentences = [
        *_share_sentences(model, durations_freed(flight.model), noise),
        *_window_sentences(windows),
        *_formula_sentences(found, formula),
        *_contact_sentences(of_contacts, contact_formula, checks),
        *_check_sentences(checks),
    ]
    size = float(np.sqrt(2)) * windows.size if _show_something(windows) else None
    return Description(formula, found.explained, size, tuple(sentences), contact_formula, of_contacts.explained)


def _at_contacts(
    model: ResidualModel, flight: FreeFlight, chosen: list[int], lost: Sequence[bool], noise: float
) -> tuple[SparseFormula, str]:
    """The sparse formula of what is missing at contacts, beside that of free flight; empty where nothing is."""
    contacts = MissingImpulse.of(model, flight.scales)
    beside = model.freed(contacts.anything).sharing([rows[:, chosen] for rows in flight.rows])
    found = sparse_formula(Separate.of(beside, contacts.rows, noise).without(lost))
    terms = [contacts.patterns[k].formula for k in found.terms]
    return found, _formula("J", terms, found.coefficients) if terms else ""


def _may_show(flight: FreeFlight, pattern: Pattern) -> bool:
    """Whether a pattern may be a term: of shaking only the frequency that shows most."""
    if not pattern.name.startswith("shaking"):
        return True
    names = list(flight.scales.frequencies)
    statistics = [
        flight.part([one.name for one in flight.patterns if one.name.startswith(f"{name} ")]).score.chi_square
        for name in names
    ]
    return pattern.name.startswith(f"{names[int(np.argmax(statistics))]} ")


def _formula(of: str, terms: Sequence[str], coefficients: Float[np.ndarray, "term"]) -> str:
    if not terms:
        return "none of the terms"
    signs = ["-" if value < 0 else "+" for value in coefficients]
    parts = [
        f"{sign} {number(abs(value))} {term}"
        for sign, value, term in zip(signs, coefficients.tolist(), terms, strict=True)
    ]
    return f"{of} = " + " ".join(parts).removeprefix("+ ").replace("- ", "-", int(signs[0] == "-"))


def _share_sentences(model: ResidualModel, freed: ResidualModel, noise: float) -> Iterator[str]:
    """How much of what is unexplained begins at contacts."""
    whole, left = (one.linear.degrees * (one.dispersion - noise) for one in (model, freed))
    if whole <= 0 or model.dispersion < 1.05 * noise:
        yield "The residuals are hardly larger than the roughness of the tracks."
        return
    share = float(np.clip(1 - left / whole, 0.0, 1.0))
    if share > NOTABLE:
        yield f"{100 * share:.0f} % of what is unexplained begins at contacts."
    else:
        yield "What is unexplained builds up in free flight, not at contacts."


def _show_something(windows: Windows) -> bool:
    return windows.size > 0 and len(windows.time) >= FEWEST_WINDOWS


def _window_sentences(windows: Windows) -> Iterator[str]:
    """Size and direction of the missing acceleration, and where in speed, time and place there is more of it."""
    if windows.lost:
        yield (
            f"Far more is missing in {some(windows.lost)} than the tracks show where nothing touches, or than in the "
            "other videos, as where a contact is missed or lasts; that is left out of what is said of accelerations."
        )
    if not _show_something(windows):
        if len(windows.time) or not windows.lost:
            yield "No missing acceleration shows in free flight" + (" of the others." if windows.lost else ".")
        return
    squares = (windows.acceleration**2).sum(axis=1)
    total = float(squares.sum())
    along = float((windows.along**2).sum()) / total
    yield (
        f"In free flight {number(float(np.sqrt(2)) * windows.size)} m/s^2 are missing (root mean square), "
        f"{100 * along:.0f} % of its square along the path and {100 * (1 - along):.0f} % across."
    )
    middle = np.median(windows.position, axis=0)
    aspects = (
        ("speeds", windows.speed, "m/s"),
        ("times", windows.time, "s"),
        *(("xy"[axis], windows.position[:, axis], "m") for axis in spanned(windows.position)),
        ("distances from the middle of the plane", np.linalg.norm(windows.position - middle, axis=1), "m"),
    )
    for name, values, unit in aspects:
        low, high = np.quantile(values, [1 / 3, 2 / 3])
        below, above = (float(np.sqrt(squares[part].mean())) for part in (values <= low, values >= high))
        if max(below, above) > CLEARLY * min(below, above):
            yield (
                f"It is {'larger' if above > below else 'smaller'} at large {name}: {number(above)} m/s^2 above "
                f"{number(float(high))} {unit}, {number(below)} m/s^2 below {number(float(low))} {unit}."
            )


def _formula_sentences(found: SparseFormula, formula: str) -> Iterator[str]:
    if not found.terms:
        yield "No sum of state terms predicts it in videos that were left out."
        return
    yield (
        f"The formula {formula} explains {100 * found.explained:.0f} % of it in videos that were left out ({SYMBOLS}); "
        "it describes, and names no cause."
    )


def _contact_sentences(found: SparseFormula, formula: str, checks: Sequence[Check]) -> Iterator[str]:
    yield from (check.sentence for check in checks if check.significant and check.name in DURATION.values())
    if found.terms:
        yield (
            f"At contacts an impulse {formula} is missing, which explains {100 * found.explained:.0f} % of what free "
            f"flight leaves in videos that were left out ({CONTACT_SYMBOLS}); it describes, and names no cause."
        )


def _check_sentences(checks: Sequence[Check]) -> Iterator[str]:
    told = (*GENERAL, *DURATION.values())
    specific = [check for check in checks if check.significant and check.name not in told]
    telling = [check for check in specific if BESIDE not in check.sentence]
    for check in telling[:MOST_CHECKS]:
        yield check.sentence
