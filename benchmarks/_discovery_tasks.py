"""What is hidden in the data sets of `benchmarks/discovery.py`."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import _project  # noqa: F401  the generator belongs to the tests, which lie beside the package

from tests.discovery.causes import CATALOGUE, VARIANTS
from tests.discovery.data_set import DataSet
from tests.discovery.hidden import MET_OFTEN, ROUGH
from tests.discovery.measurement import Measurement
from tests.discovery.other_effects import OTHERS
from tests.discovery.scales import scaled
from tests.discovery.scenes import Setting
from vrdp_prob import load_all
from vrdp_prob.scene import Tracks

SIZES = (1.5, 3.0, 6.0)
"""Effect sizes at which single causes are hidden."""
STRONG = 6.0
"""Effect size of what has no name in the catalogue, or whose name is taken out of it."""
TOGETHER = 4.0
"""Effect size of each of two causes."""
HARDLY = 0.05
"""Share of the usual friction and drag of a table that hardly brakes."""
PAIRS = (
    ("surface_tilt", "linear_drag"),
    ("surface_tilt", "contact_radius_error"),
    ("bowl", "contact_friction"),
    ("wind", "lens_distortion"),
    ("rotating_table", "time_varying_friction"),
    ("pair_force", "slip_to_roll"),
    ("magnus_curl", "surface_tilt"),
    ("linear_drag", "clock_error"),
    ("surface_tilt", "external_impulse"),
    ("wall", "linear_drag"),
    ("hidden_obstacle", "surface_tilt"),
    ("friction_patch", "rotating_table"),
    ("material_friction", "bowl"),
    ("speed_dependent_restitution", "linear_drag"),
    ("mass_dependent_friction", "surface_tilt"),
)
"""Causes that are hidden two at a time; every cause is in one pair at least."""


class Kind(StrEnum):
    """Kinds of tasks."""

    ONE = "one cause"
    TWO = "two causes"
    NULL = "null"
    ROUGH_NULL = "null, outliers and dropouts"
    GLIDING_NULL = "null, a table that hardly brakes"
    OUTSIDE = "outside the catalogue"
    REMOVED = "removed from the catalogue"


@dataclass(frozen=True)
class Table:
    """On which scale, and how, all videos of a task are filmed.

    Parameters
    ----------
    length, time
        Factors by which all lengths and times of the tracks, and so the noise, are multiplied: 0.1 and 0.316 make a
        table of marbles, on which gravity is the same.
    frame_rate
        Frames per second before that, of 4 s.
    noise
        Standard deviation in m of a coordinate before that.
    """

    length: float = 1.0
    time: float = 1.0
    frame_rate: float = Setting.frame_rate
    noise: float = Measurement.noise

    @property
    def is_of_usual_scale(self) -> bool:
        """Whether lengths and times are those of the motion that was drawn."""
        return self.length == self.time == 1.0

    def __str__(self) -> str:
        usual = Table()
        told = [
            f"{name} {getattr(self, name):g}"
            for name in ("length", "time", "frame_rate", "noise")
            if getattr(self, name) != getattr(usual, name)
        ]
        return "".join(f", {one.replace('_', ' ')}" for one in told)


@dataclass(frozen=True)
class Task:
    """A data set to draw and to search.

    Parameters
    ----------
    kind
        What is asked.
    ways
        What is hidden.
    effect_size
        Of each of them, in units of the noise.
    seed
        Of the data.
    videos, bodies
        Numbers of videos, and of bodies in each.
    table
        On which scale, and how, they are filmed.
    """

    kind: Kind
    ways: tuple[str, ...]
    effect_size: float
    seed: int
    videos: int = 12
    bodies: int = 4
    table: Table = Table()

    @property
    def name(self) -> str:
        """The task in words, by which its result is found again."""
        what = "+".join(self.ways) or "nothing"
        videos = f"{self.videos} videos x {self.bodies}"
        return f"{self.kind}: {what}, size {self.effect_size:g}, {videos}, seed {self.seed}{self.table}"


def tasks(
    *,
    causes: Sequence[str] | None = None,
    sizes: Sequence[float] = SIZES,
    seeds: int = 3,
    nulls: int = 60,
    videos: int = 12,
    bodies: int = 4,
    table: Table | None = None,
) -> list[Task]:
    """The grid, seed by seed, so that a run that is cut short has seen some of everything.

    Parameters
    ----------
    causes
        What may be hidden, of the catalogue, of its variants and outside it; None for everything.
    sizes
        Effect sizes of single causes.
    seeds
        Data sets of each cause and size, of each pair and of each effect outside the catalogue.
    nulls
        Data sets with nothing hidden, every other one with outliers and dropouts; a third as many more are of tables
        that hardly brake.
    videos, bodies
        Numbers of videos, and of bodies in each.
    table
        On which scale, and how, they are filmed; the usual one where None.
    """
    chosen = set(causes if causes is not None else (*CATALOGUE, *VARIANTS, *OTHERS))
    single = [way for way in (*CATALOGUE, *VARIANTS) if way in chosen]
    pairs = [pair for pair in PAIRS if chosen.issuperset(pair)]
    rounds: list[list[Task]] = []
    for seed in range(1, seeds + 1):
        found = [
            Task(Kind.ONE, (way,), size, seed)
            for size in sorted(sizes, reverse=True)
            for way in single
            if size == max(sizes) or way not in MET_OFTEN  # which never leave little
        ]
        found += [Task(Kind.TWO, pair, TOGETHER, seed) for pair in pairs]
        found += [Task(Kind.OUTSIDE, (way,), STRONG, seed) for way in OTHERS if way in chosen]
        if seed == 1:
            found += [Task(Kind.REMOVED, (way,), STRONG, seed) for way in single]
        rounds.append(found)
    empty = [Task((Kind.NULL, Kind.ROUGH_NULL)[k % 2], (), 0.0, k // 2 + 1) for k in range(nulls)]
    empty += [Task(Kind.GLIDING_NULL, (), 0.0, k + 1) for k in range(nulls // 3)]
    share = -(-len(empty) // max(seeds, 1))
    listed = [task for k, found in enumerate(rounds) for task in (*found, *empty[k * share : (k + 1) * share])]
    found = listed if rounds else empty
    return [replace(task, videos=videos, bodies=bodies, table=table or Table()) for task in found]


def setting(task: Task) -> Setting:
    """What kind of videos a data set is made of."""
    resistance = HARDLY if task.kind is Kind.GLIDING_NULL else 1.0
    usual, rate = Setting(), task.table.frame_rate
    frames = round(usual.frames * rate / usual.frame_rate)
    return Setting(videos=task.videos, bodies=task.bodies, frames=frames, frame_rate=rate, resistance=resistance)


def measurement(task: Task) -> Measurement:
    """How the videos of a data set are measured."""
    return replace(ROUGH if task.kind is Kind.ROUGH_NULL else Measurement(), noise=task.table.noise)


def handed_over(data: DataSet, table: Table | None = None) -> list[Tracks]:
    """What discovery gets of a data set: its tracks, on the scale of a table, written and read again."""
    if table is not None:
        tracks = [scaled(one, length=table.length, time=table.time) for one in data.tracks]
        data = replace(data, tracks=tracks)
    with tempfile.TemporaryDirectory() as folder:
        data.write(folder)
        return load_all(folder)
