import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest
import torch
import xarray as xr

from tests.inference.generator import Scene, observe
from vrdp_prob.errors import InputError
from vrdp_prob.inference import (
    BodyStatus,
    ParameterStatus,
    Posterior,
    Status,
    default_model,
    fit_map,
    identified,
    infer,
)
from vrdp_prob.inference.several_videos import fit_together
from vrdp_prob.models.parameters import RESTITUTION
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.scene import Body, Shape, Tracks, Wall


def chain() -> Scene:
    """A disc hits a resting one, which hits a third; a fourth enters late and meets nobody."""
    return Scene(
        (Shape.CYLINDER, Shape.CYLINDER, Shape.CYLINDER, Shape.SPHERE),
        np.array([[-1.8, 0.0], [-0.3, 0.04], [1.0, 0.2], [-2.0, 2.0]]),
        np.array([[2.2, 0.0], [0.0, 0.0], [0.0, 0.0], [1.2, 0.1]]),
        np.array([1.5, 0.8, 1.1, 1.0]),
        np.array([0.9, 0.95, 0.85, 0.8]),
        np.full(4, 0.2),
        np.array([0.4, 0.4, 0.4, 0.05]),
        release=np.array([0.0, 0.0, 0.0, 0.8]),
    )


@cache
def chain_posterior(sampler: str = "laplace") -> tuple[Scene, Posterior]:
    scene = chain()
    return scene, infer(
        observe(scene, noise=0.005, dropout=0.05, frames=75, seed=2), sampler=sampler, draws=400, hand_on=False
    )


def test_mass_ratios_and_restitutions_are_recovered() -> None:
    scene, posterior = chain_posterior()
    assert posterior.pairs == (("0", "1"), ("1", "2"))
    for pair in posterior.mass_ratios():
        first, second = (int(name) for name in pair.objects)
        assert pair.summary.mean == pytest.approx(scene.mass[first] / scene.mass[second], abs=4 * pair.summary.sd)
        assert pair.summary.sd < 0.1
    for pair in posterior.restitution_pairs():
        first, second = (int(name) for name in pair.objects)
        true = scene.restitution[first] * scene.restitution[second]
        assert pair.summary.mean == pytest.approx(true, abs=4 * pair.summary.sd)


def test_what_can_be_told_is_known_before_anything_is_sampled() -> None:
    scene, posterior = chain_posterior()
    tracks = observe(scene, noise=0.005, dropout=0.05, frames=75, seed=2)
    told = identified(fit_map(tracks, default_model(), np.random.default_rng(0)))
    assert told.status["0"].mass.status is Status.RATIO_ONLY
    assert told.status["3"].mass.status is Status.DEFAULT
    assert {name: one.mass.status for name, one in told.status.items()} == {
        name: one.mass.status for name, one in posterior.status.items()
    }
    assert [group.bodies for group in told.groups] == [("0", "1", "2")]


def test_a_model_that_fits_is_not_warned_about_and_its_noise_is_found() -> None:
    _, posterior = chain_posterior()
    assert not any("does not explain" in text for text in posterior.warnings)
    noise = posterior.data["posterior"]["noise_scale"]
    assert float(noise.mean()) * noise.attrs["reference_m"] == pytest.approx(0.005, rel=0.15)


def test_a_body_that_enters_late_and_never_collides_keeps_the_defaults() -> None:
    _, posterior = chain_posterior()
    status = posterior.status["3"]
    assert status.is_default
    assert posterior.object_summary("3").mass.summary.sd == 0
    assert any("Object 3 never collides" in text for text in posterior.warnings)
    assert float(posterior.worlds(1).release_time[0, 3]) == pytest.approx(0.8)


def test_pairs_of_which_nothing_is_told_are_marked() -> None:
    _, posterior = chain_posterior()
    assert all(pair.determined for pair in (*posterior.mass_ratios(), *posterior.restitution_pairs()))
    nothing = BodyStatus(ParameterStatus(Status.DEFAULT), ParameterStatus(Status.DEFAULT))
    unsaid = replace(posterior, status={**posterior.status, "2": nothing})
    assert [pair.determined for pair in unsaid.mass_ratios()] == [True, False]
    assert unsaid.restitution_pairs()[1].to_document()["determined"] is False


def test_status_names_the_partners() -> None:
    _, posterior = chain_posterior()
    assert posterior.status["1"].mass.status is Status.RATIO_ONLY
    assert posterior.status["1"].mass.partners == ("0", "2")
    assert posterior.object_summary("0").restitution.status == "product_only"
    assert posterior.object_summary(0) == posterior.object_summary("0")


def test_draws_are_worlds_that_reproduce_what_was_seen() -> None:
    _, posterior = chain_posterior()
    worlds = posterior.worlds(20)
    assert len(worlds) == 20
    rollout = simulate(worlds, torch.tensor(posterior.tracks.times), posterior.model)
    seen = posterior.tracks.seen
    error = (rollout.trajectory[..., :2].numpy() - posterior.tracks.positions)[:, seen]
    assert np.sqrt((error**2).mean()) < 0.008
    assert len(posterior.map_worlds()) == 1


def test_the_file_holds_everything(tmp_path: Path) -> None:
    _, posterior = chain_posterior()
    path = tmp_path / "posterior.nc"
    posterior.write(path)
    again = Posterior.read(path)
    assert [file.name for file in tmp_path.iterdir()] == ["posterior.nc"]
    assert set(again.data.children) == set(posterior.data.children)
    for name, group in posterior.data.children.items():
        xr.testing.assert_identical(again.data[name].to_dataset(), group.to_dataset())
    assert again.tracks.bodies == posterior.tracks.bodies
    np.testing.assert_array_equal(again.tracks.positions, posterior.tracks.positions)
    assert (again.status, again.convergence, again.warnings, again.pairs, again.seed) == (
        posterior.status,
        posterior.convergence,
        posterior.warnings,
        posterior.pairs,
        posterior.seed,
    )
    assert again.model.parameters == posterior.model.parameters
    assert again.model.effects == posterior.model.effects
    torch.testing.assert_close(again.worlds(7).mass, posterior.worlds(7).mass)


def test_files_that_are_no_posterior_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.nc"
    with pytest.raises(InputError, match="cannot be read"):
        Posterior.read(path)
    path.write_text("nothing")
    with pytest.raises(InputError):
        Posterior.read(path)


def test_files_of_another_format_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "posterior.nc"
    chain_posterior()[1].write(path)
    with h5py.File(path, "a") as file:
        file.attrs["format"] = 1
    with pytest.raises(InputError, match=r"posterior.nc: the posterior is of file format 1, this program reads 2; run"):
        Posterior.read(path)


def test_a_body_without_a_radius_is_told_to_meet_nothing() -> None:
    tracks = observe(chain(), frames=30)
    bodies = (*tracks.bodies[:-1], replace(tracks.bodies[-1], radius=None))
    unsized = Tracks.from_arrays(tracks.video, bodies, tracks.times, tracks.positions)
    posterior = infer(unsized, sampler="laplace", draws=50, hand_on=False)
    assert any(warning.startswith(f"Object {bodies[-1].id} has no radius") for warning in posterior.warnings)


@pytest.mark.parametrize(
    ("factor", "frames", "sentence"),
    [(1000.0, 30, r"Objects move at \d\S*e\+03 m/s: see whether"), (1.0, 3, "The video has 3 frames")],
)
def test_units_and_lengths_that_cannot_be_meant_are_told(factor: float, frames: int, sentence: str) -> None:
    tracks = observe(chain(), noise=0.01, frames=40, seed=4)
    body, positions = tracks.bodies[:1], factor * tracks.positions[:frames, :1]
    short = Tracks.from_arrays("short", body, tracks.times[:frames], positions)
    posterior = infer(short, sampler="laplace", draws=50, hand_on=False)
    assert any(re.match(sentence, warning) for warning in posterior.warnings), posterior.warnings


def test_the_same_seed_gives_the_same_posterior() -> None:
    tracks = observe(chain(), noise=0.01, frames=30, seed=4)
    first, second = (infer(tracks, sampler="laplace", draws=50, seed=7, hand_on=False) for _ in range(2))
    np.testing.assert_array_equal(first.data["posterior"]["mass"], second.data["posterior"]["mass"])


def test_a_model_that_cannot_fit_is_told_first() -> None:
    scene = chain()
    tracks = observe(scene, noise=0.005, frames=75, seed=2)
    swerved = tracks.positions.copy()
    swerved[:, 3, 1] += 0.4 * np.sin(4 * tracks.times)
    bent = Tracks.from_arrays("bent", tracks.bodies, tracks.times, swerved)
    posterior = infer(bent, sampler="laplace", draws=50, hand_on=False)
    assert posterior.warnings[0].startswith("The model does not explain this motion")
    assert "object 3" in posterior.warnings[0]
    assert "allow for an unknown acceleration" in posterior.warnings[0]
    _, good = chain_posterior()
    widened, sharp = (one.mass_ratios()[0].summary.sd for one in (posterior, good))
    assert widened > 2 * sharp


def test_unknown_samplers_too_few_draws_and_negative_seeds_are_refused() -> None:
    tracks = observe(chain(), frames=30)
    with pytest.raises(InputError, match="use one of emcee, nuts, laplace"):
        infer(tracks, sampler="gibbs")
    with pytest.raises(InputError, match="at least 4"):
        infer(tracks, draws=2)
    with pytest.raises(InputError, match="seed is -1; give a whole number of at least 0"):
        infer(tracks, seed=-1)


def test_tracks_without_motion_are_refused() -> None:
    tracks = observe(chain(), frames=30)
    still = np.tile(tracks.positions[:1, :3], (30, 1, 1))
    with pytest.raises(InputError, match="no object moves"):
        infer(Tracks.from_arrays("still", tracks.bodies[:3], tracks.times, still))


def test_a_body_that_drifts_less_than_its_stated_noise_is_at_rest_at_its_release() -> None:
    scene = chain()
    tracks = observe(scene, frames=100, noise=0.001)
    drift = 0.004 * np.linspace(-1, 1, len(tracks.times))
    positions = tracks.positions.copy()
    resting = int(np.flatnonzero((scene.velocity == 0).all(axis=1))[0])
    before = tracks.times < 0.9 * min(time for time, *pair in scene.contacts if resting in pair)
    positions[before, resting, 0] += drift[before]
    covariance = np.broadcast_to(0.005**2 * np.eye(2), (*tracks.seen.shape, 2, 2))
    stated = Tracks.from_arrays(
        "drift", tracks.bodies, tracks.times, positions, position_covariance=np.array(covariance)
    )
    posterior = infer(stated, sampler="laplace", draws=50, hand_on=False)
    velocity = posterior.data["posterior"]["velocity"].values[..., resting, :]
    assert (velocity == 0).all()


def with_outliers(tracks: Tracks, share: float) -> Tracks:
    generator = np.random.default_rng(5)
    positions = tracks.positions.copy()
    struck = generator.random(positions.shape[:2]) < share
    positions[struck] += generator.normal(0, 0.5, size=(int(struck.sum()), 2))
    return Tracks.from_arrays("outliers", tracks.bodies, tracks.times, positions)


def test_gross_outliers_and_gaps_do_no_harm() -> None:
    scene, clean = chain_posterior()
    posterior = infer(with_outliers(clean.tracks, 0.05), sampler="laplace", draws=400, hand_on=False)
    assert "Student-t" in " ".join(posterior.warnings)
    assert float(posterior.data["posterior"]["noise_degrees_of_freedom"].mean()) < 3
    for pair, undisturbed in zip(posterior.mass_ratios(), clean.mass_ratios(), strict=True):
        first, second = (int(name) for name in pair.objects)
        assert pair.summary.mean == pytest.approx(scene.mass[first] / scene.mass[second], abs=4 * pair.summary.sd)
        assert pair.summary.sd < 1.5 * undisturbed.summary.sd


def test_gaussian_noise_that_was_asked_for_is_harmed_by_them() -> None:
    _, clean = chain_posterior()
    posterior = infer(with_outliers(clean.tracks, 0.05), sampler="laplace", draws=50, noise="gaussian", hand_on=False)
    assert "noise_degrees_of_freedom" not in posterior.data["posterior"]
    assert posterior.mass_ratios()[0].summary.sd > 3 * clean.mass_ratios()[0].summary.sd


def test_defaults_can_be_drawn_from_the_prior() -> None:
    _, kept = chain_posterior()
    posterior = infer(kept.tracks, sampler="laplace", draws=400, defaults="prior", hand_on=False)
    drawn = np.log(posterior.data["posterior"]["mass"].sel(body="3").values)
    assert drawn.std() == pytest.approx(0.7, rel=0.15)
    np.testing.assert_array_equal(posterior.data["posterior"]["mass"][..., :3], kept.data["posterior"]["mass"][..., :3])
    assert any("drawn from the prior" in text for text in posterior.warnings)
    assert posterior.status["3"].is_default


def test_restitutions_drawn_from_the_prior_give_no_energy() -> None:
    soft = replace(RESTITUTION, prior=replace(RESTITUTION.prior, softness=0.3))
    model = replace(default_model(), beliefs={RESTITUTION.name: soft})
    tracks = observe(chain(), noise=0.01, frames=30, seed=4)
    posterior = infer(tracks, model=model, sampler="laplace", draws=50, defaults="prior", hand_on=False)
    drawn = posterior.data["posterior"]["restitution"].sel(body="3").values
    assert posterior.status["3"].is_default
    assert np.ptp(drawn) > 0.1
    assert drawn.max() <= 1


def test_a_posterior_given_the_motion_is_narrower_and_keeps_the_motion() -> None:
    _, free = chain_posterior()
    posterior = infer(free.tracks, sampler="laplace", draws=200, motion="fixed", hand_on=False)
    velocity = posterior.data["posterior"]["velocity"].values
    assert (velocity == velocity[0, 0]).all()
    for given, joint in zip(posterior.mass_ratios(), free.mass_ratios(), strict=True):
        assert 0 < given.summary.sd < joint.summary.sd


def test_unknown_options_are_refused() -> None:
    for name in ("noise", "defaults", "motion"):
        with pytest.raises(InputError, match=f"{name} 'other' is not known; use one of"):
            infer(observe(chain(), frames=30), **{name: "other"})


def test_groups_say_what_collisions_determine_and_survive_a_file(tmp_path: Path) -> None:
    _, posterior = chain_posterior()
    (group,) = posterior.groups
    assert group.bodies == ("0", "1", "2")
    determined = {one.name: one.determined for one in group.combinations}
    assert determined["mass ratio of objects 0 and 1"]
    assert not determined["mass scale of objects 0, 1 and 2"]
    posterior.write(tmp_path / "posterior.nc")
    assert Posterior.read(tmp_path / "posterior.nc").groups == posterior.groups


def test_bodies_that_begin_in_a_wall_are_told_of_where_no_world_begins_so() -> None:
    """By a share of its radius that may be wrong, and by far more than the noise."""
    seconds = np.arange(40) / 25
    noise = 0.0003 * np.random.default_rng(0).standard_normal((40, 1, 2))
    places = np.stack([0.84 - 0.5 * seconds + 0.05 * seconds**2, 0.1 * seconds], axis=1)[:, None] + noise
    tracks = Tracks.from_arrays(
        "near", (Body("a", Shape.SPHERE, 0.2),), seconds, places, walls=(Wall(1.0, -2.0, 1.0, 2.0),)
    )
    with pytest.raises(InputError, match=r"near: no world .* object a overlaps the wall .* leave the video out"):
        infer(tracks)
    with pytest.raises(InputError, match=r"near: no world .* object a overlaps the wall"):
        fit_together([tracks], model=default_model())
