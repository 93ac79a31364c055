"""A search in many videos goes on from what some of them have told."""

from collections.abc import Sequence
from dataclasses import replace
from unittest.mock import Mock, create_autospec

import numpy as np
import pytest

from tests.discovery.fitted import fitted
from tests.discovery.stand_ins import refit_with, refits_with, start_with, without_tracks
from vrdp_prob.discovery import stages
from vrdp_prob.discovery.candidates.scores import CauseScore
from vrdp_prob.discovery.selection import beginning as beginning_module
from vrdp_prob.discovery.selection.beginning import Beginning
from vrdp_prob.discovery.selection.comparison import Comparison
from vrdp_prob.discovery.selection.courses import Courses
from vrdp_prob.discovery.selection.extensions import Extensions
from vrdp_prob.discovery.selection.forward import ForwardSelection, Step
from vrdp_prob.discovery.selection.leavings import Leavings, Left
from vrdp_prob.discovery.selection.search import Search
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference import default_model
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.wind import Wind
from vrdp_prob.models.parameters import Prior

TILTED = Beginning((SurfaceTilt(),), default_model(), {SurfaceTilt.name: (start_with(Wind()),)})


def _search(best: Trial, rivals: Sequence[Sequence[Trial]], monkeypatch: pytest.MonkeyPatch) -> Search:
    """A search with such a best model, of which gains are not divided; a cause needs 6 nats."""
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    lesser = tuple(refit_with("", 0.0) for _ in rivals)
    return Search(refit_with("", 0.0), best, lesser, tuple(map(tuple, rivals)), refits_with(needed=6.0))


def test_what_happens_once_is_nothing_to_go_on_from_and_rivals_are_those_that_come_near(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    best, near, far = refit_with("both", 50.0), refit_with("wind", 47.0), refit_with("drag", 45.0)
    best.causes, near.causes, far.causes = (SurfaceTilt(), ExternalImpulse()), (Wind(),), (LinearDrag(),)
    model = default_model().with_effect(SurfaceTilt())
    monkeypatch.setattr(stages, "extended_model", lambda _trial, _overdispersion: model)
    told = stages._beginning(_search(best, [[near, far], []], monkeypatch))
    assert told is not None
    assert told.causes == best.causes[:1]
    assert told.believed is model
    assert [one.effect for one in told.rivals[SurfaceTilt.name]] == [Wind()]
    best.causes = best.causes[1:]
    assert stages._beginning(_search(best, [[near]], monkeypatch)) is None


@pytest.mark.parametrize(
    ("gained", "explains", "taken"),
    [(30.0, True, "searched anew"), (30.0, False, "as it is"), (1.0, True, None), (None, True, None)],
    ids=["a lost video", "many lost videos", "it brings too little", "no world"],
)
def test_the_causes_are_fitted_to_all_from_the_beginning(
    gained: float | None, taken: str | None, *, explains: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    base, found, better = refit_with("", 0.0), refit_with("tilt", gained or 0.0), refit_with("tilt", 40.0)
    asked: list[object] = []

    def begun(_self: Extensions, *given: object) -> Trial | None:
        asked.extend(given)
        return None if gained is None else found

    monkeypatch.setattr(Extensions, "from_the_beginning", begun)
    monkeypatch.setattr(beginning_module, "explained", lambda _fits: explains)
    monkeypatch.setattr(beginning_module, "lost_videos", lambda _fits: [1])
    monkeypatch.setattr(
        Courses, "searched_anew", lambda _self, one, lost: better if (one, lost) == (found, [1]) else one
    )
    assert (
        TILTED.fitted(base, refits_with(needed=6.0)) is {"searched anew": better, "as it is": found, None: None}[taken]
    )
    assert asked == [base, TILTED.causes, TILTED.believed]


@pytest.mark.parametrize("brings", [True, False])
def test_the_search_goes_on_from_the_model_with_them(*, brings: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    plain, tilt = refit_with("", 0.0), refit_with("tilt", 50.0)
    begun = create_autospec(Beginning, instance=True)
    begun.fitted.return_value = tilt if brings else None
    asked: list[Trial] = []
    without_tracks(monkeypatch)
    monkeypatch.setattr(Leavings, "of", lambda _self, _trial: Left((), (), np.ones(3)))
    monkeypatch.setattr(ForwardSelection, "tried", lambda self, one: asked.append(one) or self.untried(one))
    chain, steps, _ = ForwardSelection(refits_with(needed=6.0), begun).models(plain)
    assert chain == ([plain, tilt] if brings else [plain])
    assert asked == chain[-1:]
    assert [step.base for step in steps] == chain


@pytest.mark.parametrize("kicked", [False, True], ids=["nothing was tried since", "kicks were tried since"])
def test_causes_that_come_near_in_some_videos_are_compared_in_all(
    *, kicked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain, tilt, wind = (refit_with(*one) for one in (("", 0.0), ("tilt", 50.0), ("wind", 49.0)))
    tilt.causes, wind.causes, tilt.names = (SurfaceTilt(),), (Wind(),), (SurfaceTilt.name,)
    scores = tuple(Mock(spec=CauseScore, effect=effect, size=30.0) for effect in (LinearDrag(), Wind()))
    monkeypatch.setattr(Leavings, "of", lambda _self, one: Left(scores if one is plain else (), (), np.ones(3)))
    monkeypatch.setattr(
        Extensions, "made_of", lambda _self, one, some: [wind] if (one, some) == (plain, [scores[1]]) else []
    )
    kicks = refit_with("tilt+kicks", 55.0)
    kicks.beyond.return_value = kicks.causes = (ExternalImpulse(),)
    steps = [
        Step(one, Left((), (), np.ones(3)), tried) for one, tried in ((plain, ()), (tilt, (kicks,) if kicked else ()))
    ]
    assert Comparison(refits_with(), TILTED)._rivals(tilt, (plain,), steps) == ((wind,),)


@pytest.mark.slow
def test_what_is_believed_is_where_a_fit_begins_and_no_part_of_it() -> None:
    _, fit = fitted("surface_tilt", seed=1)
    base, extensions = Trial((), fit), refits_with().extensions
    plain = extensions.from_the_beginning(base, [SurfaceTilt()])
    assert plain is not None
    model, slope = plain.fit.model, plain.fit.value("tilt_x")
    assert slope is not None
    believed = replace(SurfaceTilt.parameters[0], prior=Prior(1.2 * slope, 0.005 * abs(slope)), default=1.2 * slope)
    assert believed.name == "tilt_x"
    sure = replace(model, beliefs={**model.beliefs, "tilt_x": believed})
    told = extensions.from_the_beginning(base, [SurfaceTilt()], sure)
    assert told is not None
    assert told.fit.model.beliefs.keys() == model.beliefs.keys()
    assert told.fit.value("tilt_x") == pytest.approx(slope, rel=0.01)
    width, other = (
        one.fit.joint.gaussian.sd[one.fit.joint.numbers.keys.index(("tilt_x", ()))] for one in (told, plain)
    )
    assert width == pytest.approx(other, rel=0.05)
