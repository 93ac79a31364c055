"""The most probable values (MAP) of a video: local fits, a growing window, then everything that matters at once.

L-BFGS on the exact gradient and Levenberg-Marquardt on the residuals climb the same density; see
`docs/decisions/0020-map-by-growing-windows.md` for which is faster.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.optimize import minimize as scipy_minimize

from vrdp_prob.errors import InputError
from vrdp_prob.inference.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.events import first_contacts
from vrdp_prob.inference.free_flight import SeenContact, noise_scale, release_fit, seen_contacts
from vrdp_prob.inference.growing_fit import GrowingFit
from vrdp_prob.inference.least_squares import jacobian
from vrdp_prob.inference.misfit import Misfit, judge
from vrdp_prob.inference.mode import Mode
from vrdp_prob.inference.noise_fit import noise_curvature
from vrdp_prob.inference.samples import Gaussian, evaluate
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.observation import prior_noise
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import NOISE, Structure, unknowns
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.scene import Tracks

WINDOW = 8
"""Frames by which the window grows."""
REST_TEST = 3.0
"""A body rests until its first contact if its scatter about one place exceeds the noise by less than so many sd."""
REST_LOOK = 0.6
"""Time in s after its release for which a body that rests must at least stay where it is."""
SHORTEST_REST_TEST = 6
"""Degrees of freedom (two per position) below which a scatter says nothing."""
STILL_ANGLE_SD = 0.06
"""Scatter (rad) of measured angles up to which a body does not turn; shadows and occlusion let angles drift."""
LBFGS_ITERATIONS = 30


@dataclass(frozen=True)
class MapFit:
    """The most probable values and the Gaussian around them.

    Parameters
    ----------
    likelihood
        The density, reduced to the unknowns that the motion says something about.
    modes
        Its modes that were found, best first; the first is the MAP.
    converged
        Whether the last refinement ended by itself.
    contacts
        Contacts seen in the tracks by local fits.
    noise
        Measurement noise (m) from the tracks alone.
    misfit
        How the residuals compare with it.
    evaluations
        Number of worlds simulated.
    """

    likelihood: Likelihood
    modes: tuple[Mode, ...]
    converged: bool
    contacts: tuple[SeenContact, ...]
    noise: float
    misfit: Misfit
    evaluations: int

    @property
    def point(self) -> Float[np.ndarray, "dimension"]:
        """The MAP."""
        return self.modes[0].point

    @property
    def precision(self) -> Float[np.ndarray, "dimension dimension"]:
        """Gauss-Newton curvature of the negative log posterior at the MAP."""
        return self.modes[0].precision

    @property
    def log_density(self) -> float:
        """Log posterior at the MAP."""
        return self.modes[0].log_density

    @cached_property
    def gaussian(self) -> CurvedGaussian:
        """Gaussian with the MAP as its mean and the Gauss-Newton covariance, bent as the posterior's ridges are."""
        return CurvedGaussian.around(Gaussian.from_precision(self.point, self.precision), self.likelihood.residuals)


def fit_map(
    tracks: Tracks,
    model: PhysicsModel,
    generator: np.random.Generator,
    progress: ProgressDisplay | None = None,
    *,
    climb: bool = True,
) -> MapFit:
    """Find the most probable values of a video.

    Parameters
    ----------
    tracks
        What was seen.
    model
        The physics.
    generator
        Source of the candidate worlds.
    progress
        Told how many windows are done.
    climb
        Whether L-BFGS on the exact log posterior follows the least squares.

    Raises
    ------
    InputError
        If no object moves.
    """
    noise = _noise(tracks)
    contacts = seen_contacts(tracks, noise)
    if not _moving(tracks, noise, contacts) and not contacts:
        raise InputError(f"{tracks.video}: no object moves, so nothing can be inferred; give tracks with motion.")
    growing = _grow(tracks, model, noise=noise, contacts=contacts, generator=generator, progress=progress)
    everything = growing.likelihood
    pairs = _pairs(everything, growing.point)
    structure = Structure(
        moving=_moving(tracks, noise, contacts), colliding=frozenset(body for pair in pairs for body in pair)
    )
    reduced = Likelihood(tracks, model, unknowns(tracks, model, structure))
    start = _carry(everything, growing.point, reduced)
    final = GrowingFit(reduced, start, contacts, generator)
    final.finish()
    misfit = _misfit(reduced, final.point, noise)
    if not (misfit.fits and misfit.independent):
        final.likelihood = reduced.informed(1 / misfit.memory)
        final.finish()
    point, log_density, converged = _climb(final.likelihood, final.point, LBFGS_ITERATIONS if climb else 0)
    _, derivative = jacobian(final.likelihood.residuals, point, final.likelihood.coordinates.scale, central=True)
    precision = _with_noise(final.likelihood, point, derivative)
    evaluations = growing.evaluations + final.evaluations
    return MapFit(
        final.likelihood,
        (Mode(point, precision, log_density),),
        final.converged or converged,
        contacts,
        noise,
        misfit,
        evaluations,
    )


def _noise(tracks: Tracks) -> float:
    """Measurement noise (m) from the tracks alone; the prior's where they are too short to tell."""
    noise = noise_scale(tracks)
    return noise if np.isfinite(noise) and noise > 0 else prior_noise(tracks)


def _moving(tracks: Tracks, noise: float, contacts: tuple[SeenContact, ...]) -> frozenset[int]:
    """Bodies that are not at rest when they are released."""
    moving = set()
    for body in range(len(tracks.bodies)):
        start = float(tracks.first_seen[body])
        until = (_first_contact(tracks, body, contacts), start + REST_LOOK)
        if not any(_stays(tracks, body, noise, tracks.times < end) for end in until):
            moving.add(body)
    return frozenset(moving)


def _stays(tracks: Tracks, body: int, noise: float, chosen: Bool[np.ndarray, "time"]) -> bool:
    """Whether the positions and angles of a body in some frames scatter about one value, and are enough to tell."""
    chosen = chosen & tracks.seen[:, body]
    places = tracks.positions[chosen, body]
    freedom = 2 * (len(places) - 1)
    if freedom < SHORTEST_REST_TEST:
        return False
    sd = _position_sd(tracks, body, noise)[chosen, None]
    scatter = float((((places - np.average(places, axis=0, weights=sd[:, 0] ** -2)) / sd) ** 2).sum())
    turning = 0.0 if tracks.angles is None else float(np.std(_finite(tracks.angles[chosen, body])))
    return bool(scatter <= freedom + REST_TEST * np.sqrt(2 * freedom)) and turning <= STILL_ANGLE_SD


def _position_sd(tracks: Tracks, body: int, noise: float) -> Float[np.ndarray, "time"]:
    """Standard deviation (m) per axis: the stated one where it is larger, since errors that last look like motion."""
    if tracks.position_covariance is None:
        return np.full(len(tracks.times), noise)
    stated = np.trace(tracks.position_covariance[:, body], axis1=-2, axis2=-1) / 2
    return np.sqrt(np.fmax(stated, noise**2))


def _finite(values: Float[np.ndarray, "seen"]) -> Float[np.ndarray, "finite"]:
    """The finite values, or a 0 where there is none."""
    finite = values[np.isfinite(values)]
    return finite if len(finite) else np.zeros(1)


def _first_contact(tracks: Tracks, body: int, contacts: tuple[SeenContact, ...]) -> float:
    """Time (s) shortly before the first contact of a body that shows in the tracks."""
    step = float(np.median(np.diff(tracks.times)))
    times = [contact.time - step / 2 for contact in contacts if body in (contact.first, contact.second)]
    return min(times, default=float(tracks.times[-1]) + step)


def _grow(
    tracks: Tracks,
    model: PhysicsModel,
    *,
    noise: float,
    contacts: tuple[SeenContact, ...],
    generator: np.random.Generator,
    progress: ProgressDisplay | None,
) -> GrowingFit:
    """Fit windows that grow to the whole video, with everything that might matter among the unknowns."""
    everything = frozenset(body for body, one in enumerate(tracks.bodies) if one.radius is not None)
    structure = Structure(moving=_moving(tracks, noise, contacts), colliding=everything)
    likelihood = Likelihood(tracks, model, unknowns(tracks, model, structure))
    growing = GrowingFit(likelihood, _start(likelihood, noise, contacts), contacts, generator)
    growing.trust_release_fits({body: _release_sd(tracks, body, noise, contacts) for body in range(len(tracks.bodies))})
    ends = _windows(tracks)
    with (progress or SilentProgress()).stage("Fitting the motion (MAP)", total=len(ends)) as advance:
        previous = 0
        for end in ends:
            growing.grow(end, previous)
            previous = end
            advance(1)
    return growing


def _windows(tracks: Tracks) -> list[int]:
    """Frame counts of the growing windows, the whole video last."""
    count = len(tracks.times)
    first = int(np.argmax(tracks.seen.any(axis=1)))
    ends = list(range(first + WINDOW, count, WINDOW))
    return [*ends, count]


def _release_sd(tracks: Tracks, body: int, noise: float, contacts: tuple[SeenContact, ...]) -> tuple[float, float]:
    """Standard deviations of release position (m) and velocity (m/s) of a body as its local fit knows them."""
    return noise, release_fit(tracks, body, noise, _first_contact(tracks, body, contacts)).velocity_sd


def _start(likelihood: Likelihood, noise: float, contacts: tuple[SeenContact, ...]) -> Float[np.ndarray, "dimension"]:
    """Release states of local fits, everything else at the mean of its prior."""
    tracks, coordinates = likelihood.tracks, likelihood.coordinates
    start = coordinates.prior_mean.copy()
    for body in range(len(tracks.bodies)):
        fit = release_fit(tracks, body, noise, _first_contact(tracks, body, contacts))
        values = dict(zip(("x", "y", "velocity_x", "velocity_y"), (*fit.position, *fit.velocity), strict=True))
        values["spin"] = _first_spin(tracks, body, _first_contact(tracks, body, contacts))
        for field, value in values.items():
            place = coordinates.places.get((field, body))
            if place is not None:
                start[place] = value
    start[coordinates.places[NOISE, None]] = np.log(noise / likelihood.observations.position_reference)
    return start


def _first_spin(tracks: Tracks, body: int, until: float) -> float:
    """Spin in rad/s from the first measured angles; 0 where there are none."""
    if tracks.angles is None:
        return 0.0
    angles = tracks.angles[:, body]
    chosen = np.flatnonzero(np.isfinite(angles) & (tracks.times < until))[:12]
    if len(chosen) < 2:
        return 0.0
    return float(np.polyfit(tracks.times[chosen], angles[chosen], 1)[0])


def _pairs(likelihood: Likelihood, point: Float[np.ndarray, "dimension"]) -> set[tuple[int, int]]:
    """Pairs that collide at a point."""
    with torch.no_grad():
        return set(first_contacts(likelihood.rollout(torch.from_numpy(point[None])), 0))


def _carry(
    source: Likelihood, point: Float[np.ndarray, "dimension"], target: Likelihood
) -> Float[np.ndarray, "target_dimension"]:
    """The same values in the vector of another structure."""
    places = source.coordinates.places
    entries = target.coordinates.entries
    return np.array([point[places[entry.field, entry.owner]] for entry in entries])


def _misfit(likelihood: Likelihood, point: Float[np.ndarray, "dimension"], noise: float) -> Misfit:
    with torch.no_grad():
        trajectory = likelihood.rollout(torch.from_numpy(point[None])).trajectory
    return judge(likelihood.tracks, trajectory[0, :, :, :2].numpy(), noise)


def _climb(
    likelihood: Likelihood, start: Float[np.ndarray, "dimension"], iterations: int
) -> tuple[Float[np.ndarray, "dimension"], float, bool]:
    """Climb the log posterior by L-BFGS in whitened coordinates; never ends lower than it began."""
    if not iterations:
        return start, float(evaluate(likelihood.log_density, start[None])[0]), False
    _, derivative = jacobian(likelihood.residuals, start, likelihood.coordinates.scale)
    gaussian = Gaussian.from_precision(start, _with_noise(likelihood, start, derivative))
    mean, root = torch.from_numpy(gaussian.mean), torch.from_numpy(gaussian.root)

    def descend(whitened: Float[np.ndarray, "dimension"]) -> tuple[float, Float[np.ndarray, "dimension"]]:
        position = torch.from_numpy(whitened).requires_grad_()
        value = -likelihood.log_density((mean + root @ position)[None])[0]
        if not bool(torch.isfinite(value)):
            return 1e30, np.zeros_like(whitened)
        (gradient,) = torch.autograd.grad(value, position)
        return float(value.detach()), np.nan_to_num(gradient.numpy())

    before, _ = descend(np.zeros(len(start)))
    result = scipy_minimize(
        descend,
        np.zeros(len(start)),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": iterations, "maxcor": 20, "ftol": 1e-10},
    )
    if result.fun < before:
        return gaussian.points(result.x), -float(result.fun), bool(result.success)
    return start, -before, False


def _with_noise(
    likelihood: Likelihood, point: Float[np.ndarray, "dimension"], derivative: Float[np.ndarray, "residual dimension"]
) -> Float[np.ndarray, "dimension dimension"]:
    """Gauss-Newton curvature, with that of the noise scales in place of what the residuals say of them."""
    precision = derivative.T @ derivative
    places, curvature = noise_curvature(likelihood, point)
    precision[places, :] = precision[:, places] = 0.0
    precision[np.ix_(places, places)] = curvature
    return precision
