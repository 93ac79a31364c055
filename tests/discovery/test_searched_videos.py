"""Causes that are looked for in some of many videos are asked of all, and all that is told comes from all."""

from pathlib import Path

import pytest

from tests.discovery.hidden import hide
from tests.discovery.scenes import Setting
from vrdp_prob import load_all
from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.finding import Finding, Verdict
from vrdp_prob.errors import InputError
from vrdp_prob.models.model_file import known_effects

PAIRS = Setting(videos=6, bodies=2, frames=60)
FEW = ("surface_tilt", "magnus_curl", "external_impulse")


def found_in(folder: Path, ways: list[str], *, seed: int, searched: int | None) -> Finding:
    """What is said of six videos, of which some are searched."""
    hide(ways, seed=seed, effect_size=5.0, setting=PAIRS).write(folder)
    known = known_effects()
    return discover(load_all(folder), catalogue=[known[name]() for name in FEW], searched=searched, processes=1)


def test_what_is_found_in_some_videos_is_told_of_all(tmp_path: Path) -> None:
    few, all_six = (found_in(tmp_path / f"{count}", ["surface_tilt"], seed=2, searched=count) for count in (3, 6))
    assert few.verdict is all_six.verdict is Verdict.NAMED
    (cause,), (same,) = few.named, all_six.named
    assert cause.name == same.name == "surface_tilt"
    assert set(cause.gain.by_video) == set(few.videos) == set(all_six.videos)
    assert cause.gain.elpd_difference == pytest.approx(same.gain.elpd_difference, rel=0.02)
    for name, one in cause.parameters.items():
        assert one.mean == pytest.approx(same.parameters[name].mean, rel=0.02)
    assert {one.name for one in few.upper_bounds} == {one.name for one in all_six.upper_bounds}
    assert "Causes were looked for in 3 of the 6 videos; only 'surface tilt' was asked of all." in few.notes
    assert not any("looked for in" in note for note in all_six.notes)


@pytest.mark.slow
def test_what_shows_in_other_videos_alone_is_no_cause_but_told_of(tmp_path: Path) -> None:
    found = found_in(tmp_path, ["external_impulse"], seed=4, searched=3)
    assert found.verdict is Verdict.UNKNOWN
    assert not found.causes
    asked = "Causes were looked for in 3 of the 6 videos; none of them shows there, so that none was asked of all."
    assert asked in found.notes
    (left,) = (note for note in found.notes if note.startswith("What is left in all videos may be "))
    assert "'external impulse'" in left
    assert left.endswith(", for which the searched ones did not call: look for causes in more videos.")


@pytest.mark.parametrize("searched", [0, 2, -3, True])
def test_too_few_videos_to_search_are_refused(searched: int, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"searched is {searched!r}; give a whole number of at least 3"):
        found_in(tmp_path, [], seed=1, searched=searched)


@pytest.mark.parametrize(("change", "least"), [({"seed": -1}, 0), ({"processes": 0}, 1)])
def test_numbers_that_are_none_are_refused_before_any_work(change: dict[str, int], least: int, tmp_path: Path) -> None:
    (name, value), kept = next(iter(change.items())), tmp_path / "kept"
    videos = hide([], seed=1, setting=PAIRS).tracks
    with pytest.raises(InputError, match=rf"{name} is {value!r}; give a whole number of at least {least}"):
        discover(videos, checkpoint=kept, **change)
    assert not kept.exists()
