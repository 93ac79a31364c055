"""All videos are searched anew before something is called unknown."""

from unittest.mock import Mock, create_autospec

import pytest

from vrdp_prob.discovery import discover as module
from vrdp_prob.inference.several_videos.fitting import SharedFit


def _fit(log_density: float) -> SharedFit:
    fit = create_autospec(SharedFit, instance=True)
    fit.joint, fit.fits = Mock(log_density=log_density), ["one course only", "", "", ""]
    return fit


@pytest.mark.parametrize(
    ("gained", "explains", "is_taken"),
    [(20.0, True, True), (1.0, True, False), (20.0, False, False)],
    ids=["a better course", "nothing much better", "a model that explains few videos"],
)
def test_other_courses_are_looked_for_in_halves_of_the_videos(
    gained: float, *, explains: bool, is_taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, half, both = _fit(100.0), _fit(100.0), _fit(100.0 + gained)
    first.mended.return_value, half.mended.return_value = half, both
    monkeypatch.setattr(module, "explained", lambda _fits: explains)
    monkeypatch.setattr(module, "may_take_another_course", lambda fit: fit != "one course only")
    assert module._with_other_courses(first, seed=3) is (both if is_taken else first)
    if explains:
        first.mended.assert_called_once_with([2], seed=3, thorough=True)
        half.mended.assert_called_once_with([1, 3], seed=3, thorough=True)
