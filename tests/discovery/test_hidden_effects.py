"""Discovery finds what is hidden in measured data, and nothing where nothing is: a thin slice of the whole grid.

The whole grid is `benchmarks/discovery.py`.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.discovery.causes import CATALOGUE
from tests.discovery.data_set import DataSet, Truth
from tests.discovery.hidden import ROUGH, hide
from tests.discovery.scales import scaled
from tests.discovery.scenes import Setting
from vrdp_prob import load_all
from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.finding import Finding, Verdict
from vrdp_prob.discovery.selection.search import gain_needed
from vrdp_prob.inference import default_model
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.physics import PhysicsModel

SMALL = Setting(videos=3, bodies=3)
PAIRS = Setting(videos=3, bodies=2, frames=60)
LARGER = Setting(videos=6, bodies=3)
SURE = 0.9
SMOOTH = ("surface_tilt", "linear_drag", "magnus_curl", "time_varying_friction", "contact_friction")
"""Causes that act on all bodies of all videos: the search for these alone is fast."""


def finding_of(
    folder: Path,
    ways: Sequence[str],
    *,
    seed: int,
    effect_size: float = 4.0,
    setting: Setting = SMALL,
    catalogue: Collection[str] | None = None,
    processes: int = 1,
) -> tuple[Truth, Finding]:
    """What discovery says of a tracks folder, and the truth, which the folder does not tell."""
    truth = hide(ways, seed=seed, effect_size=effect_size, setting=setting).write(folder)
    known = known_effects()
    looked_for = None if catalogue is None else [known[name]() for name in catalogue]
    return truth, discover(load_all(folder), seed=0, catalogue=looked_for, processes=processes)


@pytest.mark.slow
def test_a_tilt_is_named_on_a_table_of_marbles(tmp_path: Path) -> None:
    """Small bodies spin fast, and everything happens in a third of the time."""
    data = hide(["surface_tilt"], seed=1, effect_size=3.0, setting=LARGER)
    DataSet([scaled(one, length=0.1, time=0.316) for one in data.tracks], data.truth).write(tmp_path)
    finding = discover(load_all(tmp_path), seed=0)
    assert finding.verdict is Verdict.NAMED
    assert [cause.name for cause in finding.causes if cause.named] == ["surface_tilt"]


@pytest.fixture(scope="module")
def tilted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Truth, Finding]:
    return finding_of(tmp_path_factory.mktemp("tilted"), ["surface_tilt"], seed=1, catalogue=SMOOTH)


@pytest.mark.slow
def test_a_tilt_is_named_and_left_out_videos_are_predicted_better(tilted: tuple[Truth, Finding]) -> None:
    _, finding = tilted
    assert finding.verdict is Verdict.NAMED
    first = finding.causes[0]
    assert first.name == "surface_tilt"
    assert first.named
    assert first.probability > SURE
    assert first.name in [effect.name for effect in finding.extended.effects]
    gain = first.gain
    assert gain.elpd_difference > 10
    assert sum(one > 0 for one in gain.by_video.values()) >= 2


@pytest.mark.slow
def test_the_extended_model_believes_what_the_videos_say(tilted: tuple[Truth, Finding], tmp_path: Path) -> None:
    truth, finding = tilted
    laws = truth.videos[0].laws
    for name, true in (("tilt_x", laws.tilt_x), ("tilt_y", laws.tilt_y)):
        belief = finding.extended.beliefs[name]
        estimate = finding.causes[0].parameters[name]
        assert (belief.prior.mean, belief.prior.sd) == pytest.approx((estimate.mean, estimate.sd))
        assert abs(belief.default - true) < 4 * belief.prior.sd < 4 * 0.01
        given, extended = finding.left_out[finding.videos[0]]
        assert name not in given.beliefs
        assert extended.beliefs[name].prior.sd > belief.prior.sd
    finding.extended.write(tmp_path / "model.toml")
    read = PhysicsModel.read(tmp_path / "model.toml")
    assert {one.name: one for one in read.parameters} == {one.name: one for one in finding.extended.parameters}


@pytest.mark.slow
def test_among_all_causes_of_the_catalogue_dropped_frames_are_named(tmp_path: Path) -> None:
    truth, finding = finding_of(tmp_path, ["frames_dropped_often"], seed=2, setting=PAIRS)
    assert finding.verdict is Verdict.NAMED
    (cause,) = (one for one in finding.causes if one.named)
    assert (cause.name, cause.effect) == ("clock_error", "dropped_frames")
    assert cause.probability > SURE
    assert cause.gain.elpd_difference > 100
    interval = cause.parameters["dropped_frame_time"]
    assert interval.q025 < 1 / truth.videos[0].frame_rate < interval.q975


@pytest.mark.slow
def test_restitution_by_speed_is_named_from_six_contacts(tmp_path: Path) -> None:
    """What it does is nearly what the middle of restitutions does, which is learned from the same contacts."""
    truth, finding = finding_of(
        tmp_path, ["speed_dependent_restitution"], seed=2, effect_size=3.0, setting=Setting(videos=6, bodies=2)
    )
    assert [cause.name for cause in finding.causes if cause.named] == ["speed_dependent_restitution"]
    exponent = finding.causes[0].parameters["restitution_exponent"]
    assert exponent.q025 < truth.causes[0].strength < exponent.q975
    assert exponent.q975 - exponent.q025 > 0.3  # it is known by no more than six contacts tell


def test_a_check_shows_it(tilted: tuple[Truth, Finding]) -> None:
    _, finding = tilted
    assert next(check for check in finding.checks if check.name == "push in one direction").significant


def test_nothing_is_found_where_nothing_is_hidden_and_the_same_seed_says_the_same_in_two_processes(
    tmp_path: Path,
) -> None:
    first, again = (
        finding_of(tmp_path / str(processes), [], seed=1, catalogue=SMOOTH, processes=processes)[1]
        for processes in (1, 2)
    )
    assert first.verdict is Verdict.NONE
    assert not first.named
    assert first.extended.effects == first.model.effects
    assert any(bound.bound is not None for bound in first.upper_bounds)
    assert again.checks == first.checks
    assert again.upper_bounds == first.upper_bounds


@pytest.mark.parametrize("seed", [11, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (4, 12, 13, 14, 16))])
def test_a_cause_and_a_strength_that_a_seed_draws_are_found(seed: int, tmp_path: Path) -> None:
    generator = np.random.default_rng(seed)
    way, effect_size = str(generator.choice(SMOOTH)), float(generator.uniform(4.0, 8.0))
    _, finding = finding_of(tmp_path, [way], seed=seed, effect_size=effect_size, setting=PAIRS, catalogue=SMOOTH)
    assert finding.verdict is Verdict.NAMED
    assert finding.causes[0].name == way
    assert finding.causes[0].gain.elpd_difference > gain_needed(len(SMOOTH))


@pytest.mark.parametrize("seed", [2, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 3, 4, 5, 6))])
def test_any_cause_that_a_seed_draws_is_found_among_all(seed: int, tmp_path: Path) -> None:
    """Nobody tells discovery which of the twenty it may be."""
    generator = np.random.default_rng(seed)
    way, effect_size = str(generator.choice(sorted(CATALOGUE))), float(generator.uniform(4.0, 8.0))
    setting = Setting(videos=6, bodies=2)
    _, finding = finding_of(tmp_path, [way], seed=seed, effect_size=effect_size, setting=setting)
    assert finding.verdict is Verdict.NAMED
    assert finding.causes[0].name == way
    assert finding.causes[0].gain.elpd_difference > gain_needed(len(CATALOGUE))


def test_a_cause_that_is_taken_out_of_the_catalogue_ends_as_unknown(tmp_path: Path) -> None:
    way, given = "time_varying_friction", {effect.name for effect in default_model().effects}
    others = [name for name in known_effects() if name != way and name not in given]
    _, finding = finding_of(tmp_path, [way], seed=1, effect_size=6.0, setting=PAIRS, catalogue=others)
    assert finding.verdict is Verdict.UNKNOWN
    assert all(cause.probability < SURE / 2 for cause in finding.causes)


def test_a_cause_needs_no_endless_gain_where_none_is_looked_for() -> None:
    assert gain_needed(0) == gain_needed(1) > 0


@pytest.mark.slow
def test_with_no_cause_to_look_for_what_is_wrong_is_unknown(tmp_path: Path) -> None:
    _, finding = finding_of(tmp_path, ["surface_tilt"], seed=1, catalogue=())
    assert finding.verdict is Verdict.UNKNOWN
    assert (finding.causes, finding.upper_bounds, finding.tried) == ((), (), ())
    assert any(note.startswith("How strong other causes can be at most is not told") for note in finding.notes)
    assert finding.extended.effects == finding.model.effects


@pytest.mark.slow
def test_two_causes_are_both_found(tmp_path: Path) -> None:
    truth, finding = finding_of(
        tmp_path, ["surface_tilt", "linear_drag"], seed=1, effect_size=5.0, setting=PAIRS, catalogue=SMOOTH
    )
    assert finding.verdict is Verdict.NAMED
    assert {cause.name for cause in finding.named} == {cause.name for cause in truth.causes}
    assert finding.gain is not None
    assert finding.gain.elpd_difference > gain_needed(len(SMOOTH))


@pytest.mark.slow
def test_what_has_no_name_ends_as_unknown(tmp_path: Path) -> None:
    _, finding = finding_of(tmp_path, ["shaking"], seed=1, effect_size=6.0, setting=PAIRS, catalogue=SMOOTH)
    assert finding.verdict is Verdict.UNKNOWN
    assert finding.upper_bounds
    assert finding.description is not None
    assert finding.description.size is not None
    assert all(bound.bound is None for bound in finding.upper_bounds)


@pytest.mark.slow
def test_a_cause_that_is_not_looked_for_is_not_called_another_one(tmp_path: Path) -> None:
    _, finding = finding_of(tmp_path, ["surface_tilt"], seed=1, catalogue=SMOOTH[1:])
    assert finding.verdict is Verdict.UNKNOWN
    if any(cause.probability > 0.45 for cause in finding.causes):
        pytest.xfail("a curl takes the place of the slope: 1.00, halved under `unknown`")


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    "way", ["linear_drag", "rotating_table", "lens_distortion", "contact_radius_error", "slip_to_roll", "bowl"]
)
def test_a_cause_is_named(way: str, tmp_path: Path) -> None:
    _, finding = finding_of(tmp_path, [way], seed=1, effect_size=6.0, setting=LARGER)
    assert finding.verdict is Verdict.NAMED
    assert finding.causes[0].name == way
    assert finding.causes[0].gain.elpd_difference > 0


@pytest.mark.slow
@pytest.mark.parametrize("way", ["surface_tilt", "rotating_table"])
def test_a_cause_is_named_alone_where_videos_easily_take_a_wrong_course(way: str, tmp_path: Path) -> None:
    _, finding = finding_of(tmp_path, [way], seed=2, effect_size=3.0, setting=LARGER)
    assert finding.verdict is Verdict.NAMED
    assert [cause.name for cause in finding.named] == [way]
    assert finding.named[0].probability > SURE


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_friction_that_ends_all_sliding_may_be_larger_still(tmp_path: Path) -> None:
    truth, finding = finding_of(tmp_path, ["contact_friction"], seed=2, effect_size=3.0, setting=LARGER)
    assert [cause.name for cause in finding.named] == ["contact_friction"]
    found, true = finding.named[0].parameters["contact_friction"], truth.causes[0].strength
    assert found.q025 < true < found.q975
    assert finding.extended.beliefs["contact_friction"].prior.sd > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 4, 7])
def test_a_single_video_on_a_wrong_course_is_no_false_alarm(seed: int, tmp_path: Path) -> None:
    _, finding = finding_of(tmp_path, [], seed=seed, setting=replace(LARGER, resistance=0.05))
    assert finding.verdict is Verdict.NONE


@pytest.mark.slow
def test_nor_is_one_among_outliers(tmp_path: Path) -> None:
    hide([], seed=14, setting=LARGER, measurement=ROUGH).write(tmp_path)
    assert discover(load_all(tmp_path), seed=0, processes=1).verdict is Verdict.NONE


@pytest.mark.slow
def test_walls_that_nobody_states_are_found_by_bodies_of_any_shape(tmp_path: Path) -> None:
    hide([], seed=2, setting=replace(LARGER, arena=2.0, late=0.0, resistance=0.2)).write(tmp_path)
    finding = discover([replace(tracks, walls=()) for tracks in load_all(tmp_path)], seed=0, processes=1)
    found = {cause.effect: cause.parameters for cause in finding.causes if cause.named}
    assert set(found) == {"wall", "second_wall", "third_wall", "fourth_wall"}
    distances = [value.mean for one in found.values() for name, value in one.items() if name.endswith("wall_distance")]
    assert np.abs(distances) == pytest.approx([2.0] * 4, abs=0.002)
