from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.inference.several_videos.videos import sliding
from vrdp_prob.errors import InputError
from vrdp_prob.inference.several_videos import gibbs, infer_together
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.progress import Advance

BASE = PhysicsModel.base()


class BrokenOffError(Exception):
    """A run was broken off."""


class BreaksOff:
    """Progress of a run that is broken off after so many sweeps."""

    def __init__(self, sweeps: float) -> None:
        self._left = sweeps

    @contextmanager
    def stage(self, description: str, total: float | None = None) -> Iterator[Advance]:
        def advance(steps: float) -> None:
            self._left -= steps if description.startswith("Sampling") else 0
            if self._left < 0:
                raise BrokenOffError

        del total
        yield advance


@pytest.mark.slow
def test_a_run_that_is_broken_off_ends_with_the_same_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gibbs, "CHAINS_PER_GROUP", 4)
    monkeypatch.setattr(gibbs, "SWEEPS_PER_ROUND", 4)
    videos, folder = [sliding(1), sliding(2)], tmp_path / "kept"
    whole = infer_together(videos, model=BASE)
    with pytest.raises(BrokenOffError):
        infer_together(videos, model=BASE, checkpoint=folder, progress=BreaksOff(gibbs.WARM_UP + 5))
    done = (folder / "chains.pickle").stat().st_mtime_ns
    with pytest.raises(InputError, match=r"belongs to another run \(other seed\)"):
        infer_together(videos, model=BASE, seed=1, checkpoint=folder)
    again = infer_together(videos, model=BASE, checkpoint=folder)
    assert (again.points == whole.points).all()
    assert (folder / "chains.pickle").stat().st_mtime_ns > done
    with pytest.raises(InputError, match="belongs to another run"):
        infer_together(videos[::-1], model=BASE, checkpoint=folder)
    (folder / "chains.pickle").write_bytes((folder / "chains.pickle").read_bytes()[:100])
    assert (infer_together(videos, model=BASE, checkpoint=folder).points == whole.points).all()
