"""A video after which it is open whether a second collision follows a first one: that hangs on a ratio of masses."""

from sliding_discs import Disc, KnownPosterior, tracks_of

FRAMES = 26
MASS_SPREAD = 0.3
"""Standard deviation of the logarithm of each mass."""

DISCS = (Disc((-1.96, 0.0), (2.2, 0.0)), Disc((0.0, 0.0), (0.9, 0.0)), Disc((3.65, 0.0)))
"""After the video disc 0 hits disc 1 for sure, which reaches disc 2 if it is not too heavy."""

QUESTION = "What will happen next?"
SURE = "The red object collides with the blue object"
OPEN = "The blue object collides with the green object"


def posterior(**options: object) -> KnownPosterior:
    """What is known of the discs; the masses only roughly unless the options say otherwise."""
    return KnownPosterior(tracks_of(DISCS, FRAMES), DISCS, **{"mass_spread": MASS_SPREAD, **options})  # type: ignore[arg-type]
