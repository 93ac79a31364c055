"""The most probable values (MAP) of a video: local fits, a growing window, then everything that matters at once.

L-BFGS on the exact gradient and Levenberg-Marquardt on the residuals climb the same density; see
`docs/decisions/0020-map-by-growing-windows.md` for which is faster.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float
from scipy.optimize import minimize as scipy_minimize

from vrdp_prob.errors import InputError
from vrdp_prob.inference.clues import Clues
from vrdp_prob.inference.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.events import first_contacts
from vrdp_prob.inference.free_flight import SeenContact
from vrdp_prob.inference.growing_fit import GrowingFit
from vrdp_prob.inference.least_squares import jacobian
from vrdp_prob.inference.misfit import Misfit, judge
from vrdp_prob.inference.mode import Mode
from vrdp_prob.inference.model_error_fit import fit_model_error
from vrdp_prob.inference.noise_fit import noise_curvature, noise_sd
from vrdp_prob.inference.samples import Gaussian, evaluate
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.noise import NoiseFamily
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import NOISE, Structure, unknowns
from vrdp_prob.progress import ProgressDisplay, SilentProgress
from vrdp_prob.scene import Tracks

WINDOW = 8
"""Frames by which the window grows."""
MODEL_ERROR_ROUNDS = 2
"""Times that the model error and the fit are found in turn."""
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
    noise: NoiseFamily | None = None,
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
    noise
        Distribution of the measurement errors; where None, Student-t if the tracks show gross outliers, else Gaussian.
    climb
        Whether L-BFGS on the exact log posterior follows the least squares.

    Raises
    ------
    InputError
        If no object moves.
    """
    clues = Clues.of(tracks)
    if not clues.moving and not clues.contacts:
        raise InputError(f"{tracks.video}: no object moves, so nothing can be inferred; give tracks with motion.")
    family = clues.noise_family if noise is None else noise
    growing = _grow(clues, model, family, generator, progress)
    pairs = _pairs(growing.likelihood, growing.point)
    structure = Structure(moving=clues.moving, colliding=frozenset(body for pair in pairs for body in pair))
    reduced = Likelihood(tracks, model, unknowns(tracks, model, structure, family), family)
    final = GrowingFit(reduced, _carry(growing.likelihood, growing.point, reduced), clues.contacts, generator)
    final.finish()
    misfit = judge(reduced, final.point, clues.noise, int(clues.outliers.sum()))
    evaluations = growing.evaluations + final.evaluations
    for _ in range(MODEL_ERROR_ROUNDS):
        error = fit_model_error(final.likelihood, final.point)
        if error is None:
            break
        coordinates = unknowns(tracks, model, structure)
        widened = Likelihood(tracks, model, coordinates, NoiseFamily.GAUSSIAN, error)
        final = GrowingFit(widened, _carry(final.likelihood, final.point, widened), clues.contacts, generator)
        final.finish()
        evaluations += final.evaluations
        misfit = misfit.with_error(error, noise_sd(widened, final.point))
    point, log_density, converged = _climb(final.likelihood, final.point, LBFGS_ITERATIONS if climb else 0)
    _, derivative = jacobian(final.likelihood.residuals, point, final.likelihood.coordinates.scale, central=True)
    precision = _with_noise(final.likelihood, point, derivative)
    return MapFit(
        final.likelihood,
        (Mode(point, precision, log_density),),
        final.converged or converged,
        clues.contacts,
        clues.noise,
        misfit,
        evaluations,
    )


def _grow(
    clues: Clues,
    model: PhysicsModel,
    noise: NoiseFamily,
    generator: np.random.Generator,
    progress: ProgressDisplay | None,
) -> GrowingFit:
    """Fit windows that grow to the whole video, with everything that might matter among the unknowns."""
    tracks = clues.tracks
    everything = frozenset(body for body, one in enumerate(tracks.bodies) if one.radius is not None)
    structure = Structure(moving=clues.moving, colliding=everything)
    likelihood = Likelihood(tracks, model, unknowns(tracks, model, structure, noise), noise)
    growing = GrowingFit(likelihood, _start(likelihood, clues), clues.contacts, generator)
    growing.trust_release_fits(
        {body: (clues.noise, clues.release(body).velocity_sd) for body in range(len(tracks.bodies))}
    )
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


def _start(likelihood: Likelihood, clues: Clues) -> Float[np.ndarray, "dimension"]:
    """Release states of local fits, everything else at the mean of its prior."""
    coordinates = likelihood.coordinates
    start = coordinates.prior_mean.copy()
    for body in range(len(likelihood.tracks.bodies)):
        fit = clues.release(body)
        values = dict(zip(("x", "y", "velocity_x", "velocity_y"), (*fit.position, *fit.velocity), strict=True))
        values["spin"] = clues.release_spin(body)
        for field, value in values.items():
            place = coordinates.places.get((field, body))
            if place is not None:
                start[place] = value
    start[coordinates.places[NOISE, None]] = np.log(clues.noise / likelihood.observations.position_reference)
    return start


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
