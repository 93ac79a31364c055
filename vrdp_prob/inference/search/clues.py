"""What a video shows before anything is simulated: noise, outliers, contacts, resting bodies, release states."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.inference.search.free_flight import (
    Approach,
    LocalFit,
    SeenContact,
    approaches,
    local_fit,
    release_fit,
    seen_contacts,
)
from vrdp_prob.inference.search.outliers import gross_outliers, without
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.observation import prior_noise
from vrdp_prob.models.roughness import noise_scale, position_sd, untold_noise
from vrdp_prob.scene import Tracks

SIGNIFICANT = 5.0
"""A body moves if its speed, or its way, is so many standard deviations."""
REST_TEST = 3.0
"""A body rests until its first contact if its scatter about one place exceeds the noise by less than so many sd."""
REST_LOOK = 0.6
"""Time in s after its release for which a body that rests must at least stay where it is."""
MOST_STARTS = 64
"""Times at which a body that stays at first is tried to set off."""
SHORTEST_REST_TEST = 6
"""Degrees of freedom (two per position) below which a scatter says nothing."""
STILL_ANGLE_SD = 0.06
"""Scatter (rad) of measured angles up to which a body does not turn; shadows and occlusion let angles drift."""

ACCELERATION_SPAN = 0.5
"""Length in s of the stretches over which accelerations are looked at."""


@dataclass(frozen=True)
class Clues:
    """What local fits and scatters say about a video.

    Parameters
    ----------
    tracks
        What was seen.
    outliers
        Which positions lie far off those before and after.
    """

    tracks: Tracks
    outliers: Bool[np.ndarray, "time body"]

    @classmethod
    def of(cls, tracks: Tracks) -> "Clues":
        """The clues of a video."""
        return cls(tracks, gross_outliers(tracks, position_sd(tracks, _roughness(tracks))))

    @cached_property
    def clean(self) -> Tracks:
        """The tracks without outliers."""
        return without(self.tracks, self.outliers)

    @cached_property
    def noise(self) -> float:
        """Measurement noise (m)."""
        return _roughness(self.clean)

    @cached_property
    def position_sd(self) -> Float[np.ndarray, "time body"]:
        """Standard deviation (m) of each position per axis: the noise, or the stated ones where these are larger."""
        return position_sd(self.tracks, self.noise)

    @property
    def noise_family(self) -> NoiseFamily:
        """Distribution of the noise that the tracks call for."""
        return NoiseFamily.STUDENT_T if self.outliers.any() else NoiseFamily.GAUSSIAN

    @cached_property
    def contacts(self) -> tuple[SeenContact, ...]:
        """Contacts between bodies."""
        return seen_contacts(self.clean, self.noise)

    @cached_property
    def approaches(self) -> tuple[Approach, ...]:
        """Times at which two bodies may touch."""
        return approaches(self.clean, self.noise)

    @cached_property
    def moving(self) -> frozenset[int]:
        """Bodies that are not at rest when they are released."""
        return frozenset(body for body in range(len(self.tracks.bodies)) if not self._rests(body))

    @property
    def show_motion(self) -> bool:
        """Whether anything moves."""
        return bool(self.moving or self.contacts)

    @cached_property
    def acceleration(self) -> float:
        """Typical acceleration (m/s^2) of what moves, over stretches in which hardly any contact falls."""
        found = []
        half, times = ACCELERATION_SPAN / 2, self.clean.times
        passed = np.floor((times - times[0]) / half)
        middles = times[0] + half + half * np.unique(np.concatenate([passed - 1, passed]))
        for body in range(len(self.clean.bodies)):
            for middle in middles[(middles > times[0]) & (middles < times[-1])]:
                stretch = {"start": middle - half, "stop": middle + half, "noise": self.noise}
                fit = local_fit(self.clean, body, middle, **stretch)
                if fit is not None and np.linalg.norm(fit.velocity) > SIGNIFICANT * fit.velocity_sd:
                    found.append(float(np.linalg.norm(fit.acceleration)))
        least = self.noise / ACCELERATION_SPAN**2
        return max(float(np.median(found)), least) if found else least

    def first_contact(self, body: int) -> float:
        """Time (s) shortly before the first contact of a body; after the video where there is none."""
        step = float(np.median(np.diff(self.tracks.times)))
        times = [contact.time - step / 2 for contact in self.contacts if body in (contact.first, contact.second)]
        return min(times, default=float(self.tracks.times[-1]) + step)

    def release(self, body: int) -> LocalFit:
        """Position and velocity of a body when it is first seen."""
        start = float(self.tracks.first_seen[body])
        return release_fit(self.clean, body, self.noise, self.first_contact(body), start)

    def release_spin(self, body: int) -> float:
        """Spin in rad/s from the first measured angles; 0 where there are none."""
        angles = self.tracks.angles
        if angles is None:
            return 0.0
        chosen = np.flatnonzero(np.isfinite(angles[:, body]) & (self.tracks.times < self.first_contact(body)))[:12]
        if len(chosen) < 2:
            return 0.0
        return float(np.polyfit(self.tracks.times[chosen], angles[chosen, body], 1)[0])

    def _rests(self, body: int) -> bool:
        """Whether a body is at rest until its first contact, or at first and is then set off by what was not seen."""
        times, start, contact = self.tracks.times, float(self.tracks.first_seen[body]), self.first_contact(body)
        if self._stays(body, times < contact):
            return True
        look = start + REST_LOOK
        return self._stays(body, times < look) and (contact <= look or not self._drifts(body, look, contact))

    def _drifts(self, body: int, look: float, until: float) -> bool:
        """Whether a body is seen to move from its release on, though it stays within the noise for a while.

        It goes far beyond the noise, and no rest with a push after that while explains its positions better: a push
        that was not seen as a contact is one, too.
        """
        chosen = (self.tracks.times < until) & self.clean.seen[:, body]
        times, sd = self.tracks.times[chosen], self.position_sd[chosen, body, None]
        places = self.clean.positions[chosen, body] / sd
        pushes = times[times >= look]
        if not len(pushes):
            return False
        pushes = pushes[np.unique(np.linspace(0, len(pushes) - 1, MOST_STARTS).astype(int))]

        def moved(start: float) -> tuple[float, float]:
            """Squares that a motion from some time on leaves, in units of the noise, and how far (m) it leads."""
            since = np.maximum(times - start, 0.0)
            law = np.stack([np.ones_like(since), since, since**2], axis=1)
            found = np.linalg.lstsq(law / sd, places, rcond=None)[0]
            way = law[:, 1:] @ found[1:]
            return float(((places - law / sd @ found) ** 2).sum()), float(np.linalg.norm(np.ptp(way, axis=0)))

        drift, way = moved(float(times[0]))
        pushed = min(moved(start)[0] for start in pushes.tolist())
        return way > SIGNIFICANT * float(np.median(sd)) and pushed >= drift - REST_TEST**2

    def _stays(self, body: int, chosen: Bool[np.ndarray, "time"]) -> bool:
        """Whether positions and angles in some frames scatter about one value, and are enough to tell."""
        chosen = chosen & self.clean.seen[:, body]
        places = self.clean.positions[chosen, body]
        freedom = 2 * (len(places) - 1)
        if freedom < SHORTEST_REST_TEST:
            return False
        sd = self.position_sd[chosen, body, None]
        scatter = float((((places - np.average(places, axis=0, weights=sd[:, 0] ** -2)) / sd) ** 2).sum())
        angles = self.tracks.angles
        turning = 0.0 if angles is None else float(np.std(_finite(angles[chosen, body])))
        return bool(scatter <= freedom + REST_TEST * np.sqrt(2 * freedom)) and turning <= STILL_ANGLE_SD


def _roughness(tracks: Tracks) -> float:
    """Measurement noise (m) from the tracks alone; the prior's where they are too short to tell."""
    noise = untold_noise(tracks) or noise_scale(tracks)
    return noise if np.isfinite(noise) and noise > 0 else prior_noise(tracks)


def _finite(values: Float[np.ndarray, "seen"]) -> Float[np.ndarray, "finite"]:
    """The finite values, or a 0 where there is none."""
    finite = values[np.isfinite(values)]
    return finite if len(finite) else np.zeros(1)
