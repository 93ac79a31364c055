"""Friction of materials, shared by videos that do not all hold the same materials."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.inference.several_videos.videos import FRICTION, sliding
from vrdp_prob import PhysicsModel, Tracks
from vrdp_prob.inference.several_videos import infer_together
from vrdp_prob.inference.several_videos.posterior import SharedPosterior
from vrdp_prob.models.effects.material_friction import MaterialFriction

RATIOS = {"metal": 0.6, "rubber": 1.7}


def of_material(seed: int, material: str) -> Tracks:
    tracks = sliding(seed, frames=40, friction=FRICTION * RATIOS[material])
    return replace(tracks, bodies=tuple(replace(body, material=material) for body in tracks.bodies))


def test_each_material_has_one_friction_in_all_videos(tmp_path: Path) -> None:
    videos = [of_material(seed, material) for seed, material in enumerate(("metal", "rubber", "metal", "rubber"))]
    posterior = infer_together(
        videos, model=PhysicsModel.base().with_effect(MaterialFriction()), sampler="laplace", draws=400, hand_on=False
    )
    posterior.write(tmp_path / "shared.nc")
    for one in (posterior, SharedPosterior.read(tmp_path / "shared.nc")):
        ratios = one.shared["material_friction_ratio"]
        assert ratios["material"].values.tolist() == ["metal", "rubber"]
        contrast = np.log(ratios.sel(material="rubber") / ratios.sel(material="metal"))
        truth = np.log(RATIOS["rubber"] / RATIOS["metal"])
        assert abs(float(contrast.mean()) - truth) < 3 * float(contrast.std())
        assert float(contrast.std()) == pytest.approx(0.1, abs=0.09)
