"""Two real discs that collide on an air table: what the collision says of their masses, and what the scale says."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from vrdp_prob import load
from vrdp_prob.inference import default_model, infer
from vrdp_prob.inference.map_fit import fit_map
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.scene import Tracks

VIDEO = "S6rm_v14-6g_h27-7g"
SPINNING = "S7e_v34-0g_h31-6g"
"""Two discs that turn by themselves, too, many times as much as the noise of their angles."""


def withheld_masses(folder: Path, video: str) -> tuple[Tracks, float]:
    """The tracks of two discs without their masses, and the mass of the first in units of the second's."""
    tracks = load(folder / "puck_mass_pairs_2d", video=video)
    first, second = (body.mass or np.nan for body in tracks.bodies)
    bodies = tuple(replace(body, mass=None, inertia=None) for body in tracks.bodies)
    return Tracks(tracks.video, bodies, tracks.data, tracks.walls), first / second


def test_a_collision_weighs_one_disc_by_the_other(shared_data: Path) -> None:
    tracks, weighed = withheld_masses(shared_data, VIDEO)
    posterior = infer(tracks, sampler="laplace", draws=400, hand_on=False)
    (ratio,) = posterior.mass_ratios()
    in_order = ratio.objects[0] == tracks.bodies[0].id
    true = weighed if in_order else 1 / weighed
    assert abs(ratio.summary.mean / true - 1) < 0.03
    assert ratio.summary.q05 < true < ratio.summary.q95
    assert posterior.misfit is not None
    assert posterior.misfit.error_acceleration is not None  # the model is wrong, and the intervals allow for it


def test_angles_that_a_law_of_contacts_cannot_explain_do_not_outvote_positions(shared_data: Path) -> None:
    tracks, weighed = withheld_masses(shared_data, SPINNING)
    fit = fit_map(tracks, default_model().with_effect(ContactFriction()), np.random.default_rng(0))
    places = fit.likelihood.coordinates.places
    ratio = np.exp(fit.point[places["mass", 0]] - fit.point[places["mass", 1]])
    assert abs(ratio / weighed - 1) < 0.05
