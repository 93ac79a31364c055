"""A body that meets nothing but a wall tells the product of both restitutions, and nothing of its mass."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch

from tests.inference.generator import Scene, states
from vrdp_prob.inference import Posterior, Status, identified, infer
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.models.effects.wall import Wall as HiddenWall
from vrdp_prob.models.parameters import MASS, RESTITUTION, Prior
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Body, Shape, Tracks, Wall

PRODUCT = 0.6
STATED = 0.8
NOISE = 0.004
RADIUS = 0.2
WALL_AT = 0.5
TIMES = np.arange(50) / 25


def bouncing(walls: tuple[Wall, ...], shape: Shape = Shape.CYLINDER) -> Tracks:
    """Tracks of a body that slides at a wall; a normal impact turns the speed across the wall."""
    before = Scene(
        (shape,),
        np.array([[-1.0, 0.0]]),
        np.array([[1.8, 0.3]]),
        np.ones(1),
        np.ones(1),
        np.full(1, RADIUS),
        np.full(1, 0.5),
        drag=0.04,
    )
    fine = np.linspace(0, TIMES[-1], 4001)
    x, y, velocity_x, velocity_y = states(before, fine)[:, 0, :4].T
    hit = int(np.argmax(x >= WALL_AT - RADIUS))
    after = replace(
        before,
        position=np.array([[x[hit], y[hit]]]),
        velocity=np.array([[-PRODUCT * velocity_x[hit], velocity_y[hit]]]),
        contacts=[],
    )
    early = fine[hit] > TIMES
    since = np.concatenate([[0.0], TIMES[~early] - fine[hit]])
    path = np.concatenate([states(before, TIMES[early])[:, :, :2], states(after, since)[1:, :, :2]])
    path = path + NOISE * np.random.default_rng(0).standard_normal(path.shape)
    return Tracks.from_arrays("wall", (Body("disc", shape, RADIUS),), TIMES, path, walls=walls)


@cache
def against_a_wall(stated: float | None) -> Posterior:
    """What is inferred from a disc that meets a wall."""
    tracks = bouncing((Wall(WALL_AT, -3.0, WALL_AT, 3.0, stated),))
    return infer(tracks, model=PhysicsModel.base(), sampler="laplace", draws=500, hand_on=False)


def test_a_stated_wall_tells_the_restitution_of_the_body() -> None:
    posterior = against_a_wall(STATED)
    restitution = posterior.object_summary("disc").restitution
    assert posterior.status["disc"].restitution.status is Status.IDENTIFIED
    assert restitution.summary.mean == pytest.approx(PRODUCT / STATED, abs=4 * restitution.summary.sd)
    assert restitution.summary.sd < 0.02


def test_an_unknown_wall_leaves_the_product() -> None:
    posterior = against_a_wall(None)
    status = posterior.status["disc"].restitution
    assert (status.status, status.partners) == (Status.PRODUCT_ONLY, ("wall 1",))
    draws = posterior.data["posterior"]
    product = draws["restitution"].values[..., 0] * draws["wall_restitution"].values[..., 0]
    assert product.mean() == pytest.approx(PRODUCT, abs=4 * product.std())
    assert product.std() < 0.02
    assert draws["restitution"].values.std() > 3 * product.std()


@pytest.mark.parametrize("stated", [STATED, None])
def test_a_wall_says_nothing_of_a_mass(stated: float | None) -> None:
    posterior = against_a_wall(stated)
    assert posterior.status["disc"].mass.status is Status.DEFAULT
    assert (posterior.data["posterior"]["mass"].values == MASS.default).all()
    assert any("only where it meets walls" in sentence for sentence in posterior.warnings)
    assert not any("never collide" in sentence for sentence in posterior.warnings)


@pytest.mark.parametrize("shape", [Shape.CYLINDER, Shape.CUBE])
@pytest.mark.parametrize("spread", [RESTITUTION.prior.sd, 0.05])
def test_a_body_that_meets_a_wall_that_nobody_states_has_the_same_unknowns(shape: Shape, spread: float) -> None:
    tracks = bouncing((), shape)
    model = PhysicsModel.base().with_effect(HiddenWall(), [tracks])
    distance, direction, _ = HiddenWall().parameters
    near = {
        distance.name: replace(distance, prior=Prior(WALL_AT, 0.05), default=WALL_AT),
        direction.name: replace(direction, prior=Prior(0.0, 0.05), default=0.0),
        RESTITUTION.name: replace(RESTITUTION, prior=replace(RESTITUTION.prior, sd=spread)),
    }
    believed = replace(model, beliefs={**model.beliefs, **near})
    fit = fit_map(tracks, believed, np.random.default_rng(0), model_error=False)
    places = fit.likelihood.coordinates.places
    assert ("restitution", 0) in places
    assert (("angle", 0) in places) is (shape is Shape.CUBE)
    assert fit.misfit.ratio < 1.2
    status = identified(fit).status["disc"].restitution
    if spread == RESTITUTION.prior.sd:
        assert (status.status, status.partners) == (Status.PRODUCT_ONLY, ("the hidden wall",))
    if shape is Shape.CYLINDER:  # a cube that lies askew turns, too
        values = fit.likelihood.coordinates.quantities(torch.from_numpy(fit.point[None]))
        product = float(values["restitution"][0, 0] * values["hidden_wall_restitution"][0, 0])
        assert product == pytest.approx(PRODUCT, abs=0.03)
