"""The model of a finding works wherever a model does, whatever causes it has: `report`, `ask` and `evaluate`."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from tests.evaluation.videos import write_videos
from vrdp_prob import cli
from vrdp_prob.inference import default_model
from vrdp_prob.inference.several_videos.beliefs import believing
from vrdp_prob.inference.several_videos.linking import Key
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.physics import PhysicsModel

FINDINGS: Mapping[str, tuple[Sequence[str], Mapping[Key, float]]] = {
    "slip, materials and restitution": (
        ("slip_to_roll", "material_friction", "speed_dependent_restitution"),
        {
            ("slip_friction", ()): np.log(0.15),
            ("material_friction_ratio", ("metal",)): np.log(1.2),
            ("restitution_exponent", ()): np.log(0.2),
        },
    ),
    "two walls and a lens": (
        ("wall", "second_wall", "lens_distortion"),
        {("hidden_wall_distance", ()): 3.0, ("second_hidden_wall_distance", ()): -3.0, ("distortion", ()): 0.001},
    ),
    "a slope, friction of contacts and a radius": (
        ("surface_tilt", "contact_friction", "contact_radius_error"),
        {("tilt_x", ()): 0.001, ("contact_friction", ()): np.log(0.1), ("radius_error", ()): 0.001},
    ),
    "a patch, a bowl and frames": (
        ("friction_patch", "bowl", "irregular_frames"),
        {("patch_x", ()): 2.0, ("patch_y", ()): 2.0, ("bowl_stiffness", ()): 0.001, ("frame_jitter", ()): np.log(1e-4)},
    ),
}
"""Causes, and what some videos say of a few of their numbers (in coordinates)."""


@pytest.fixture(params=FINDINGS)
def model(request: pytest.FixtureRequest) -> PhysicsModel:
    """What discovery hands out: causes, and what videos say of them."""
    causes, told = FINDINGS[request.param]
    known, model = known_effects(), default_model()
    for cause in causes:
        model = model.with_effect(known[cause]())
    return believing(model, tuple(told), np.array(list(told.values())), np.full(len(told), 0.05))


def test_videos_are_scored_under_it(model: PhysicsModel, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    questions, file = write_videos(tmp_path / "videos"), tmp_path / "model.toml"
    model.write(file)
    asked = [
        "--questions",
        str(questions),
        "--scenes",
        "10:11",
        "--model",
        str(file),
        "--out",
        str(tmp_path / "scores"),
    ]
    assert cli.run(["evaluate", str(questions.parent), *asked, "--processes", "1", "--json", "--quiet"]) == 0
    assert json.loads(capsys.readouterr().out)["scenes"] == 1
    read = PhysicsModel.read(file)
    assert [one.name for one in read.effects] == [one.name for one in model.effects]
    assert {one.name: one for one in read.parameters} == {one.name: one for one in model.parameters}
    told = {name: one for name, one in read.beliefs.items() if name in model.beliefs}
    assert {name: one.prior for name, one in told.items()} == {name: one.prior for name, one in model.beliefs.items()}


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_video_is_reported_and_asked_under_it(
    model: PhysicsModel, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file = tmp_path / "videos", tmp_path / "model.toml"
    write_videos(folder)
    model.write(file)
    chosen = ["--video", "video_00000", "--model", str(file), "--sampler", "laplace", "--quiet"]
    assert cli.run(["report", str(folder), "--out", str(tmp_path / "one"), *chosen]) == 0
    capsys.readouterr()
    document = json.loads((tmp_path / "one" / "report.json").read_text(encoding="utf-8"))
    assert list(model.effects)[-1].name in json.dumps(document["model"])
    assert cli.run(["ask", str(folder), "How many collisions happen?", "--json", *chosen]) == 0
    assert json.loads(capsys.readouterr().out)["distribution"]
