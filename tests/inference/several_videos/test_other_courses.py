"""Videos of a joint fit are searched anew."""

from unittest.mock import Mock, create_autospec

import pytest

from tests.inference.several_videos.videos import sliding
from vrdp_prob.inference.several_videos import fitting, second_look
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.models.parameters import SLIDING_FRICTION
from vrdp_prob.models.physics import PhysicsModel


def _fit(log_density: float) -> SharedFit:
    fit = create_autospec(SharedFit, instance=True)
    fit.joint, fit.fits = Mock(log_density=log_density), ["one course only", "", "", ""]
    return fit


@pytest.mark.parametrize(("gained", "is_taken"), [(20.0, True), (1.0, False)], ids=["better", "hardly better"])
def test_other_courses_are_looked_for_in_halves_of_the_videos(
    gained: float, *, is_taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, half, both = _fit(100.0), _fit(100.0), _fit(100.0 + gained)
    first.mended.return_value, half.mended.return_value = half, both
    monkeypatch.setattr(fitting, "may_take_another_course", lambda fit: fit != "one course only")
    assert SharedFit.with_other_courses(first, seed=3) is (both if is_taken else first)
    first.mended.assert_called_once_with([2], seed=3, thorough=True)
    half.mended.assert_called_once_with([1, 3], seed=3, thorough=True)


def test_where_nobody_is_trusted_nothing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    fit = fit_together([sliding(1), sliding(2), sliding(3)], model=PhysicsModel.base(), model_error=False)

    def told() -> PhysicsModel:
        return second_look._told(fit.fits, fit.model, None, [1], islands=False)

    assert told().beliefs["sliding_friction"].prior.sd < 0.5 * SLIDING_FRICTION.prior.sd
    monkeypatch.setattr(second_look, "trusted", lambda fits: [index != 1 for index in range(len(fits))])
    assert told() is fit.model
