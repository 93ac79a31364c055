"""Every check that fails has a figure, which shows what is wrong and what noise alone leaves."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from xml.etree import ElementTree

import numpy as np
import pytest
from jaxtyping import Float

from tests.discovery.fitted import SMALL, fitted, moved
from tests.discovery.measurement import Measurement
from tests.discovery.scenes import Setting
from tests.discovery.test_checks_fire import Changes, bent, grossly_wrong, irregular, kicked, larger, lost, null
from tests.discovery.test_wall_contacts import with_effect
from vrdp_prob.discovery.checks.battery import run_checks
from vrdp_prob.discovery.checks.bodies import friction_against
from vrdp_prob.discovery.checks.clock import LOST_FRAMES, SINGLE_FRAMES
from vrdp_prob.discovery.checks.contacts import (
    DISTANCE,
    DURATION,
    MOMENTUM,
    REBOUND_AT_WALLS,
    RUBBING_AT_WALLS,
    TURNING,
)
from vrdp_prob.discovery.checks.flight import QUESTIONS, SHAKING
from vrdp_prob.discovery.checks.kicks import KICK, kick_places
from vrdp_prob.discovery.checks.measurement import DISTORTION, MEMORY, OUTLIERS, SIZE
from vrdp_prob.discovery.page.figures import SHOWN_BY, WHERE_CHECKS_FAIL, residual_figures, title_of
from vrdp_prob.discovery.page.plots import AFTER, BEFORE
from vrdp_prob.discovery.page.scatter import Banded, Points, with_bands, with_bars
from vrdp_prob.discovery.page.seen import Seen
from vrdp_prob.discovery.residuals.contact_patterns import AT_WALLS
from vrdp_prob.discovery.residuals.fitted_motion import FittedMotion, Kicks
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.scene import Shape

SVG = "{http://www.w3.org/2000/svg}"
TURNING_BODIES = Measurement(angles=True)
BETWEEN_WALLS = replace(SMALL, arena=2.2)


@dataclass(frozen=True)
class Drawn:
    """What one plot shows, in units of its axes: dots, and the band of what noise leaves at each of them."""

    dots: Float[np.ndarray, "dot 2"]
    low: Float[np.ndarray, "dot"]
    high: Float[np.ndarray, "dot"]
    words: frozenset[str]

    @property
    def excess(self) -> Float[np.ndarray, "dot"]:
        """Heights of the dots in units of the upper end of the band."""
        return self.dots[:, 1] / self.high

    @property
    def outside(self) -> Float[np.ndarray, "dot 2"]:
        """Dots that noise alone does not explain."""
        return self.dots[(self.dots[:, 1] < self.low) | (self.dots[:, 1] > self.high)]


def drawn(figure: str) -> list[Drawn]:
    """The plots of a figure whose axes are linear."""
    plots = []
    for group in ElementTree.fromstring(figure).iter(f"{SVG}g"):
        words = [(text, text.text or "") for text in group.iter(f"{SVG}text")]
        ticks: dict[str, list[tuple[float, float]]] = {"middle": [], "end": []}
        for text, word in words:
            try:
                value = float(word)
            except ValueError:
                continue
            anchor = text.get("text-anchor", "")
            ticks[anchor].append((float(text.get("x" if anchor == "middle" else "y", 0)), value))
        across = np.polyfit(*np.array(ticks["middle"]).T, 1) if len(ticks["middle"]) > 1 else np.array([1.0, 0.0])
        up = np.polyfit(*(np.array(ticks["end"]) - (4, 0)).T, 1)
        circles = list(group.iter(f"{SVG}circle"))
        places, heights = (np.array([float(circle.get(name, 0)) for circle in circles]) for name in ("cx", "cy"))
        dots = np.stack([np.polyval(across, places), np.polyval(up, heights)], axis=1)
        low, high = np.full(len(dots), -np.inf), np.full(len(dots), np.inf)
        for band in group.iter(f"{SVG}polygon"):
            corners = np.array([[float(v) for v in pair.split(",")] for pair in (band.get("points") or "").split()])
            half = len(corners) // 2
            below, above = corners[:half], corners[half:][::-1]
            low, high = (np.polyval(up, np.interp(places, one[:, 0], one[:, 1])) for one in (below, above))
        plots.append(Drawn(dots, low, high, frozenset(word for _, word in words)))
    return plots


def shown(check: str, model: ResidualModel) -> list[Drawn]:
    """The figure of a check, made of residuals alone."""
    seen = Seen(fitted(seed=1)[1], BEFORE, "a model")
    vars(seen)["model"] = model
    return drawn(WHERE_CHECKS_FAIL[check]([seen]))


def pushed(acceleration: Mapping[str, float]) -> ResidualModel:
    """What a null leaves where bodies are pushed by accelerations of some sizes."""
    _, model = null()
    changes = []
    for video in model.videos:
        motion = video.motion
        field = sum(size * _pushes(motion)[name] for name, size in acceleration.items())
        changes.append(motion.pushed(np.asarray(field)[..., None])[:, :, :2, 0])
    return moved(model, changes)


def _pushes(motion: FittedMotion) -> dict[str, Float[np.ndarray, "time body 2"]]:
    spheres = np.array([body.shape is Shape.SPHERE for body in motion.tracks.bodies], dtype=float)
    wave = np.cos(2 * np.pi * 1.4 * (motion.times - motion.times[0]))
    towards = np.array([1.0, 0.0])
    return {
        "spheres left": spheres[:, None] * motion.sideways,
        "along x": motion.position[..., :1] * motion.direction,
        "shaking": np.broadcast_to(wave[:, None, None] * towards, motion.velocity.shape),
        "speed": motion.speed[..., None] * towards,
    }


@pytest.mark.parametrize(
    ("setting", "measurement"), [(SMALL, None), (BETWEEN_WALLS, TURNING_BODIES)], ids=["plain", "walls and spins"]
)
def test_every_check_that_is_made_has_a_figure(setting: Setting, measurement: Measurement | None) -> None:
    _, fit = fitted(seed=1, setting=setting, measurement=measurement)
    checks = {check.name for check in run_checks(fit, seed=0)}
    assert checks <= SHOWN_BY.keys() | WHERE_CHECKS_FAIL.keys()
    for after in (None, fit):
        figures = residual_figures(fit, after, failing=checks)
        assert {title_of(name) for name in checks} <= figures.keys()
        assert all("nan" not in figure.lower() for figure in figures.values())


def test_every_check_that_there_is_has_a_figure_and_none_is_of_a_check_that_there_is_not() -> None:
    named = {question.name for question in QUESTIONS} | {
        SHAKING,
        DISTANCE,
        KICK,
        LOST_FRAMES,
        SINGLE_FRAMES,
        DISTORTION,
        OUTLIERS,
    }
    named |= {RUBBING_AT_WALLS, REBOUND_AT_WALLS, MOMENTUM, MEMORY, SIZE, *TURNING.values(), *DURATION.values()}
    named |= {friction_against(what) for what in ("material", "shape", "mass")}
    assert named - SHOWN_BY.keys() == WHERE_CHECKS_FAIL.keys()
    assert not SHOWN_BY.keys() & WHERE_CHECKS_FAIL.keys()


@pytest.mark.parametrize(
    ("check", "change"),
    [(DISTANCE, larger), (KICK, kicked), (LOST_FRAMES, lost), (SINGLE_FRAMES, irregular), (DISTORTION, bent)],
)
def test_what_is_wrong_stands_out_of_the_band_of_noise(check: str, change: Changes) -> None:
    videos, model = null()
    (quiet,), (wrong,) = (shown(check, one) for one in (model, moved(model, [change(video) for video in videos])))
    assert len(wrong.outside) / len(wrong.dots) > 2 * len(quiet.outside) / len(quiet.dots)
    assert np.abs(wrong.excess).max() > 2 * np.abs(quiet.excess).max()
    if check == LOST_FRAMES:
        time, size = wrong.dots[np.abs(wrong.excess).argmax()]
        assert time == pytest.approx(0.8, abs=0.1)
        assert abs(size) == pytest.approx(0.02, rel=0.2)


def test_a_kick_stands_out_at_its_time_of_the_body_that_it_hit() -> None:
    _, model = null()
    places = next(iter(kick_places(FreeFlight.of(model).beside)))
    video = model.videos[places.video]
    sharpest = int(np.linalg.eigvalsh(places.information)[:, 0].argmax())
    body, time = int(places.bodies[sharpest]), float(video.motion.times[places.frames[sharpest]])
    change = video.motion.kicked(Kicks.single(np.array([time]), np.array([body])))[..., :2, 0]
    still = [np.zeros((*one.motion.speed.shape, 2)) for one in model.videos]
    still[places.video] = 0.3 * change
    (wrong,) = shown(KICK, moved(model, still))
    assert f"time (s), object {video.motion.tracks.bodies[body].id} of {video.linear.name}" in wrong.words
    at, size = wrong.dots[np.abs(wrong.excess).argmax()]
    assert at == pytest.approx(time, abs=0.1)
    assert abs(size) == pytest.approx(0.3, rel=0.2)


def test_positions_that_are_grossly_off_leave_the_line_of_the_noise() -> None:
    _, model = null()
    (quiet,) = shown(OUTLIERS, model)
    assert len(quiet.outside) <= 0.2 * len(quiet.dots)
    seen = Seen(fitted(seed=1)[1], BEFORE, "a model")
    vars(seen)["model"] = grossly_wrong(model, 0.05)
    element = ElementTree.fromstring(WHERE_CHECKS_FAIL[OUTLIERS]([seen]))
    heights = [float(circle.get("cy", 0)) for circle in element.iter(f"{SVG}circle")]
    band = [
        float(pair.split(",")[1]) for one in element.iter(f"{SVG}polygon") for pair in (one.get("points") or "").split()
    ]
    assert min(heights) < min(band) - 20


def test_residuals_with_a_memory_are_alike_for_some_frames_and_differ_less_than_the_noise() -> None:
    _, model = null()
    changes = []
    for video in model.videos:
        motion = video.motion
        wave = np.sin(2 * np.pi * 1.3 * motion.times)[:, None, None] * np.ones((1, len(motion.tracks.bodies), 2))
        changes.append(3 * video.noise_sd * wave)
    wrong = moved(model, changes)
    (correlation,), (quiet,) = shown(MEMORY, wrong), shown(MEMORY, model)
    assert correlation.dots[0, 1] > 0.6
    assert len(quiet.outside) <= 4
    (differences,) = shown(SIZE, wrong)
    assert differences.dots[8, 1] > 2 * differences.dots[0, 1]


def test_accelerations_are_told_by_what_they_depend_on() -> None:
    (by_shape,) = shown("acceleration across the velocity against shape", pushed({"spheres left": 0.2}))
    order = {"cube", "cylinder", "sphere"}
    assert order <= by_shape.words
    cubes, cylinders, spheres = by_shape.dots[:, 1]
    assert spheres - (cubes + cylinders) / 2 == pytest.approx(0.2, rel=0.3)
    x, _ = shown("acceleration along the velocity against place", pushed({"along x": 0.3}))
    assert np.polyfit(*x.dots.T, 1)[0] == pytest.approx(0.3, rel=0.4)
    along, _ = shown("push against speed", pushed({"speed": 0.1}))
    assert np.polyfit(*along.dots.T, 1)[0] == pytest.approx(0.1, rel=0.4)
    (spectrum,) = shown(SHAKING, pushed({"shaking": 0.3}))
    assert "frequency (Hz)" in spectrum.words
    assert spectrum.dots[spectrum.excess.argmax(), 0] == pytest.approx(1.4, abs=0.2)
    assert spectrum.excess.max() > 3


def test_contacts_with_walls_show_how_they_rebound_rub_and_turn() -> None:
    (rebounds,) = shown(REBOUND_AT_WALLS, with_effect(restitution_power=0.4))
    speed, ratio = rebounds.dots.T
    assert len(speed) >= 5
    assert np.polyfit(np.log(speed), ratio, 1)[0] == pytest.approx(-0.4, abs=0.15)
    assert ratio.mean() == pytest.approx(1.0, abs=0.1)
    rubbed = with_effect(contact_friction=0.02)
    (impulses,) = shown(RUBBING_AT_WALLS, rubbed)
    np.testing.assert_allclose(np.abs(impulses.dots[:, 1] / impulses.dots[:, 0]), 0.02, rtol=0.5)
    (spins,) = shown(TURNING[AT_WALLS], rubbed)
    slip, share = spins.dots.T
    against = -np.sign(slip) * share
    assert (against > 0).sum() >= 5
    assert np.median(against) == pytest.approx(0.02, rel=0.2)


def test_numbers_of_which_nothing_is_known_are_not_drawn_and_one_alone_is() -> None:
    _, fit = fitted(seed=1)
    both = [Seen(fit, BEFORE, "a model"), Seen(fit, AFTER, "another")]
    none, known = Points(*np.zeros((3, 0))), Points(*np.ones((3, 1)))
    unknown = Points(*np.array([[1.0, 1.0, np.nan], [1.0, 1.0, 1.0], [0.0, np.inf, 1.0]]))
    assert with_bars(both, {"": [none, unknown]}, ("a", "b"), "") == ""
    (one,) = drawn(with_bars(both, {"": [unknown, known]}, ("a", "b"), ""))
    assert len(one.dots) == 1
    assert with_bands(both, [None, Banded(*np.zeros((4, 0)))], ("a", "b"), "") == ""
    assert len(drawn(with_bands(both, [None, Banded(*np.ones((4, 1)))], ("a", "b"), ""))) == 1
