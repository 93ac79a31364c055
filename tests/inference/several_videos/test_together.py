import os
import subprocess
import sys
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import arviz
import emcee
import h5py
import numpy as np
import pytest
import torch

from tests.inference.several_videos.videos import DRAG, FRICTION, NOISE, colliding, sliding
from vrdp_prob.errors import InputError
from vrdp_prob.inference import CURRICULUM, FitPlan, Optimiser, Posterior
from vrdp_prob.inference.draws.diagnostics import Reported, chain_statistics
from vrdp_prob.inference.draws.samples import Gaussian, evaluate, evaluate_with_gradient
from vrdp_prob.inference.search.mode_search import ModeSearch
from vrdp_prob.inference.several_videos import (
    SharedFit,
    SharedPosterior,
    fit_together,
    gibbs,
    infer_together,
    predictive_log_density,
    sample_together,
    together,
)
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.inference.several_videos.gibbs import sample_gibbs
from vrdp_prob.inference.several_videos.gradient_ascent import _Whitened, climb_by_gradient
from vrdp_prob.inference.several_videos.joining import joined
from vrdp_prob.inference.several_videos.linking import LinkedVideo
from vrdp_prob.inference.several_videos.parts import fit_alone
from vrdp_prob.inference.several_videos.second_look import doubtful
from vrdp_prob.inference.several_videos.whole_vector import WholeVector
from vrdp_prob.models.effects.body_friction import BodyFriction
from vrdp_prob.models.parameters import AIR_DRAG, Prior
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Body, Tracks, Wall

BASE = PhysicsModel.base()


@cache
def two() -> SharedFit:
    return fit_together([colliding(1), sliding(2)], model=BASE)


@cache
def posterior_of_two(sampler: str) -> SharedPosterior:
    return sample_together(two(), sampler=sampler, draws=800)


def test_the_joint_fit_is_a_maximum_of_the_joint_density() -> None:
    fit = two()
    assert fit.joint.converged
    generator = np.random.default_rng(0)
    for size in (0.02, 0.2):
        whitened = size * generator.standard_normal((50, fit.joint.gaussian.dimension))
        assert joint_density(fit, whitened).max() <= fit.joint.log_density + 1e-3
    assert joint_density(fit, np.zeros((1, fit.joint.gaussian.dimension)))[0] == pytest.approx(fit.joint.log_density)


def test_some_videos_of_a_fit_come_where_they_do_by_themselves() -> None:
    all_three = fit_together([sliding(3), colliding(1), sliding(2)], model=BASE, model_error=False)
    some, alone = all_three.of_some([1, 2]), fit_together([colliding(1), sliding(2)], model=BASE, model_error=False)
    assert some.videos == alone.videos
    assert some.joint.numbers.keys == alone.joint.numbers.keys
    assert some.joint.log_density == pytest.approx(alone.joint.log_density, abs=0.1)
    apart = (some.joint.gaussian.mean - alone.joint.gaussian.mean) / alone.joint.gaussian.sd
    assert np.abs(apart).max() < 0.2


def joint_density(fit: SharedFit, whitened: np.ndarray) -> np.ndarray:
    """Density of the vector of all numbers, put together here from the densities of the single videos."""
    gaussian, numbers = fit.joint.gaussian, fit.joint.numbers
    count = len(numbers)
    shared = gaussian.mean + whitened[:, :count] @ gaussian.root.T
    total, begin = np.zeros(len(whitened)), count
    for video, part, local in zip(fit.joint.videos, fit.fits, gaussian.locals, strict=True):
        size = len(local.centre)
        own = local.centre + (shared - gaussian.mean) @ local.slope.T + whitened[:, begin : begin + size] @ local.root.T
        begin += size
        points = np.empty((len(whitened), len(part.likelihood.coordinates)))
        points[:, video.shared_places] = shared + video.offset
        points[:, video.local_places] = own
        vector = torch.from_numpy(points)
        with torch.no_grad():
            density = part.likelihood.log_density(vector).numpy()
            prior = part.likelihood.coordinates.log_prior(vector)[:, video.shared_places].sum(dim=1).numpy()
        total += density - prior
    return total + numbers.log_prior(shared)


@pytest.mark.slow
def test_both_samplers_agree_with_plain_emcee_on_the_whole_vector() -> None:
    fit = fit_together([sliding(1), sliding(2)], model=BASE)
    dimension, count = fit.joint.gaussian.dimension, len(fit.joint.numbers)
    walkers = 4 * dimension
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DEMove(gamma0=1.0), 0.2)]
    sampler = emcee.EnsembleSampler(
        walkers, dimension, lambda points: joint_density(fit, points), moves=moves, vectorize=True
    )
    random = np.random.RandomState(5)
    state = emcee.State(random.standard_normal((walkers, dimension)), random_state=random.get_state())
    # Its steps of straight differences need a hundred times as long round the corner of friction and drag.
    sampler.run_mcmc(state, 15_000, progress=False)
    whitened = sampler.get_chain(discard=3000)[..., :count]
    plain = fit.joint.gaussian.mean + whitened @ fit.joint.gaussian.root.T
    lasting = emcee.autocorr.integrated_time(plain, quiet=True)
    for name in ("gibbs", "laplace"):
        posterior = sample_together(fit, sampler=name, draws=4000)
        assert posterior.convergence.converged
        for place in range(count):
            ours, sd = posterior.points[..., place], plain[..., place].std()
            error = sd * np.sqrt(lasting[place] / plain[..., 0].size) + standard_error(ours)
            assert abs(plain[..., place].mean() - ours.mean()) < 4 * error
            assert abs(sd - ours.std()) < 4 * np.hypot(error_of_spread(ours), error_of_spread(plain[..., place].T))


def test_the_whole_vector_has_the_density_of_its_videos_and_its_slope() -> None:
    fit = two()
    vector = WholeVector(fit.joint)
    whitened = 0.3 * np.random.default_rng(0).standard_normal((20, fit.joint.gaussian.dimension))
    cloud = Gaussian.from_precision(vector.mode.point, vector.mode.precision)
    points = cloud.mean + whitened @ cloud.root.T
    assert evaluate(vector, points) == pytest.approx(joint_density(fit, whitened), abs=1e-8)
    along = 1e-5 * cloud.root.T
    _, slopes = evaluate_with_gradient(vector, points[:1])
    changes = (evaluate(vector, points[0] + along) - evaluate(vector, points[0] - along)) / 2
    assert changes == pytest.approx(along @ slopes[0], rel=1e-3, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["emcee", "nuts"])
def test_samplers_of_one_video_agree_with_gibbs_on_two(sampler: str) -> None:
    fit = fit_together([sliding(1), sliding(2)], model=BASE)
    ours, theirs = (sample_together(fit, sampler=name, draws=800) for name in (sampler, "gibbs"))
    assert ours.convergence.converged, ours.convergence.sentence
    for place in range(len(fit.joint.numbers)):
        first, second = ours.points[..., place], theirs.points[..., place]
        error = np.hypot(standard_error(first), standard_error(second))
        assert abs(first.mean() - second.mean()) < 4.5 * error
        assert first.std() == pytest.approx(second.std(), rel=0.25)
    video = ours.video("slide 1")
    np.testing.assert_allclose(
        video.data["posterior"]["sliding_friction"].values, ours.shared["sliding_friction"].values
    )
    assert video.convergence.sampler == sampler


def standard_error(draws: np.ndarray) -> float:
    return float(draws.std() / np.sqrt(chain_statistics(draws.reshape(4, -1, 1)).ess_bulk))


def error_of_spread(draws: np.ndarray) -> float:
    """Standard error of the standard deviation, which heavy tails widen."""
    return standard_error((draws - draws.mean()) ** 2) / (2 * float(draws.std()))


@pytest.mark.parametrize("sampler", ["gibbs", "laplace"])
def test_the_truth_is_covered_and_nothing_is_wrong(sampler: str) -> None:
    posterior = posterior_of_two(sampler)
    assert posterior.convergence.converged, posterior.convergence.sentence
    assert posterior.warnings == ()
    for name, truth in (("sliding_friction", FRICTION), ("air_drag", DRAG)):
        summary = posterior.summary(name)
        assert abs(summary.mean - truth) < 3.5 * summary.sd
    noise = posterior.shared["noise_scale"]
    assert float(noise.mean()) * noise.attrs["reference_m"] == pytest.approx(NOISE, rel=0.2)
    assert float(posterior.map_estimate["sliding_friction"]) == pytest.approx(FRICTION, rel=0.1)


@pytest.mark.parametrize("sampler", ["gibbs", "laplace"])
def test_each_video_has_a_posterior_that_goes_with_the_shared_draws(sampler: str) -> None:
    posterior = posterior_of_two(sampler)
    for name in ("hit 1", "slide 2"):
        video = posterior.video(name)
        assert video.tracks.video == name
        np.testing.assert_allclose(
            video.data["posterior"]["sliding_friction"].values, posterior.shared["sliding_friction"].values
        )
        assert len(video.worlds(10)) == 10
    (pair,) = posterior.video("hit 1").mass_ratios()
    assert pair.summary.sd < 0.3 * pair.summary.mean
    assert posterior.video("hit 1").warnings == ()


def test_what_is_reported_of_each_video_is_judged() -> None:
    for sampler in ("gibbs", "laplace"):
        assert posterior_of_two(sampler).convergence.sampler == sampler
    shared, own = (one.convergence for one in (posterior_of_two("gibbs"), posterior_of_two("gibbs").video("hit 1")))
    assert shared.worst in ("the sliding friction", "the air drag", "the noise scale")
    assert own.worst is not None
    assert own.worst.startswith("the ")


@pytest.mark.slow
def test_a_mass_ratio_that_is_not_known_well_enough_keeps_chains_going(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Reported] = []

    def all_but_combinations(_by_chain: object, _by_time: object, reported: Reported | None, **_goals: float) -> bool:
        asked.extend([] if reported is None else [reported])
        return reported is None

    monkeypatch.setattr(gibbs, "settled", all_but_combinations)
    fit = two()
    reported = [Reported.of(p.likelihood.coordinates, p.contacts, p.likelihood.tracks.bodies) for p in fit.fits]
    draws = sample_gibbs(fit.joint, generator=np.random.default_rng(0), rounds=1, reported=reported)
    assert [one.names for one in asked] == [("the mass ratio of objects 0 and 1", "the restitution of objects 0 and 1")]
    assert draws.notes == ("It stopped after 32 sweeps.",)


@pytest.mark.slow
def test_gibbs_goes_on_where_weights_cannot_be_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(together, "PARETO_K_GOAL", -np.inf)
    monkeypatch.setattr(together, "sample_gibbs", partial(sample_gibbs, rounds=1))
    handed_on = sample_together(two(), sampler="laplace", draws=100)
    assert handed_on.convergence.sampler == "gibbs"
    assert "The fast way could not be trusted (Pareto k " in handed_on.warnings[0]
    kept = sample_together(two(), sampler="laplace", draws=100, hand_on=False)
    assert kept.convergence.sampler == "laplace"


def test_doubts_about_the_search_of_a_video_are_told() -> None:
    fit, in_doubt = two(), ModeSearch(done=True, attempts=3, agreed=False)
    fits = (replace(fit.fits[0], search=in_doubt), *fit.fits[1:])
    posterior = sample_together(replace(fit, fits=fits), sampler="laplace", draws=100, hand_on=False)
    assert f"hit 1: {in_doubt.sentence}" in posterior.warnings


def test_intervals_narrow_with_the_root_of_the_number_of_videos_and_cover_the_truth() -> None:
    # drag is known, so that all that is learned of friction comes from the videos
    known = replace(AIR_DRAG, prior=Prior(float(np.log(DRAG)), 0.01))
    model = PhysicsModel("drag known", BASE.effects, {"air_drag": known})
    groups = [fit_together([sliding(3 * group + k) for k in range(3)], model=model) for group in range(2)]
    single = [fit_together([sliding(seed)], model=model) for seed in range(3)]
    place = groups[0].joint.numbers.names.index("sliding_friction")
    information = sum(fit.joint.gaussian.sd[place] ** -2 for fit in single)
    assert groups[0].joint.gaussian.sd[place] == pytest.approx(information**-0.5, rel=0.1)
    away = [(fit.joint.gaussian.mean[place] - np.log(FRICTION)) / fit.joint.gaussian.sd[place] for fit in groups]
    assert np.abs(away).max() < 3.5
    assert np.mean(np.square(away)) < 5


def test_noise_is_shared_in_metres_where_bodies_differ_in_size() -> None:
    small, large = sliding(1), sliding(2)
    large = Tracks("large", (Body("0", large.bodies[0].shape, 0.5),), large.data)
    fit = fit_together([small, large], model=BASE)
    sizes = [
        np.exp(part.point[part.likelihood.coordinates.places["noise_scale", None]])
        * part.likelihood.observations.position_reference
        for part in fit.fits
    ]
    assert sizes[0] == pytest.approx(sizes[1])
    assert sizes[0] == pytest.approx(NOISE, rel=0.25)


@pytest.mark.slow
def test_what_is_not_shared_stays_each_video_s_own() -> None:
    fit = fit_together([sliding(1), sliding(2, noise=0.02)], model=BASE, shared=["air_drag"])
    assert fit.joint.numbers.names == ("air_drag",)
    scales = [part.point[part.likelihood.coordinates.places["noise_scale", None]] for part in fit.fits]
    assert np.exp(scales[1] - scales[0]) == pytest.approx(5, rel=0.4)
    posterior = sample_together(fit, sampler="laplace", draws=100, hand_on=False)
    assert list(posterior.shared) == ["air_drag"]
    one = fit_together([sliding(1)], model=BASE, shared=[])
    alone = sample_together(one, sampler="laplace", draws=100, hand_on=False)
    assert list(alone.shared) == []
    assert "posterior" not in alone.to_arviz().groups()  # ArviZ keeps no empty group
    assert alone.video("slide 1").draw_count == 100
    for sampler in ("gibbs", "emcee"):
        chains = sample_together(one, sampler=sampler, draws=100)
        assert list(chains.shared) == []
        assert chains.video("slide 1").draw_count >= 100
        assert np.isfinite(predictive_log_density(chains, sliding(2)).log_density)


def test_walls_at_the_same_place_share_their_restitution() -> None:
    walls = (Wall(2.0, -3.0, 2.0, 3.0, None), Wall(-2.0, -3.0, -2.0, 3.0, 0.9))
    first = Tracks("first", sliding(1).bodies, sliding(1).data, walls)
    again = (Wall(2.0, 3.0, 2.0, -3.0, None), Wall(0.0, 3.0, 2.0, 3.0, None))
    second = Tracks("second", sliding(2).bodies, sliding(2).data, again)
    fit = fit_together([first, second], model=BASE)
    names = [name for name in fit.joint.numbers.names if name.startswith("wall")]
    assert names == ["wall_restitution(2, -3, 2, 3)", "wall_restitution(0, 3, 2, 3)"]
    posterior = sample_together(fit, sampler="laplace", draws=50, hand_on=False)
    assert posterior.shared["wall_restitution"].sizes == {"chain": 1, "draw": 50, "wall": 2}
    drawn = posterior.video("second").data["posterior"]["wall_restitution"]
    np.testing.assert_allclose(drawn.values, posterior.shared["wall_restitution"].values)


def test_the_same_seed_gives_the_same_numbers_whatever_the_order() -> None:
    again = sample_together(fit_together([colliding(1), sliding(2)], model=BASE), sampler="laplace", draws=800)
    first = posterior_of_two("laplace")
    np.testing.assert_array_equal(again.points, first.points)
    assert again.video("hit 1").data.equals(first.video("hit 1").data)
    turned = fit_together([sliding(2), colliding(1)], model=BASE)
    assert turned.joint.gaussian.mean == pytest.approx(
        two().joint.gaussian.mean, abs=0.1 * two().joint.gaussian.sd.min()
    )


def test_a_posterior_is_written_and_read_again(tmp_path: Path) -> None:
    posterior = posterior_of_two("laplace")
    posterior.write(tmp_path / "shared.nc")
    again = SharedPosterior.read(tmp_path / "shared.nc")
    assert again.shared.equals(posterior.shared)
    assert again.map_estimate.equals(posterior.map_estimate)
    assert again.shared["sliding_friction"].attrs == {"units": "1"}
    assert (again.seed, again.warnings, again.convergence) == (0, (), posterior.convergence)
    assert again.numbers == posterior.numbers
    assert list(again.videos) == ["hit 1", "slide 2"]
    assert again.video("hit 1").data.equals(posterior.video("hit 1").data)
    assert predictive_log_density(again, sliding(3)) == predictive_log_density(posterior, sliding(3))
    (tmp_path / "other.nc").write_text("nothing", encoding="utf-8")
    with pytest.raises(InputError, match=r"other\.nc"):
        SharedPosterior.read(tmp_path / "other.nc")
    with pytest.raises(InputError, match="the posterior of several videos; open it"):
        Posterior.read(tmp_path / "shared.nc")
    posterior.video("hit 1").write(tmp_path / "one.nc")
    with pytest.raises(InputError, match="the posterior of one video; open it with"):
        SharedPosterior.read(tmp_path / "one.nc")
    with h5py.File(tmp_path / "shared.nc", "a") as file:
        file.attrs["format"] = 7
    with pytest.raises(InputError, match="the posterior is of file format 7, this program reads 1; run"):
        SharedPosterior.read(tmp_path / "shared.nc")


def test_what_is_shared_goes_to_arviz() -> None:
    posterior = posterior_of_two("gibbs")
    data = posterior.to_arviz()
    assert arviz.summary(data, kind="stats").loc["sliding_friction", "mean"] == pytest.approx(FRICTION, rel=0.1)
    total = sum(values.values for values in data["log_prior"].data_vars.values())
    expected = posterior.numbers.log_prior(posterior.points.reshape(-1, posterior.points.shape[-1]))
    assert total.ravel() == pytest.approx(expected)


def test_a_held_out_video_is_as_probable_as_the_evidence_of_all_says() -> None:
    posterior = posterior_of_two("laplace")
    more = infer_together([colliding(1), sliding(2), sliding(3)], model=BASE, sampler="laplace")
    found = predictive_log_density(posterior, sliding(3))
    assert found.trusted
    assert found.error < 0.15
    assert found.log_density == pytest.approx(more.log_evidence - posterior.log_evidence, abs=0.5)


def test_another_model_is_fitted_from_what_is_known() -> None:
    fit = two()
    extended = fit.under(BASE.with_effect(BodyFriction()))
    fresh = fit_together([colliding(1), sliding(2)], model=BASE.with_effect(BodyFriction()))
    assert extended.joint.converged
    assert extended.joint.log_density == pytest.approx(fresh.joint.log_density, abs=0.3)
    assert extended.log_evidence == pytest.approx(fresh.log_evidence, abs=0.3)
    assert extended.log_evidence < fit.log_evidence  # all bodies slide alike


def test_a_video_that_the_model_does_not_explain_is_named() -> None:
    odd = sliding(9, friction=3 * FRICTION)
    videos = [sliding(1), sliding(2), sliding(3), odd]
    posterior = infer_together(videos, model=BASE, sampler="laplace", draws=100, hand_on=False)
    assert [sentence for sentence in posterior.warnings if sentence.startswith("slide 9: The model does not explain")]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"videos": []}, "there are 0 videos"),
        ({"shared": "air_drag"}, r"give a list of names: \['air_drag'\]"),
        ({"videos": [sliding(1), sliding(1)]}, "2 videos have the name 'slide 1'"),
        ({"shared": ["wind"]}, "videos cannot share 'wind' under the model base"),
        ({"shared": ["mass"]}, "videos cannot share 'mass'"),
        ({"sampler": "metropolis"}, "sampler 'metropolis' is not known for several videos"),
        ({"draws": 2}, "draws is 2"),
        ({"seed": -1}, "seed is -1"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(arguments: dict[str, object], sentence: str) -> None:
    given: dict[str, object] = {"videos": [sliding(1)], "model": BASE} | arguments
    with pytest.raises(InputError, match=sentence):
        infer_together(**given)  # type: ignore[arg-type]  # some are wrong on purpose


def test_a_video_that_fits_no_world_of_the_others_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    value = LinkedVideo.value

    def impossible(video: LinkedVideo, *point: np.ndarray) -> float:
        return -np.inf if video.name == "slide 2" else value(video, *point)

    monkeypatch.setattr(LinkedVideo, "value", impossible)
    with pytest.raises(InputError, match="no common world: slide 2 cannot be simulated"):
        infer_together([sliding(1), sliding(2)], model=BASE)


def test_a_video_without_motion_is_refused_by_name() -> None:
    resting = sliding(2)
    places = np.zeros((30, 1, 2)) + 0.001 * np.random.default_rng(0).standard_normal((30, 1, 2))
    still = Tracks.from_arrays("still", resting.bodies, resting.times, places)
    with pytest.raises(InputError, match="still: no object moves"):
        infer_together([sliding(1), still], model=BASE)


def test_an_unknown_video_or_quantity_is_refused() -> None:
    posterior = posterior_of_two("laplace")
    with pytest.raises(InputError, match="no video 'slide 3'; the videos are hit 1, slide 2"):
        posterior.video("slide 3")
    with pytest.raises(InputError, match="share no single 'mass'; they share sliding_friction, air_drag, noise_scale"):
        posterior.summary("mass")


@pytest.mark.slow
def test_memory_does_not_grow_with_the_number_of_videos() -> None:
    """Peak memory of a process that fits and samples 100 videos, over that of 10."""
    script, root = Path(__file__).with_name("peak_memory.py"), Path(__file__).parents[3]
    peaks = {}
    for count in (10, 100):
        done = subprocess.run(
            [sys.executable, str(script), str(count)],
            capture_output=True,
            text=True,
            check=True,
            env=os.environ | {"PYTHONPATH": str(root)},
        )
        peaks[count] = float(done.stdout)
    assert peaks[100] < peaks[10] + 150  # MB; the draws of 100 videos take some 40


def test_lbfgs_finds_the_joint_fit_of_gauss_newton() -> None:
    fit = fit_together([colliding(1), sliding(2)], model=BASE, plan=FitPlan(Optimiser.LBFGS))
    assert fit.joint.converged
    assert fit.joint.log_density == pytest.approx(two().joint.log_density, abs=0.2)
    distance = np.linalg.solve(two().joint.gaussian.root, fit.joint.gaussian.mean - two().joint.gaussian.mean)
    assert np.linalg.norm(distance) < 0.5


def test_the_paper_stages_start_a_joint_fit() -> None:
    fit = fit_together([sliding(1), sliding(2)], model=BASE, plan=replace(CURRICULUM, optimiser=Optimiser.LBFGS))
    assert fit.joint.converged
    assert abs(float(np.log(fit.value("sliding_friction") / FRICTION))) < 0.5


def test_the_gradient_of_all_numbers_is_that_of_the_joint_density() -> None:
    joint = two().joint
    units = _Whitened(joint.numbers, joint.videos, joint.gaussian, failed=1e6)
    generator = np.random.default_rng(0)
    place, direction = 0.3 * generator.standard_normal((2, joint.gaussian.dimension))
    step = 1e-4 * direction
    change = units.cost(place + step)[0] - units.cost(place - step)[0]
    assert units.cost(place)[1] @ (2 * step) == pytest.approx(change, rel=1e-4)
    assert units.cost(np.zeros(len(place)))[0] == pytest.approx(-joint.log_density)


def test_a_climb_from_no_world_names_the_video() -> None:
    joint = two().joint
    locals_ = [local.centre.copy() for local in joint.gaussian.locals]
    locals_[1][:] = np.nan
    with pytest.raises(ImpossibleStartError, match="slide 2"):
        climb_by_gradient(joint.numbers, joint.videos, joint.gaussian.mean, locals_)


def test_single_videos_keep_their_fits_under_a_plan_without_several_starts() -> None:
    alone = [fit_alone(tracks, BASE, seed=0, plan=CURRICULUM) for tracks in (colliding(1), sliding(2))]
    bad = replace(alone[0], misfit=replace(alone[0].misfit, residual_sd=3 * alone[0].misfit.residual_sd))
    assert doubtful([bad, alone[1]]) == [0]
    fits, _ = joined([bad, alone[1]], BASE, None, seed=0, plan=CURRICULUM)
    assert fits[0] is bad
