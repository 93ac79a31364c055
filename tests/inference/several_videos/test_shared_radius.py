"""Bodies that are larger than stated, by one share in all videos."""

from dataclasses import replace

from tests.inference.several_videos.videos import colliding
from vrdp_prob import PhysicsModel, Tracks
from vrdp_prob.inference import infer_together
from vrdp_prob.models.effects.contact_radius_error import ContactRadiusError

SMALLER = 0.95
"""Stated over true radii."""


def stated_smaller(tracks: Tracks) -> Tracks:
    return replace(tracks, bodies=tuple(replace(body, radius=SMALLER * body.radius) for body in tracks.bodies))


def test_several_videos_tell_together_by_how_much_radii_are_wrong() -> None:
    model = PhysicsModel.base().with_effect(ContactRadiusError())
    videos = [stated_smaller(colliding(seed)) for seed in (1, 2, 3)]
    spreads = []
    for some in (videos[:1], videos):
        posterior = infer_together(some, model=model, sampler="laplace", draws=400, hand_on=False)
        error = posterior.shared["radius_error"]
        assert abs(float(error.mean()) - (1 / SMALLER - 1)) < 3 * float(error.std())
        spreads.append(float(error.std()))
    assert spreads[1] < 0.8 * spreads[0] < 0.04
