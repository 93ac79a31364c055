"""Floor, pixel odds, outline fits, attributes and noise, each by itself."""

import numpy as np
import pytest
from drawing import COLORS, RADIUS, Stage, Thing, line, resting

from vrdp_prob.perception.appearance import Appearance, frame_evidence
from vrdp_prob.perception.attributes import (
    color_probabilities,
    look,
    material_probabilities,
    shape_probabilities,
)
from vrdp_prob.perception.background import Background, estimate_background
from vrdp_prob.perception.contour import fit_contour
from vrdp_prob.perception.noise import position_covariance
from vrdp_prob.perception.placing import Sighting
from vrdp_prob.perception.solids import Pose, Solid
from vrdp_prob.scene import Camera, Shape


def frames_of(stage: Stage, count: int) -> np.ndarray:
    rng = np.random.default_rng(1)
    return np.stack([stage.frame(index, rng) for index in range(count)])


def camera_of(stage: Stage, pixel_sd: float = 0.0) -> Camera:
    return Camera(stage.projection(), stage.width, stage.height, pixel_sd=pixel_sd)


def test_an_object_that_rests_all_the_time_is_no_floor() -> None:
    things = [Thing("cube", "gray", resting((0.0, 0.0), 6)), Thing("sphere", "red", line((-1, -1), (1, -1), 6))]
    stage, empty = Stage(things), Stage()
    floor = estimate_background(frames_of(stage, 6)).picture
    bare = empty.frame(0, np.random.default_rng(2)).astype(float)
    assert np.abs(floor - bare).max() < 12


def test_shadow_is_no_object_and_colour_is() -> None:
    floor = np.full((40, 40, 3), 150.0)
    picture = floor.astype(np.uint8)
    picture[5:15, 5:15] = 80
    picture[20:30, 20:30] = COLORS["green"]
    evidence = frame_evidence(picture, Background(floor, 1.0))
    assert evidence.strange[22:28, 22:28].all()
    assert not evidence.strange[:18, :18].any()
    assert evidence.dark[7:13, 7:13].all()
    assert not evidence.dark[32:].any()


def test_an_appearance_knows_its_own_colours() -> None:
    red, blue = Appearance(), Appearance()
    floor = Background(np.full((4, 4, 3), 150.0), 1.0)
    bins = {
        name: frame_evidence(np.full((4, 4, 3), COLORS[name], np.uint8), floor).bins.ravel() for name in ("red", "blue")
    }
    red.learn(bins["red"])
    blue.learn(bins["blue"])
    assert red.log_density(bins["red"]).mean() > red.log_density(bins["blue"]).mean() + 4
    assert red.likeness(red) == pytest.approx(1.0)
    assert red.likeness(blue) < 0.1


@pytest.mark.parametrize("shape", list(Shape))
def test_the_outline_fit_finds_a_hundredth_of_a_radius(shape: Shape) -> None:
    stage = Stage([Thing(str(shape), "blue", resting((0.21, -0.13), 1), 0.3)], noise=0.5)
    start = Pose(0.21 + 0.02, -0.13 - 0.02, 0.3 + 0.05)
    picture = stage.frame(0, np.random.default_rng(0))
    fit = fit_contour(picture, camera_of(stage), Solid(shape, RADIUS), start, halves=(4.0, 3.5, 3.0))
    assert fit is not None
    assert np.hypot(fit.pose.x - 0.21, fit.pose.y + 0.13) < 0.008
    assert fit.support > 0.8
    if shape is Shape.CUBE:
        assert fit.pose.yaw == pytest.approx(0.3, abs=0.02)


def test_the_outline_fit_leaves_out_what_is_hidden_and_what_the_picture_cuts() -> None:
    stage = Stage([Thing("sphere", "blue", resting((0.0, 0.0), 1))], noise=0.5)
    camera, solid = camera_of(stage), Solid(Shape.SPHERE, RADIUS)
    picture = stage.frame(0, np.random.default_rng(0))
    middle = camera.project(np.array([0.0, 0.0, RADIUS]))
    cut = int(middle[0])
    half = picture[:, :cut].copy()
    narrow = Camera(camera.projection, cut, camera.height)
    fit = fit_contour(half, narrow, solid, Pose(0.02, 0.02), halves=(4.0, 3.5, 3.0))
    assert fit is not None
    assert np.hypot(fit.pose.x, fit.pose.y) < 0.012
    assert fit.used < 0.6
    everything = np.ones(picture.shape[:2], np.uint8)
    assert fit_contour(picture, camera, solid, Pose(0.0, 0.0), halves=(3.0,), covered=everything) is None


@pytest.mark.parametrize("name", list(COLORS))
@pytest.mark.parametrize("light", [0.6, 1.0, 1.25])
def test_colours_are_named_in_any_light(name: str, light: float) -> None:
    rng = np.random.default_rng(0)
    shades = light * rng.uniform(0.6, 1.1, 400)[:, None] * np.array(COLORS[name])
    pixels = np.clip(shades + rng.normal(0, 2, (400, 3)), 0, 255).astype(np.uint8)
    probabilities = color_probabilities([look(pixels)])
    assert sum(probabilities.values()) == pytest.approx(1.0)
    assert max(probabilities, key=lambda color: probabilities[color]) == name
    assert probabilities[name] > 0.9


def test_material_needs_a_highlight_to_be_metal_and_a_sphere_to_be_surely_rubber() -> None:
    rng = np.random.default_rng(0)
    matt = (rng.uniform(0.7, 1.1, 500)[:, None] * np.array(COLORS["red"])).astype(np.uint8)
    shiny = matt.copy()
    shiny[:25] = (250, 190, 190)
    assert material_probabilities([look(shiny)], Shape.SPHERE)["metal"] > 0.9
    assert material_probabilities([look(matt)], Shape.SPHERE)["rubber"] > 0.9
    assert 0.5 < material_probabilities([look(matt)], Shape.CUBE)["rubber"] < 0.7
    assert material_probabilities([look(shiny)], Shape.CUBE)["metal"] > 0.9


@pytest.mark.parametrize(("light_of_lid", "metal"), [(1.25, False), (0.9, True)])
def test_a_top_darker_than_the_sides_mirrors(light_of_lid: float, metal: bool) -> None:
    rng = np.random.default_rng(0)
    on_lid = np.arange(600) < 200
    light = np.where(on_lid, light_of_lid, 1.0) * rng.uniform(0.95, 1.05, 600)
    pixels = np.clip(light[:, None] * 0.7 * np.array(COLORS["cyan"]), 0, 255).astype(np.uint8)
    assert (material_probabilities([look(pixels, on_lid)], Shape.CUBE)["metal"] > 0.9) is metal


def test_shapes_are_sure_only_after_clear_evidence() -> None:
    scores = {Shape.SPHERE: -1.0, Shape.CUBE: -12.0, Shape.CYLINDER: -8.0}
    clear = shape_probabilities(scores, 4)
    assert clear[Shape.SPHERE] > 0.99
    none = shape_probabilities(dict.fromkeys(Shape, 0.0), 0)
    assert all(value == pytest.approx(1 / 3) for value in none.values())


def test_noise_grows_with_the_camera_s_reprojection_error_and_with_hidden_outline() -> None:
    stage = Stage([Thing("cylinder", "blue", resting((0.0, 0.0), 1))], noise=0.5)
    solid, picture = Solid(Shape.CYLINDER, RADIUS), stage.frame(0, np.random.default_rng(0))
    covered = np.zeros(picture.shape[:2], np.uint8)
    covered[:, : stage.width // 2] = 1
    camera = camera_of(stage)
    whole, half = (
        fit_contour(picture, camera, solid, Pose(0.0, 0.0), halves=(3.5, 3.0), covered=mask) for mask in (None, covered)
    )
    assert whole is not None
    assert half is not None
    sharp, blurred, hidden = (
        position_covariance(view, solid, Sighting(fit.pose, fit, 1.0, 5.0))
        for view, fit in ((camera, whole), (camera_of(stage, 1.0), whole), (camera, half))
    )
    assert sharp is not None
    assert blurred is not None
    assert hidden is not None
    to_plane = camera.plane_jacobian(np.array([whole.pose.x, whole.pose.y]), RADIUS)
    np.testing.assert_allclose(blurred - sharp, to_plane @ to_plane.T, rtol=1e-6)
    assert np.isfinite(hidden).all()
    assert np.linalg.det(half.information[:2, :2]) < 0.5 * np.linalg.det(whole.information[:2, :2])
    assert position_covariance(camera, solid, Sighting(whole.pose, None, 1.0, 5.0)) is None
