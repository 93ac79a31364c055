"""From a posterior to a report."""

import json

import jsonschema
import numpy as np
import pytest
import torch
import xarray as xr
from example_content import RADIUS, make_tracks

from tests.concepts.physical.words import UNSURE
from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.identifiability.status import BodyStatus, ParameterStatus, Status
from vrdp_prob.inference.infer import infer
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.models.parameters import MASS, RESTITUTION
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.reasoning.answer import Answer
from vrdp_prob.reasoning.worlds import PosteriorWorlds
from vrdp_prob.report import build, rollouts, schema, write_report
from vrdp_prob.report.wording import world_label
from vrdp_prob.scene import Camera, QuestionType, Tracks

CYLINDER, SPHERE = 2, 3
FRAMES = slice(27, 100)


def make_pair() -> Tracks:
    """The cylinder and the sphere of the example, which collide, for three seconds."""
    whole = make_tracks(Camera.clevrer())
    bodies = [CYLINDER, SPHERE]
    return Tracks.from_arrays(
        whole.video,
        tuple(whole.bodies[index] for index in bodies),
        whole.times[FRAMES],
        whole.positions[FRAMES][:, bodies],
        camera=whole.camera,
    )


class HandMade(Posterior):
    """A posterior whose worlds are written down: the sphere rolls into the cylinder."""

    def worlds(self, count=None, *, generator=None) -> Worlds:
        draws = count or 4
        spread = torch.linspace(-0.1, 0.1, draws, dtype=torch.float64)
        both = torch.ones(draws, 2, dtype=torch.float64)
        velocity = torch.tensor([[0.0, 0.0], [-2.09, 0.54]]).double().expand(draws, 2, 2).clone()
        velocity[:, 1] *= 1 + 0.1 * spread[:, None]
        shared = {p.name: p.default * both[:, 0] for p in self.model.parameters}
        return Worlds(
            shapes=tuple(body.shape for body in self.tracks.bodies),
            position=torch.tensor([[-0.15, -0.30], [2.94, -1.02]]).double().expand(draws, 2, 2),
            velocity=velocity,
            angle=0 * both,
            spin=0 * both,
            release_time=1.08 * both,
            mass=both * (1 + spread[:, None]),
            restitution=0.8 * both,
            radius=RADIUS * both,
            present=both > 0,
            parameters=shared,
        )


def hand_made() -> Posterior:
    random = np.random.default_rng(0)
    axes = ("chain", "draw", "body")
    draws = {name: (axes, 1 + 0.1 * random.random((2, 20, 2))) for name in (MASS.name, RESTITUTION.name)}
    ratio, product = ParameterStatus(Status.RATIO_ONLY, ("3",)), ParameterStatus(Status.PRODUCT_ONLY, ("3",))
    return HandMade(
        tracks=make_pair(),
        model=PhysicsModel.base(),
        seed=7,
        data=xr.DataTree.from_dict({"posterior": xr.Dataset(draws)}),
        status={body: BodyStatus(ratio, product) for body in ("2", "3")},
        convergence=Convergence("emcee", True, 1.004, 900.0, None, None, 0.0),
        warnings=("A limit.",),
        pairs=(("2", "3"),),
    )


QUESTION = Answer(
    0, "Which of the following will happen without the sphere?", QuestionType.COUNTERFACTUAL, (), 1.0, 0.0, 0.0, {}
)


@pytest.fixture(scope="module")
def content():
    frames = np.full((128, 320, 480, 3), 120, dtype=np.uint8)
    return build(hand_made(), [QUESTION], frames=frames, draws=12)


def test_worlds_of_the_player(content):
    keys = [world.key for world in content.worlds]
    assert keys == ["factual", "future", "removed:2", "removed:3", "heavier:2", "heavier:3", "lighter:2", "lighter:3"]
    factual, future, without = content.worlds[:3]
    assert all(world.draws == 12 for world in content.worlds)
    assert (future.times[0], future.times[-1]) == pytest.approx((factual.times[-1], factual.times[-1] + 2.32), abs=0.05)
    assert not without.exists[:, :, 0].any()
    assert len(without.collisions.time) == 0


def test_a_learned_word_has_a_world_for_each_body():
    content = build(hand_made(), (), draws=4, words=[UNSURE])
    keys = [world.key for world in content.worlds]
    assert keys[-2:] == ["floppier:2", "floppier:3"]
    assert world_label(content.worlds[-1], content.tracks).endswith("were floppier")


def test_worlds_of_the_answers_are_shown():
    posterior = hand_made()
    content = build(posterior, [QUESTION], worlds=PosteriorWorlds(posterior, draws=40), draws=8)
    assert all(world.draws == 8 for world in content.worlds)
    assert [met.share for met in content.worlds[0].pairs] == [1.0]


def test_long_recordings_are_thinned(monkeypatch):
    monkeypatch.setattr(rollouts, "MOST_FRAMES", 20)
    times = build(hand_made(), (), draws=2).worlds[0].times
    assert len(times) == 20
    assert (times[0], times[-1]) == pytest.approx((1.08, 3.96))


def test_heavier_bodies_are_moved_less(content):
    worlds = {world.key: world for world in content.worlds}
    moved = [np.abs(worlds[key].trajectory[:, -1, 0, 0] + 0.15).mean() for key in ("heavier:2", "lighter:2")]
    assert moved[0] < moved[1]


def test_collision_that_was_seen_is_shown(content):
    shown = content.worlds[0].collisions
    assert sorted(shown.draw) == list(range(12))
    assert (shown.bodies == [0, 1]).all()
    assert np.abs(shown.time - 2.4).max() < 0.1


def test_question_is_about_its_world(content):
    assert [item.world for item in content.answers] == ["removed:3"]


def test_report_is_written(content, tmp_path):
    files = write_report(content, tmp_path)
    document = json.loads(files.document.read_text(encoding="utf-8"))
    jsonschema.validate(document, schema("report"))
    assert document["seed"] == 7
    assert document["objects"][0]["mass"]["status"] == "ratio_only"
    assert document["objects"][0]["mass"]["with"] == ["3"]
    assert "the gray cylinder with the cyan sphere" in files.page.read_text(encoding="utf-8")


@pytest.mark.slow
def test_report_of_an_inference(tmp_path):
    posterior = infer(make_pair(), sampler="laplace", draws=60)
    content = build(posterior, [QUESTION], draws=12)
    error = content.worlds[0].trajectory[..., :2] - content.tracks.positions
    # The example is drawn by hand, so no model fits it exactly: the rollouts follow the tracks to half a radius.
    assert np.nanmedian(np.abs(error)) < 0.1
    document = json.loads(write_report(content, tmp_path).document.read_text(encoding="utf-8"))
    jsonschema.validate(document, schema("report"))
