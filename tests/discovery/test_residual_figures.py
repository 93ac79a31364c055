"""Figures of what a model misses, and the window estimates that they show."""

from dataclasses import replace
from unittest.mock import create_autospec
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.discovery.fitted import fitted, moved
from tests.discovery.test_describe import PAIRS
from vrdp_prob.discovery import describe
from vrdp_prob.discovery.checks.contacts import DISTANCE
from vrdp_prob.discovery.checks.measurement import MEMORY
from vrdp_prob.discovery.checks.neighbours import roughness
from vrdp_prob.discovery.page import flight_figures
from vrdp_prob.discovery.page.figures import residual_figures, title_of
from vrdp_prob.discovery.page.plots import Plot, side_by_side
from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.missing_acceleration import Windows, missing_acceleration
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.report.axes import Axis
from vrdp_prob.scene import Body, Shape, Tracks

SVG = "{http://www.w3.org/2000/svg}"


def windows(fit: SharedFit) -> Windows:
    model = ResidualModel.of(fit)
    return missing_acceleration(FreeFlight.of(model).model, roughness(model))


def test_windows_of_a_tilted_table_show_its_push_and_those_of_a_null_nothing() -> None:
    data, tilted = fitted("surface_tilt", seed=2, setting=PAIRS)
    found = windows(tilted)
    laws = data.truth.videos[0].laws
    expected = 9.81 * np.array([laws.tilt_x, laws.tilt_y])
    weights = found.sd**-2
    mean = (found.acceleration * weights).sum(axis=0) / weights.sum(axis=0)
    assert mean @ expected / np.linalg.norm(mean) / np.linalg.norm(expected) > 0.9
    assert found.size == pytest.approx(np.linalg.norm(expected) / np.sqrt(2), rel=0.6)
    np.testing.assert_allclose(found.along**2 + found.across**2, (found.acceleration**2).sum(axis=1), rtol=1e-6)
    _, null = fitted(seed=1)
    assert windows(null).size < 0.2 * found.size


def test_a_video_that_lost_its_course_says_nothing_of_accelerations() -> None:
    _, tilted = fitted("surface_tilt", seed=2, setting=PAIRS)
    model = ResidualModel.of(tilted)
    changes = [np.zeros((*video.motion.speed.shape, 2)) for video in model.videos]
    changes[1][:, 0, 0] = 20.0 * model.videos[1].motion.times ** 2
    found = missing_acceleration(FreeFlight.of(moved(model, changes)).model, roughness(model))
    assert found.lost == (model.videos[1].linear.name,)
    assert set(found.video) == {0.0, 2.0}
    assert found.size == pytest.approx(windows(tilted).size, rel=0.5)


def test_no_video_says_anything_of_accelerations_that_its_own_tracks_rule_out() -> None:
    """As where the contacts of all videos last: then none stands out among them."""
    _, tilted = fitted("surface_tilt", seed=2, setting=PAIRS)
    model = ResidualModel.of(tilted)
    changes = [np.zeros((*video.motion.speed.shape, 2)) for video in model.videos]
    for change, video in zip(changes, model.videos, strict=True):
        change[:, 0, 0] = 20.0 * video.motion.times**2
    spoilt = moved(model, changes)
    found = missing_acceleration(FreeFlight.of(spoilt).model, roughness(model))
    assert len(found.lost) == len(model.videos)
    assert len(found.time) == 0
    description = describe.description_of(spoilt, [])
    assert description.size is None
    assert any(sentence.startswith("Far more is missing in") for sentence in description.sentences)
    first, *_ = describe._window_sentences(replace(found, lost=tuple(f"run{k}" for k in range(9))))
    assert first.startswith("Far more is missing in run0, run1, run2, run3, run4, run5, ... (9 in all) than")


def test_of_few_windows_no_size_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    _, tilted = fitted("surface_tilt", seed=2, setting=PAIRS)
    model = ResidualModel.of(tilted)
    number = len(windows(tilted).time)
    monkeypatch.setattr(describe, "FEWEST_WINDOWS", number)
    assert describe.description_of(model, []).size is not None
    monkeypatch.setattr(describe, "FEWEST_WINDOWS", number + 1)
    few = describe.description_of(model, [])
    assert few.size is None
    assert "No missing acceleration shows in free flight." in few.sentences


def test_there_is_a_figure_of_each_aspect_and_it_is_an_svg_element() -> None:
    _, fit = fitted(seed=1)
    alone, both = residual_figures(fit, None), residual_figures(fit, fit)
    assert list(alone) == list(both)
    assert list(both)[:3] == [
        "Missing acceleration over the plane",
        "Missing acceleration against speed",
        "Missing acceleration against time",
    ]
    for before, after in zip(alone.values(), both.values(), strict=True):
        element, larger = ElementTree.fromstring(before), ElementTree.fromstring(after)
        assert element.tag == f"{SVG}svg"
        assert element.get("aria-label")
        assert "themed" in (element.get("class") or "")
        assert "nan" not in after.lower()
        assert len(list(larger.iter(f"{SVG}circle"))) > len(list(element.iter(f"{SVG}circle")))
        assert "the extended model" in after


def test_a_check_that_fails_has_a_figure_of_the_residuals_it_is_about() -> None:
    _, fit = fitted(seed=1)
    plain = residual_figures(fit, None)
    failing = [DISTANCE, MEMORY, "push in one direction"]
    figures = residual_figures(fit, fit, failing=failing)
    assert figures.keys() - plain.keys() == {title_of(DISTANCE), title_of(MEMORY)}
    element = ElementTree.fromstring(figures[title_of(DISTANCE)])
    assert len(list(element.iter(f"{SVG}polygon"))) == 2
    assert len(list(element.iter(f"{SVG}circle"))) >= 8
    words = {text.text for text in element.iter(f"{SVG}text")}
    assert {"time since a contact (s)", "away from the partner, noise sd", "the extended model"} <= words


def test_a_point_stands_where_its_axes_say_and_labels_are_escaped() -> None:
    plot = Plot(Axis(0, 10, False, (0, 5, 10)), Axis(-1, 1, False, (0,)), "x < 3", "y & z", width=170, height=166)
    plot.point(5, 0, 0.5, "red")
    element = ElementTree.fromstring(side_by_side([plot], 'a "plot"'))
    (circle,) = element.iter(f"{SVG}circle")
    assert (float(circle.get("cx", 0)), float(circle.get("cy", 0))) == (108.0, 76.0)
    words = [text.text for text in element.iter(f"{SVG}text")]
    assert {"x < 3", "y & z", "0", "5", "10"} <= set(words)
    assert element.get("aria-label") == 'a "plot"'


def test_an_arrow_too_short_to_see_is_a_dot() -> None:
    axis = Axis(0, 1, False, ())
    plot = Plot(axis, axis, "", "")
    plot.arrow((0.5, 0.5), (0.5, 0.5001), "red")
    assert "<circle" in plot.element
    plot = Plot(axis, axis, "", "")
    plot.arrow((0.2, 0.5), (0.8, 0.5), "red")
    assert "<circle" not in plot.element


def test_the_nearest_body_is_one_that_is_there() -> None:
    """One that nobody has seen yet, or nobody sees any more, is at no distance."""
    places = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 3.0]]] * 4)
    seen = places.copy()
    seen[2:, 1] = np.nan
    bodies = tuple(Body(name, Shape.CYLINDER, radius=0.1) for name in "abc")
    motion = create_autospec(FittedMotion, instance=True, position=places)
    motion.tracks = Tracks.from_arrays("two", bodies, 0.1 * np.arange(4), seen)
    np.testing.assert_allclose(flight_figures._distance(motion)[:, 0], [1.0, 1.0, 3.0, 3.0])
