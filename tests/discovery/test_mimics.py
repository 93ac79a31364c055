"""Causes that only follow what something outside the catalogue does are told from those that act."""

import numpy as np
import pytest

from tests.discovery.fitted import SMALL, fitted
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.candidates.scores import score_causes
from vrdp_prob.discovery.candidates.unlisted_law import UnlistedMotion, UnlistedRebound
from vrdp_prob.discovery.checks.bodies import REBOUND
from vrdp_prob.discovery.checks.contacts import REBOUND_AT_WALLS
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.selection import mimics
from vrdp_prob.discovery.selection.mimics import laws_of, without_mimics
from vrdp_prob.discovery.selection.refits import Refits
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference import default_model
from vrdp_prob.models.effects.effect import BodyView, Effect
from vrdp_prob.models.effects.friction_patch import FrictionPatch
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.parameters import VIDEO_START

LONGER = Setting(videos=6, bodies=2)
START = 7.0
"""Time stamp (s) of the first frame."""


def search_that_found(cause: Effect, way: str, effect_size: float, setting: Setting) -> Search:
    """What a search would be that has found a cause in videos where something else, or the same, is hidden."""
    _, fit = fitted(way, effect_size, seed=2, setting=setting)
    base = Trial((), fit)
    (score,) = score_causes(fit, base.unexplained.plain, [cause], seed=0)
    refitted = base.with_cause(score)
    assert refitted is not None
    refits = Refits((), seed=0, needed=6.0, advance=lambda _count: None)
    return Search(base, refitted.continued(), (base,), ((),), refits)


@pytest.mark.slow
def test_a_patch_that_follows_the_grain_of_a_table_is_not_named() -> None:
    before = search_that_found(FrictionPatch(), "grain", 8.0, LONGER)
    found, unlisted = without_mimics(before, [UnlistedMotion()], seed=0)
    assert unlisted is not None
    assert unlisted.mimics == ("friction_patch",)
    assert unlisted.gain > 50
    assert found.best is found.base
    assert found.lesser == found.rivals == ()


@pytest.mark.slow
def test_some_of_many_videos_are_asked_what_follows_the_grain_of_a_table(monkeypatch: pytest.MonkeyPatch) -> None:
    before = search_that_found(FrictionPatch(), "grain", 8.0, LONGER)
    monkeypatch.setattr(mimics, "MOST", 3)
    found, unlisted = without_mimics(before, [UnlistedMotion()], seed=0)
    assert unlisted is not None
    assert unlisted.mimics == ("friction_patch",)
    assert unlisted.asked == 3
    assert unlisted.gain > 50
    assert found.best is found.base


@pytest.mark.slow
def test_models_beside_which_laws_are_put_are_those_of_some_of_many_videos(monkeypatch: pytest.MonkeyPatch) -> None:
    found = search_that_found(SurfaceTilt(), "surface_tilt", 5.0, SMALL)
    everywhere = mimics._Models.of(found)
    assert everywhere.best is found.best
    assert everywhere.asked is None
    monkeypatch.setattr(mimics, "MOST", 2)
    some = mimics._Models.of(found)
    assert some.best.fit.videos == some.base.fit.videos == (found.base.fit.videos[0], found.base.fit.videos[2])
    assert some.lesser == (some.base,)
    assert some.asked == 2
    np.testing.assert_allclose(some.overdispersion, found.overdispersion[[0, 2]] * 2 / 3)
    monkeypatch.setattr(mimics, "happens_once", lambda _cause: True)
    assert mimics._Models.of(found).best is found.best, "what happens once may be in a video that is left out"


@pytest.mark.slow
def test_a_tilt_that_acts_stays_and_leaves_nothing_to_a_law_outside_the_catalogue() -> None:
    before = search_that_found(SurfaceTilt(), "surface_tilt", 5.0, SMALL)
    found, unlisted = without_mimics(before, [UnlistedMotion()], seed=0)
    assert found is before
    assert unlisted is None


def test_what_remains_decides_which_law_is_asked() -> None:
    motion = Check("push against place", 1.0, 1e-6, True, "")
    rebound = Check(REBOUND, 1.0, 1e-6, True, "")
    at_walls = Check(REBOUND_AT_WALLS, 1.0, 1e-6, True, "")
    memory = Check("memory of the residuals", 1.0, 1e-6, True, "")
    by_chance = Check("outliers", 1.0, 0.2, False, "")
    asked = {
        (motion, by_chance): (UnlistedMotion,),
        (rebound, by_chance): (UnlistedRebound,),
        (rebound, memory): (UnlistedRebound,),
        (at_walls, memory): (UnlistedRebound,),
        (memory,): (UnlistedMotion,),
        (rebound, motion): (UnlistedMotion, UnlistedRebound),
        (by_chance,): (),
    }
    assert {left: tuple(type(law) for law in laws_of(left)) for left in asked} == asked


@pytest.mark.parametrize(
    ("term", "closing_speed", "expected"),
    [
        ("restitution_of_slow", 1e-3, 0.5 * np.exp(-0.4)),
        ("restitution_of_slow", 0.6, 0.5 * np.exp(-0.4 * np.exp(-1))),
        ("restitution_of_slow", 2.0, 0.5),
        ("restitution_by_speed", 1.0, 0.5 * np.exp(0.4)),
        ("restitution_by_speed", 9.0, 1.0),
    ],
)
def test_restitution_depends_on_the_closing_speed(term: str, closing_speed: float, expected: float) -> None:
    parameters = absent(UnlistedRebound()) | {"slow_contact": 0.6, term: -0.4}
    found = UnlistedRebound().restitution(closing_speed, 0.5, body(), body(), parameters)
    assert found == pytest.approx(expected, abs=1e-4)


def absent(law: Effect) -> dict[str, float]:
    return {VIDEO_START: START} | {one.name: law.vanishes_at.get(one.name, one.default) for one in law.parameters}


def body(**values: float) -> BodyView:
    names = ("x", "y", "angle", "vx", "vy", "spin", "speed", "mass", "inverse_mass", "inverse_inertia")
    numbers = {**dict.fromkeys((*names, "restitution", "radius", "is_sphere"), 0.0), **values}
    return BodyView(**numbers)


def test_laws_vanish_without_their_terms_and_are_in_no_catalogue() -> None:
    moving = body(x=0.3, y=-0.7, vx=1.0, vy=2.0)
    motion, rebound = UnlistedMotion(), UnlistedRebound()
    assert motion.friction_factor(1.5, moving, absent(motion)) == 1.0
    assert motion.acceleration(1.5, moving, absent(motion)) == (0.0, 0.0)
    assert rebound.restitution(1.0, 0.5, moving, moving, absent(rebound)) == 0.5
    assert {motion.name, rebound.name}.isdisjoint(known_effects())
    default_model().with_effect(motion).with_effect(rebound)


@pytest.mark.parametrize(
    ("term", "where", "factor", "acceleration"),
    [
        ("friction_along_x", {"x": 0.5, "vx": 1.0}, 1.1, (0.0, 0.0)),
        ("friction_in_time", {"vx": 1.0}, 1.6, (0.0, 0.0)),
        ("grain_x", {"vx": 1.0}, 1.2, (0.0, 0.0)),
        ("grain_x", {"vy": 1.0}, 0.8, (0.0, 0.0)),
        ("grain_xy", {"vx": 1.0, "vy": 1.0}, 1.2, (0.0, 0.0)),
        ("friction_of_slow", {"vx": 1e-3}, 1.2, (0.0, 0.0)),
        ("friction_of_slow", {"vx": 3.0}, 1.0, (0.0, 0.0)),
        ("drag_first", {"vx": 2.0}, 1.0, (-0.4, 0.0)),
        ("drag_third", {"vx": 2.0}, 1.0, (-1.6, 0.0)),
        ("turn", {"vx": 2.0}, 1.0, (0.0, 0.4)),
        ("turn_along_y", {"vx": 2.0, "y": 0.5}, 1.0, (0.0, 0.2)),
        ("push_x", {}, 1.0, (0.2, 0.0)),
        ("push_y_by_x", {"x": 2.0}, 1.0, (0.0, 0.4)),
        ("push_x_by_time", {}, 1.0, (0.6, 0.0)),
    ],
)
def test_each_term_does_what_it_says(
    term: str, where: dict[str, float], factor: float, acceleration: tuple[float, float]
) -> None:
    parameters = absent(UnlistedMotion()) | {term: 0.2}
    assert UnlistedMotion().friction_factor(START + 3.0, body(**where), parameters) == pytest.approx(factor, abs=1e-4)
    assert UnlistedMotion().acceleration(START + 3.0, body(**where), parameters) == pytest.approx(acceleration)
