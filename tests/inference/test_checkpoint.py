"""A run that is killed goes on where it was, and ends with the same numbers."""

import importlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.inference.densities import TwoModes
from vrdp_prob.errors import InputError
from vrdp_prob.inference.draws.samples import Samples
from vrdp_prob.inference.emcee_sampler import sample_emcee
from vrdp_prob.inference.infer import default_model, infer
from vrdp_prob.inference.nuts_sampler import sample_nuts
from vrdp_prob.inference.runs.checkpoint import Checkpoint, fingerprint, model_facts
from vrdp_prob.inference.search.plan import CURRICULUM
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Body, Shape, Tracks

FACTS = {"seed": "3"}
OWN_EFFECT = """from vrdp_prob.models.effects.linear_drag import LinearDrag


class Own(LinearDrag):
    law = "{}"
"""
ROOT = Path(__file__).parents[2]
PATIENCE = 120.0
"""Seconds."""
ENOUGH = {"emcee": "ensemble_3.h5", "nuts": "mode_0_group_1_piece_1.npz"}
"""File that is there when a run is about half way."""


def sampled(name: str, folder: Path | None) -> tuple[Samples, float]:
    """Draws of a sampler, and the next number of its generator."""
    checkpoint = None if folder is None else Checkpoint(folder, FACTS)
    target, generator = TwoModes(0.3, dimension=3), np.random.default_rng(3)
    if name == "emcee":
        samples = sample_emcee(
            target, target.start, draws=100, generator=generator, checkpoint=checkpoint, most_steps=48
        )
    else:
        options = {"processes": 1, "warm_up": 5, "most_gradients": 1}
        samples = sample_nuts(target, target.start, draws=100, generator=generator, checkpoint=checkpoint, **options)
    return samples, float(generator.random())


def test_a_folder_belongs_to_the_first_run_that_keeps_something_in_it(tmp_path: Path) -> None:
    first, other = (Checkpoint(tmp_path, {"seed": seed}) for seed in "34")
    first.keep("part", {"a": np.ones(2)})
    with pytest.raises(InputError, match="belongs to another run"):
        Checkpoint(tmp_path, {"seed": "4"})
    assert first.arrays("part", ("a",)) is not None
    assert first.arrays("part", ("a", "b")) is None
    for damaged in ("[]", "{"):
        (tmp_path / "fingerprint.json").write_text(damaged)
        assert other.arrays("part") is None  # nobody knows whose it is
        with pytest.raises(InputError, match="does not say what run it belongs to"):
            Checkpoint(tmp_path, {"seed": "4"})
    (tmp_path / "part.npz").unlink()
    Checkpoint(tmp_path, {"seed": "4"}).keep("part", {"a": np.zeros(2)})
    assert Checkpoint(tmp_path, {"seed": "4"}).arrays("part") is not None


def test_reading_does_not_claim_a_folder(tmp_path: Path) -> None:
    first = Checkpoint(tmp_path / "kept", {"seed": "3"})
    assert (first.text("result.json"), first.arrays("part")) == (None, None)
    assert not (tmp_path / "kept").exists()
    other = Checkpoint(tmp_path / "kept", {"seed": "4"})
    other.path("result.json").write_text("done")
    assert other.text("result.json") == "done"
    (tmp_path / "kept" / "result.json").write_bytes(b"\xff")
    assert other.text("result.json") is None
    with pytest.raises(InputError, match="belongs to another run"):
        Checkpoint(tmp_path / "kept", {"seed": "3"})


@pytest.mark.parametrize("name", ENOUGH)
def test_a_run_that_was_killed_ends_with_the_same_numbers(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "checkpoint"
    program = (
        "import sys; from pathlib import Path; from tests.inference.test_checkpoint import sampled; "
        "sampled(sys.argv[1], Path(sys.argv[2]))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program, name, str(folder)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    deadline = time.monotonic() + PATIENCE
    while not (folder / ENOUGH[name]).exists() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL, "it was done before it could be killed"
    # As if it had been killed while it wrote: what cannot be read is made anew.
    (folder / "form.npz").write_bytes((folder / "form.npz").read_bytes()[:100])
    broken = folder / ENOUGH[name]
    broken.write_bytes(broken.read_bytes()[:500])
    (samples, number), (whole, other) = sampled(name, folder), sampled(name, None)
    assert (samples.points == whole.points).all()
    assert (samples.log_density == whole.log_density).all()
    assert (samples.gradients, samples.evaluations, samples.modes) == (whole.gradients, whole.evaluations, whole.modes)
    assert number == other
    # And once more, with everything there.
    again, number = sampled(name, folder)
    assert (again.points == whole.points).all()
    assert number == other


def test_another_run_is_refused_by_name_of_what_differs(tmp_path: Path) -> None:
    Checkpoint(tmp_path, {"seed": "1", "draws": "400"}).keep("part", {"a": np.ones(2)})
    with pytest.raises(InputError, match=r"belongs to another run \(other draws, sampler\)"):
        Checkpoint(tmp_path, {"seed": "1", "draws": "500", "sampler": "nuts"})


def test_a_checkpoint_belongs_to_its_plan(tmp_path: Path) -> None:
    bodies, still = (Body("a", Shape.SPHERE, 0.2),), np.zeros((30, 1, 2))
    tracks = Tracks.from_arrays("still", bodies, np.arange(30.0), still)
    with pytest.raises(InputError, match="no object moves"):  # after the folder was claimed
        infer(tracks, checkpoint=tmp_path)
    with pytest.raises(InputError, match=r"belongs to another run \(other plan\)"):
        infer(tracks, checkpoint=tmp_path, plan=CURRICULUM)


def test_a_fingerprint_changes_with_one_measured_number() -> None:
    bodies = (Body("a", Shape.SPHERE, 0.2), Body("b", Shape.CUBE, 0.2))
    positions = np.random.default_rng(0).standard_normal((5, 2, 2))
    tracks, again = (Tracks.from_arrays("seen", bodies, np.arange(5.0), positions) for _ in range(2))
    positions = positions.copy()
    positions[3, 1, 0] += 1e-12
    other = Tracks.from_arrays("seen", bodies, np.arange(5.0), positions)
    facts = fingerprint(tracks, default_model(), seed=1)
    assert facts == fingerprint(again, default_model(), seed=1)
    changed = fingerprint(other, default_model(), seed=1)
    assert [name for name in facts if facts[name] != changed[name]] == ["tracks"]


def test_a_run_depends_on_the_code_of_effects_from_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = tmp_path / "own_effects_of_a_test.py"
    module.write_text(OWN_EFFECT.format("a = -b v"), encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    effect = importlib.import_module(module.stem).Own()
    before = model_facts(PhysicsModel("own", (effect,), {}))
    module.write_text(OWN_EFFECT.format("a = -2 b v"), encoding="utf-8")
    changed = {name for name, text in model_facts(PhysicsModel("own", (effect,), {})).items() if text != before[name]}
    assert changed == {f"module {module.stem}"}
    assert set(model_facts(PhysicsModel.base())) == {"model"}
