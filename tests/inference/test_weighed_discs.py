"""Two real discs that collide on an air table: what the collision says of their masses, and what the scale says."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from vrdp_prob import load
from vrdp_prob.inference import infer
from vrdp_prob.scene import Tracks

VIDEO = "S6rm_v14-6g_h27-7g"


def test_a_collision_weighs_one_disc_by_the_other(shared_data: Path) -> None:
    tracks = load(shared_data / "puck_mass_pairs_2d", video=VIDEO)
    weighed = [body.mass or np.nan for body in tracks.bodies]
    withheld = tuple(replace(body, mass=None, inertia=None) for body in tracks.bodies)
    posterior = infer(
        Tracks(tracks.video, withheld, tracks.data, tracks.walls), sampler="laplace", draws=400, hand_on=False
    )
    (ratio,) = posterior.mass_ratios()
    by_id = dict(zip((body.id for body in tracks.bodies), weighed, strict=True))
    true = by_id[ratio.objects[0]] / by_id[ratio.objects[1]]
    assert abs(ratio.summary.mean / true - 1) < 0.03
    assert ratio.summary.q05 < true < ratio.summary.q95
    assert posterior.misfit is not None
    assert posterior.misfit.error_acceleration is not None  # the model is wrong, and the intervals allow for it
