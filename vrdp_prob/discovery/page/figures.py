"""What a model misses, drawn before and after it is extended: some figures always, others where a check fails."""

from collections.abc import Collection, Mapping

from vrdp_prob.discovery.checks.bodies import REBOUND
from vrdp_prob.discovery.checks.contacts import RUBBING
from vrdp_prob.discovery.page.contact_figures import CONTACT_FIGURES, restitution_of_pairs, tangential_impulses
from vrdp_prob.discovery.page.flight_figures import FLIGHT_FIGURES
from vrdp_prob.discovery.page.friction_figures import FRICTION_FIGURES
from vrdp_prob.discovery.page.measurement_figures import MEASUREMENT_FIGURES
from vrdp_prob.discovery.page.plots import AFTER, BEFORE
from vrdp_prob.discovery.page.residual_panels import RESIDUAL_FIGURES
from vrdp_prob.discovery.page.seen import Figure, Seen
from vrdp_prob.discovery.page.window_figures import acceleration_curves, acceleration_map
from vrdp_prob.discovery.residuals.contact_patterns import AT_CONTACTS
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.plain_words import sentence

NAMES = ("the model that was given", "the extended model")
OVER_THE_PLANE, AGAINST_SPEED, AGAINST_TIME = (
    f"Missing acceleration {words}" for words in ("over the plane", "against speed", "against time")
)
ALWAYS: Mapping[str, Figure] = {
    OVER_THE_PLANE: acceleration_map,
    AGAINST_SPEED: lambda seen: acceleration_curves(seen, "speed (m/s)", lambda windows: windows.speed),
    AGAINST_TIME: lambda seen: acceleration_curves(seen, "time (s)", lambda windows: windows.time),
    sentence(REBOUND): restitution_of_pairs,
    sentence(RUBBING): lambda seen: tangential_impulses(seen, AT_CONTACTS),
}
"""Figures that are there whatever fails, by their titles."""
SHOWN_BY: Mapping[str, str] = {
    "push in one direction": OVER_THE_PLANE,
    "push against place": OVER_THE_PLANE,
    "acceleration along the velocity against speed": AGAINST_SPEED,
    "acceleration across the velocity against speed": AGAINST_SPEED,
    "acceleration along the velocity against time": AGAINST_TIME,
    "acceleration across the velocity against time": AGAINST_TIME,
    REBOUND: sentence(REBOUND),
    RUBBING: sentence(RUBBING),
}
"""Which of them shows what a check is about, by its name."""
WHERE_CHECKS_FAIL: Mapping[str, Figure] = {
    **FLIGHT_FIGURES,
    **CONTACT_FIGURES,
    **FRICTION_FIGURES,
    **RESIDUAL_FIGURES,
    **MEASUREMENT_FIGURES,
}
"""Figures of what the other checks are about, by their names."""


def residual_figures(before: SharedFit, after: SharedFit | None, *, failing: Collection[str] = ()) -> dict[str, str]:
    """Figures of what a model misses, and of what is left when it is extended.

    Parameters
    ----------
    before
        Fit of the model that was given.
    after
        Fit of the extended model; None where nothing was added.
    failing
        Names of the checks that fail: each has a figure.

    Returns
    -------
    SVG elements by their titles, in the colours of the page that they stand in.
    """
    seen = [Seen(before, BEFORE, NAMES[0])] + ([Seen(after, AFTER, NAMES[1])] if after is not None else [])
    figures = {title: figure(seen) for title, figure in ALWAYS.items()}
    figures |= {title_of(name): figure(seen) for name, figure in WHERE_CHECKS_FAIL.items() if name in failing}
    return {title: element for title, element in figures.items() if element}


def title_of(check: str) -> str:
    """Title of the figure that shows what a check is about, which is there where the check fails."""
    return SHOWN_BY.get(check, sentence(check))
