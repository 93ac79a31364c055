"""One number for all bodies of a material, in the vector of unknowns and between videos."""

from dataclasses import replace

import numpy as np
import torch

from vrdp_prob.models.effects.material_friction import MATERIAL_RATIO, MaterialFriction
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.parameters import WALL_RESTITUTION, Prior, belief_key
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import Structure, unknowns
from vrdp_prob.scene import Body, Shape, Tracks, Wall

FRAMES = 20
GRAVITY, FRICTION = 9.81, 0.05
RATIOS = {"metal": 0.6, "rubber": 1.7}
MODEL = PhysicsModel.base().with_effect(MaterialFriction())


def tracks_of(*materials: str | None) -> Tracks:
    """Bodies far from each other that slide along x, each slowed by its material, in closed form."""
    times = 0.04 * np.arange(FRAMES)
    places = []
    for index, material in enumerate(materials):
        slowing = FRICTION * GRAVITY * RATIOS.get(material or "", 1.0)
        places.append(np.stack([times - slowing * times**2 / 2, np.full(FRAMES, 2.0 * index)], axis=-1))
    bodies = tuple(Body(str(i), Shape.CYLINDER, 0.1, material=name) for i, name in enumerate(materials))
    return Tracks.from_arrays("v", bodies, times, np.stack(places, axis=1))


def likelihood_of(tracks: Tracks) -> Likelihood:
    moving = frozenset(range(len(tracks.bodies)))
    return Likelihood(tracks, MODEL, unknowns(tracks, MODEL, Structure(moving, frozenset())))


def test_bodies_of_a_material_share_one_number() -> None:
    coordinates = likelihood_of(tracks_of("rubber", "metal", "rubber", None)).coordinates
    own = [entry for entry in coordinates.entries if entry.field == "material_friction_ratio"]
    assert [entry.name for entry in own] == [
        "material_friction_ratio[metal]",
        "material_friction_ratio[rubber]",
        "material_friction_ratio[unknown material]",
    ]
    point = torch.from_numpy(coordinates.prior_mean.copy())[None]
    for entry, value in zip(own, (0.6, 1.7, 1.1), strict=True):
        point[0, coordinates.places[entry.field, entry.owner]] = np.log(value)
    values = coordinates.quantities(point)["material_friction_ratio"]
    np.testing.assert_allclose(values[0].numpy(), [1.7, 0.6, 1.7, 1.1])


def test_the_true_ratios_explain_the_motion() -> None:
    likelihood = likelihood_of(tracks_of("rubber", "metal", "rubber"))
    coordinates = likelihood.coordinates
    point = coordinates.prior_mean.copy()
    known = {"velocity_x": 1.0, "sliding_friction": np.log(FRICTION), "air_drag": -30.0}
    for place, entry in enumerate(coordinates.entries):
        point[place] = known.get(entry.field, point[place])
        if entry.field == "material_friction_ratio":
            point[place] = np.log(RATIOS[str(entry.group)])
    numbers = 2 * FRAMES * 3
    right = likelihood.residuals(point[None])[0, :numbers]
    assert np.abs(right).max() < 1e-6
    wrong = np.where(coordinates.mask(["material_friction_ratio"]), 0.0, point)
    assert np.abs(likelihood.residuals(wrong[None])[0, :numbers]).max() > 1


def test_what_is_believed_of_a_material_is_its_own() -> None:
    known = replace(MATERIAL_RATIO, default=1.5, prior=Prior(np.log(1.5), 0.01))
    model = replace(MODEL, beliefs={belief_key(known.name, ("rubber",)): known})
    tracks = tracks_of("rubber", "metal", "rubber")
    coordinates = unknowns(tracks, model, Structure(frozenset({0, 1}), frozenset()))
    priors = {entry.group: entry.prior for entry in coordinates.entries if entry.field == known.name}
    assert priors == {"rubber": known.prior, "metal": MATERIAL_RATIO.prior}
    resting = unknowns(tracks, model, Structure(frozenset({1}), frozenset()))
    values = resting.quantities(torch.from_numpy(resting.prior_mean.copy())[None])[known.name]
    np.testing.assert_allclose(values[0].numpy(), [1.5, 1.0, 1.5])


def test_what_is_believed_of_a_wall_is_its_own() -> None:
    tracks = replace(tracks_of("metal"), walls=(Wall(5.0, -9.0, 5.0, 9.0), Wall(-5.0, -9.0, -5.0, 9.0)))
    known = replace(WALL_RESTITUTION, default=0.5, prior=replace(WALL_RESTITUTION.prior, mean=np.log(0.5), sd=0.01))
    model = replace(MODEL, beliefs={belief_key(known.name, tracks.walls[1].place): known})
    coordinates = unknowns(tracks, model, Structure(frozenset({0}), frozenset({0})))
    priors = [entry.prior for entry in coordinates.entries if entry.field == known.name]
    assert priors == [WALL_RESTITUTION.prior, known.prior]
