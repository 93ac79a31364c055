"""All videos of a joint fit are searched anew."""

from unittest.mock import Mock, create_autospec

import pytest

from vrdp_prob.inference.several_videos import fitting
from vrdp_prob.inference.several_videos.fitting import SharedFit


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
