"""Effects on the measurement: a clock that lies about the times, a lens that moves positions."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
import pytest
import torch

from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.lens_distortion import LensDistortion
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import Parameter, Prior, Transform
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import Structure, unknowns
from vrdp_prob.scene import Body, Shape, Tracks

PAUSE = Parameter("pause", "s", "time that no frame shows", Transform.IDENTITY, Prior(0.0, 0.2), 0.0)
BARREL = Parameter("barrel", "1/m^2", "distortion of the lens", Transform.IDENTITY, Prior(0.0, 0.1), 0.0)
FRAME, COUNT, SPEED = 0.04, 40, 0.8


class Pause(Effect):
    """Frames after 0.5 s are later than their stamps say."""

    name: ClassVar = "pause"
    parameters: ClassVar = (PAUSE,)

    def measured_times(self, times: torch.Tensor, parameters: Mapping[str, torch.Tensor]) -> torch.Tensor:
        return times + torch.where(times > 0.5, parameters["pause"][:, None], 0.0)


class Barrel(Effect):
    """Positions are seen farther out than they are."""

    name: ClassVar = "barrel"
    parameters: ClassVar = (BARREL,)

    def measured_positions(
        self, positions: torch.Tensor, times: torch.Tensor, parameters: Mapping[str, torch.Tensor]
    ) -> torch.Tensor:
        square = (positions**2).sum(-1, keepdim=True)
        return positions * (1 + parameters["barrel"][:, None, None, None] * square)


def _likelihood(pause: float, barrel: float) -> Likelihood:
    """A body in steady motion along x = y / 2, as a bad clock and a bad lens show it; the friction is 0."""
    stamps = FRAME * np.arange(COUNT)
    true = stamps + np.where(stamps > 0.5, pause, 0.0)
    place = np.stack([SPEED * true, 2 * SPEED * true], axis=-1)[:, None, :]
    seen = place * (1 + barrel * (place**2).sum(-1, keepdims=True))
    tracks = Tracks.from_arrays("one", (Body("0", Shape.CYLINDER, 0.1),), stamps, seen)
    model = PhysicsModel("base", (*PhysicsModel.base().effects, Pause(), Barrel()))
    return Likelihood(tracks, model, unknowns(tracks, model, Structure(frozenset({0}), frozenset())))


def _point(likelihood: Likelihood, **values: float) -> torch.Tensor:
    known = {"velocity_x": SPEED, "velocity_y": 2 * SPEED, "sliding_friction": -30.0, "air_drag": -30.0, **values}
    point = likelihood.coordinates.prior_mean.copy()
    for name, value in known.items():
        point[next(place for (field, _), place in likelihood.coordinates.places.items() if field == name)] = value
    return torch.tensor(point)[None]


@pytest.mark.parametrize(("pause", "barrel"), [(0.12, 0.0), (0.0, 0.05), (0.12, 0.05)])
def test_the_measurement_is_undone(pause: float, barrel: float) -> None:
    likelihood = _likelihood(pause, barrel)
    numbers = 2 * COUNT
    right = likelihood.residuals(_point(likelihood, pause=pause, barrel=barrel).numpy())[0, :numbers]
    wrong = likelihood.residuals(_point(likelihood).numpy())[0, :numbers]
    assert np.abs(right).max() < 1e-8
    assert np.abs(wrong).max() > 1


def test_derivatives_by_clock_and_lens() -> None:
    likelihood = _likelihood(0.12, 0.05)
    point = _point(likelihood, pause=0.1, barrel=0.04).requires_grad_()
    likelihood.log_density(point).sum().backward()
    for name in ("pause", "barrel"):
        place = likelihood.coordinates.places[name, None]
        step = torch.zeros_like(point)
        step[0, place] = 1e-6
        with torch.no_grad():
            ends = [likelihood.log_density(point + sign * step).item() for sign in (1, -1)]
        assert point.grad[0, place].item() == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-5)


def test_a_clock_that_goes_backward_is_impossible() -> None:
    likelihood = _likelihood(0.12, 0.0)
    points = torch.cat([_point(likelihood, pause=0.12), _point(likelihood, pause=-0.12)])
    density = likelihood.log_density(points)
    assert torch.isfinite(density[0])
    assert density[1] == -torch.inf


@pytest.mark.parametrize(("half_width", "sd"), [(3.0, 0.02), (0.05, 1.6)])
def test_a_lens_over_a_small_table_may_bend_as_much(half_width: float, sd: float) -> None:
    positions = np.linspace(-half_width, half_width, 201)[:, None, None] * np.ones((1, 1, 2))
    tracks = Tracks.from_arrays("v", (Body("a", Shape.SPHERE, half_width / 50),), np.arange(201.0), positions)
    assert LensDistortion().expected([tracks])["distortion"].prior.sd == pytest.approx(sd, rel=0.1)
