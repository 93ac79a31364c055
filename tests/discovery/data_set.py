"""Measured data sets with hidden causes: drawn from a seed, of a wanted effect size, written without the truth.

data = draw([Wanted("surface_tilt", effect_size=3.0)], seed=1)
truth = data.write(folder)  # `vrdp-prob discover folder` shall find what truth.causes names
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Bool
from scipy.optimize import brentq

from tests.discovery.causes import Cause, Videos
from tests.discovery.measurement import Measurement, measure
from tests.discovery.other_effects import ALL
from tests.discovery.refit import Freedom, Leftover, leftover
from tests.discovery.scenes import Setting, draw_videos
from tests.discovery.videos import UnendingMotionError, recorded
from vrdp_prob.datasets import write_folder
from vrdp_prob.scene import Tracks

NEAR_ENOUGH = 0.02
"""Relative error of the effect size, or of the strength, at which the search for a strength ends."""
WEAKEST = 1e-4
"""Smallest share of the largest strength that the search tries."""
ORDERS_FRICTION = ("mass_dependent_friction", "material_friction")
"""Causes that leave nothing where the refit gives each body a friction of its own."""
ORDERS_RESTITUTION = ("speed_dependent_restitution", "restitution_between_walls", "sticky_contacts")
"""Causes that leave (almost) nothing where the refit gives each body a restitution of its own."""


@dataclass(frozen=True)
class HiddenCause:
    """One hidden cause.

    Parameters
    ----------
    name
        Name that is to be found; for an effect outside the catalogue a name that is not in it.
    way
        Name of the function that hides it, which differs from `name` for variants of a cause.
    catalogued
        Whether it is in the catalogue.
    strength, unit
        Its strength and the unit.
    left
        What this cause alone leaves after the refit.
    trace
        By how much it changes a track beside the other causes: the largest root mean square of those of all bodies, in
        units of the noise.
    """

    name: str
    way: str
    catalogued: bool
    strength: float
    unit: str
    left: Leftover
    trace: float

    @property
    def effect_size(self) -> float:
        """Residual in the affected motion after the refit, in units of the noise."""
        return self.left.size


@dataclass(frozen=True)
class Truth:
    """What the data do not tell.

    Parameters
    ----------
    causes
        The hidden causes, none in a null.
    videos
        The videos with all true numbers (laws, hidden things, masses, ...) and their exact motion.
    setting, measurement, seed
        What they were drawn from.
    outliers
        Which observations are outliers, for each video an array (time, body).
    """

    causes: tuple[HiddenCause, ...]
    videos: Videos
    setting: Setting
    measurement: Measurement
    seed: int
    outliers: tuple[Bool[np.ndarray, "time body"], ...]


@dataclass(frozen=True)
class DataSet:
    """What is measured, and the truth."""

    tracks: list[Tracks]
    truth: Truth

    def write(self, folder: Path | str) -> Truth:
        """Write the tracks folder, which tells nothing of the truth, and return the truth."""
        write_folder(folder, self.tracks)
        return self.truth


@dataclass(frozen=True)
class Wanted:
    """A cause to hide, by its strength or by its effect size in units of the noise (exactly one of them)."""

    way: str
    strength: float | None = None
    effect_size: float | None = None

    def __post_init__(self) -> None:
        if self.way not in ALL:
            raise ValueError(f"'{self.way}' is not a cause; there are {', '.join(ALL)}.")
        if (self.strength is None) == (self.effect_size is None):
            raise ValueError("give either a strength or an effect size.")


@dataclass(frozen=True)
class _Seeds:
    """Independent seeds of the parts of a data set, so that one does not change with another."""

    scenes: int
    details: tuple[int, ...] = field(default_factory=tuple)
    noise: int = 0


@dataclass(frozen=True)
class _Drawn:
    """A cause with its directions, places and times."""

    cause: Cause
    strength: float
    detail: int
    left: Leftover

    def hide(self, videos: Videos) -> Videos:
        """The videos with the cause."""
        return self.cause.hide(videos, self.strength, np.random.default_rng(self.detail))


def draw(
    wanted: Sequence[Wanted] = (),
    *,
    seed: int,
    setting: Setting | None = None,
    measurement: Measurement | None = None,
) -> DataSet:
    """A data set; without a wanted cause a null.

    Parameters
    ----------
    wanted
        Causes to hide, none, one or several; a strength that is asked for by its effect size is found for each alone.
    seed
        Of everything that is drawn. The same seed gives the same scenes whatever is hidden in them.
    setting
        What kind of videos.
    measurement
        How they are measured.
    """
    setting, measurement = setting or Setting(), measurement or Measurement()
    seeds = _seeds(seed, len(wanted))
    plain = draw_videos(setting, np.random.default_rng(seeds.scenes))
    drawn = [_drawn(wish, plain, one, measurement) for wish, one in zip(wanted, seeds.details, strict=True)]
    videos = _hidden_in(plain, drawn)
    causes = tuple(
        HiddenCause(
            one.cause.name,
            wish.way,
            one.cause.catalogued,
            one.strength,
            one.cause.unit,
            one.left,
            _trace(videos, _hidden_in(plain, [other for other in drawn if other is not one]), measurement.noise),
        )
        for wish, one in zip(wanted, drawn, strict=True)
    )
    generator = np.random.default_rng(seeds.noise)
    measured = [measure(video, f"v{k + 1:02d}", measurement, generator) for k, video in enumerate(videos)]
    truth = Truth(causes, videos, setting, measurement, seed, tuple(wrong for _, wrong in measured))
    return DataSet([tracks for tracks, _ in measured], truth)


def _drawn(wish: Wanted, plain: Videos, detail: int, measurement: Measurement) -> _Drawn:
    """A cause with its directions, places and times, as strong as is wished."""
    yardstick = Yardstick(wish.way, plain, detail, measurement)
    strength = wish.strength if wish.effect_size is None else yardstick.strength_for(wish.effect_size)
    assert strength is not None
    return _Drawn(ALL[wish.way], strength, detail, yardstick.left_by(strength))


def _hidden_in(videos: Videos, causes: Sequence[_Drawn]) -> Videos:
    """Videos with some causes; those that are put where bodies go come last, when bodies go there."""
    for one in sorted(causes, key=lambda one: one.cause.placed):
        videos = one.hide(videos)
    return videos


def _trace(videos: Videos, without: Videos, noise: float) -> float:
    """Largest root mean square distance of the tracks of a body in two kinds of videos, in units of the noise."""
    apart = [
        recorded(one, one.motion.states[..., :2]) - recorded(other, other.motion.states[..., :2])
        for one, other in zip(videos, without, strict=True)
    ]
    return max(float(np.sqrt((one**2).sum(axis=-1).mean(axis=0)).max()) for one in apart) / noise


@dataclass(frozen=True)
class Yardstick:
    """Effect size of one cause in given videos as a function of its strength.

    Parameters
    ----------
    way
        Name of the cause or variant.
    plain
        Videos with nothing hidden.
    detail
        Seed of the cause's directions, places and times.
    measurement
        How the videos are measured: the unit is its noise, and masses that are stated are not refitted.
    """

    way: str
    plain: Videos
    detail: int
    measurement: Measurement

    def left_by(self, strength: float) -> Leftover:
        """What the cause leaves in the tracks after the base motion is refitted."""
        hidden = ALL[self.way].hide(self.plain, strength, np.random.default_rng(self.detail))
        freedom = Freedom(
            own_mass=not self.measurement.masses,
            own_friction=self.way not in ORDERS_FRICTION,
            own_restitution=self.way not in ORDERS_RESTITUTION,
        )
        return leftover(hidden, self.plain, self.measurement.noise, freedom)

    def strength_for(self, effect_size: float) -> float:
        """Strength at which the cause leaves a wanted residual, in units of the noise.

        It is searched between the cause's `least` and `most`. Where no strength leaves as much, or none as little, the
        one that comes nearest is returned, and where the residual jumps (a contact more or less), the place of the
        jump: so look at the effect size that was reached, which the truth states.
        """
        cause = ALL[self.way]

        def strength(coordinate: float) -> float:
            return cause.least + (cause.most - cause.least) * float(np.exp(coordinate))

        def excess(coordinate: float) -> float:
            try:
                size = self.left_by(strength(coordinate)).size
            except UnendingMotionError:
                return 5.0
            found = float(np.log(max(size, 1e-3) / effect_size))
            return 0.0 if abs(found) < NEAR_ENOUGH else found

        weakest, strongest = float(np.log(WEAKEST)), 0.0
        if excess(weakest) > 0 or excess(strongest) < 0:
            tried = [(excess(coordinate), coordinate) for coordinate in (weakest, -2.8, -2.1, -1.4, -0.7, strongest)]
            if max(tried)[0] < 0 or min(tried)[0] > 0:
                return strength(min(tried, key=lambda pair: abs(pair[0]))[1])
            weakest, strongest = min(tried)[1], max(tried)[1]
        return strength(brentq(excess, weakest, strongest, xtol=NEAR_ENOUGH, rtol=1e-6))


def _seeds(seed: int, causes: int) -> _Seeds:
    numbers = [int(child.generate_state(1)[0]) for child in np.random.SeedSequence(seed).spawn(2 + causes)]
    return _Seeds(scenes=numbers[0], details=tuple(numbers[2:]), noise=numbers[1])
