"""A search for causes that is broken off goes on where it was, and says what it would have said."""

import json
import pickle
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import ClassVar

import pytest

from tests.discovery.hidden import hide
from tests.discovery.scenes import Setting
from vrdp_prob import load_all
from vrdp_prob.discovery.discover import discover
from vrdp_prob.discovery.finding import Finding
from vrdp_prob.discovery.page.document import to_document
from vrdp_prob.discovery.selection.extensions import Extensions
from vrdp_prob.discovery.selection.leavings import Leavings
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.errors import InputError
from vrdp_prob.inference.runs.journal import Step
from vrdp_prob.models.effects.wind import Wind
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.scene import Tracks

CATALOGUE = ("surface_tilt", "irregular_frames")
SETTING = Setting(videos=3, bodies=2, frames=40)


class Broken(BaseException):
    """As a kill, or Control and C."""


@dataclass
class Work:
    """Steps that were made and not read, and how many may be."""

    made: int = 0
    most: int | None = None


@pytest.fixture(scope="module")
def videos(tmp_path_factory: pytest.TempPathFactory) -> list[Tracks]:
    folder = tmp_path_factory.mktemp("tilted")
    hide(["surface_tilt"], seed=1, effect_size=5.0, setting=SETTING).write(folder)
    return load_all(folder)


def found(videos: list[Tracks], checkpoint: Path | None = None) -> Finding:
    known = known_effects()
    looked_for = [known[name]() for name in CATALOGUE]
    return discover(videos, catalogue=looked_for, processes=1, checkpoint=checkpoint)


def told(finding: Finding) -> str:
    return json.dumps(to_document(finding), sort_keys=True)


@pytest.fixture
def work(monkeypatch: pytest.MonkeyPatch) -> Work:
    counted, plain = Work(), Step.make

    def make(step: Step) -> object:
        if counted.made == counted.most:
            raise Broken
        counted.made += 1
        return plain(step)

    monkeypatch.setattr(Step, "make", make)
    return counted


def steps(folder: Path) -> list[Path]:
    return sorted(folder.glob("step_*.pickle"))


def test_a_search_that_was_broken_off_says_the_same(videos: list[Tracks], work: Work, tmp_path: Path) -> None:
    whole = found(videos)
    assert whole.causes[0].name == "surface_tilt"
    assert work.made == 0
    work.most = 12
    with pytest.raises(Broken):
        found(videos, tmp_path)
    kept = steps(tmp_path)
    assert len(kept) == work.made == 12
    kept[-1].write_bytes(kept[-1].read_bytes()[:100])  # as if it had been killed while it wrote
    work.most = None
    assert told(found(videos, tmp_path)) == told(whole)
    every = len(steps(tmp_path))
    assert every > 16
    # The damaged one was made twice, and what was given numbers that differ in the last digit, as linear algebra may.
    assert every < work.made <= every + 4
    work.most = work.made + 3
    assert told(found(videos, tmp_path)) == told(whole)


def test_a_checkpoint_of_another_search_is_refused(videos: list[Tracks], work: Work, tmp_path: Path) -> None:
    work.most = 0
    (tmp_path / "fingerprint.json").write_text('{"version": "1", "seed": "0"}')
    with pytest.raises(InputError, match="belongs to another run"):
        found(videos, tmp_path)
    (tmp_path / "fingerprint.json").unlink()
    (tmp_path / "step_00001.pickle").write_bytes(b"whose?")
    with pytest.raises(InputError, match="does not say what run it belongs to"):
        found(videos, tmp_path)


def test_a_checkpoint_keeps_no_effect_that_is_defined_in_a_function(videos: list[Tracks], tmp_path: Path) -> None:
    class Breeze(Wind):
        name: ClassVar = "breeze"

    with pytest.raises(InputError, match="the effect Breeze is defined in a notebook, a script or a function"):
        discover(videos, catalogue=[Breeze()], checkpoint=tmp_path / "steps")
    assert not (tmp_path / "steps").exists()


def test_refits_that_are_followed_can_be_kept_whatever_shows_the_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    lock = Lock()  # as a bar on a terminal holds one
    extensions = Extensions(Leavings((), 0), 6.0, lambda _: lock.release())
    kept: list[bytes] = []

    def in_processes(task: Callable[[Trial], Trial], items: Sequence[Trial], **_: object) -> list[Trial]:
        kept.append(pickle.dumps(task))
        return list(items)

    monkeypatch.setattr("vrdp_prob.discovery.selection.extensions.in_processes", in_processes)
    nothing_fitted = Trial.__new__(Trial)
    assert extensions.made_of(nothing_fitted, []) == []
    assert len(kept) == len(("refitted", "followed to the end"))
