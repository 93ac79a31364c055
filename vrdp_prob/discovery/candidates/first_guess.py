"""Where a refit with a cause begins."""

from collections.abc import Mapping
from dataclasses import dataclass

from vrdp_prob.models.effects.effect import Effect


@dataclass(frozen=True)
class Site:
    """Where and when an effect acts that happens once in a video.

    Parameters
    ----------
    video
        Index of the video.
    owner
        Index of the body; None where it concerns the whole video.
    values
        First guess of its parameters in their units.
    chi_square, p_value
        The statistic, and the probability of one as large at any time if there is nothing.
    """

    video: int
    owner: int | None
    values: Mapping[str, float]
    chi_square: float
    p_value: float


@dataclass(frozen=True)
class FirstGuess:
    """Where a refit with a cause begins.

    Parameters
    ----------
    effect
        The cause.
    start
        First guess of its shared parameters, in their units.
    sites
        Where it acts, if it happens once in a video, the clearest first.
    places
        Number of bodies or videos among which the sites were chosen.
    other_starts
        Further first guesses, at other sizes of the cause that promise nearly as much.
    """

    effect: Effect
    start: Mapping[str, float]
    sites: tuple[Site, ...] = ()
    places: int = 1
    other_starts: tuple[Mapping[str, float], ...] = ()
