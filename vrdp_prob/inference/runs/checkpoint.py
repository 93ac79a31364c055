"""A folder that keeps what a long run has done, so that a run that was killed goes on where it was.

A run that is taken up gives the same numbers, bit for bit, as one that was never broken off: every piece of work begins
with a seed or a state of its own, and is kept when it is whole. A file that cannot be read is made anew.
"""

import json
import pickle
import sys
import zipfile
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from vrdp_prob.errors import InputError
from vrdp_prob.files import check_writable, write_atomically
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.scene import Camera, Tracks
from vrdp_prob.version import __version__

Arrays = Mapping[str, np.ndarray]
DAMAGED = (
    *(pickle.UnpicklingError, EOFError, AttributeError, ImportError, LookupError, TypeError, ValueError),
    *(RuntimeError, MemoryError, OverflowError),
)
"""What reading a pickle says that was not written to its end, or damaged since."""
PACKAGE = Path(__file__).parents[2]


def fingerprint(tracks: Tracks, model: PhysicsModel, **settings: object) -> dict[str, str]:
    """What a run depends on, in short texts by name: the tracks, the model, this version, and the settings given."""
    return {**tracks_facts(tracks), **model_facts(model), **program_facts(**settings)}


def tracks_facts(tracks: Tracks) -> dict[str, str]:
    """Tracks with their camera, in a short text."""
    seen = sha256()
    for name, values in sorted(tracks.data.variables.items()):
        seen.update(str(name).encode())
        array = np.ascontiguousarray(values.values)
        seen.update(repr(array.tolist()).encode() if array.dtype == object else array.tobytes())
    camera = None if tracks.camera is None else tracks.camera.to_document()
    seen.update(repr((tracks.bodies, tracks.walls, camera)).encode())
    return {"tracks": seen.hexdigest()}


def videos_facts(videos: Sequence[Tracks]) -> dict[str, str]:
    """Tracks of several videos with their cameras and their order, in short texts by name."""
    each = {f"video {tracks.video}": tracks_facts(tracks)["tracks"] for tracks in videos}
    return {**each, "order of the videos": ", ".join(tracks.video for tracks in videos)}


def film_facts(file: Path, camera: Camera | None) -> dict[str, str]:
    """A video file and its camera, in short texts."""
    return {
        "video": sha256(file.read_bytes()).hexdigest(),
        "camera": "" if camera is None else str(camera.to_document()),
    }


def model_facts(model: PhysicsModel) -> dict[str, str]:
    """A physics model with the code of effects from elsewhere, in short texts."""
    return {"model": sha256(model.text.encode()).hexdigest(), **effects_facts(model.effects)}


def check_importable(effects: Iterable[Effect]) -> None:
    """Refuse effects that a checkpoint of a run in several processes cannot keep, as their classes are in no module.

    Raises
    ------
    InputError
        If there is one.
    """
    for kind in map(type, effects):
        if kind.__module__ == "__main__" or "<locals>" in kind.__qualname__:
            raise InputError(
                f"the effect {kind.__name__} is defined in a notebook, a script or a function, where a checkpoint does "
                "not find it again; put its class at the top of a module and import it, or go without the checkpoint."
            )


def effects_facts(effects: Sequence[Effect]) -> dict[str, str]:
    """The modules that define effects and are not of this package, in short texts by name; not what they import."""
    found = {}
    kinds = {kind for effect in effects for kind in type(effect).__mro__ if issubclass(kind, Effect)}
    for name in sorted({kind.__module__ for kind in kinds}):
        file = getattr(sys.modules.get(name), "__file__", None)
        if file is not None and name.split(".")[0] != PACKAGE.name:
            found[f"module {name}"] = sha256(Path(file).read_bytes()).hexdigest()
    return found


def program_facts(**settings: object) -> dict[str, str]:
    """The version of the program with the text of its code, and the settings given, in short texts by name."""
    return {"version": f"{__version__} {_code()}", **{name: str(value) for name, value in settings.items()}}


@cache
def _code() -> str:
    """All modules of this package, in a short text: versions between releases differ, too."""
    text = sha256()
    for module in sorted(PACKAGE.rglob("*.py")):
        text.update(str(module.relative_to(PACKAGE)).encode())
        text.update(module.read_bytes())
    return text.hexdigest()[:12]


FINGERPRINT = "fingerprint.json"
KEPT = ("*.npz", "ensemble_*.h5", "step_*.pickle", "chains.pickle")
"""Files of what a run has done."""


class Checkpoint:
    """What one run has done so far.

    Parameters
    ----------
    folder
        Where to keep it; made if it is not there.
    facts
        What the run depends on, by name (see `fingerprint`).

    Raises
    ------
    InputError
        If the folder cannot be written, or holds what another run has done, or what does not say whose it is: what
        belongs to other tracks, another seed or other settings is neither mixed with this run nor thrown away.
    """

    def __init__(self, folder: Path | str, facts: Mapping[str, str]) -> None:
        self.folder = Path(folder)
        check_writable(self.folder)
        self._facts = dict(facts)
        found = self._owner()
        self._refuse_another(found)
        if found is None and any(any(self.folder.glob(pattern)) for pattern in KEPT):
            raise InputError(
                f"{self.folder}: there is a checkpoint that does not say what run it belongs to ({FINGERPRINT} is "
                "missing or cannot be read); choose another folder, or delete this one to start anew."
            )

    def _refuse_another(self, owner: dict[str, str] | None) -> None:
        """Refuse a folder that belongs to another run."""
        if owner is not None and owner != self._facts:
            names = sorted(set(owner) | set(self._facts))
            other = ", ".join(name for name in names if owner.get(name) != self._facts.get(name))
            raise InputError(
                f"{self.folder}: the checkpoint belongs to another run (other {other}); choose another folder, or "
                "delete this one to start anew."
            )

    def claim(self) -> None:
        """From now on the folder belongs to this run, which does so by itself when it keeps something.

        Raises
        ------
        InputError
            If it belongs to another run by now.
        """
        owner = self._owner()
        self._refuse_another(owner)
        if owner is None:
            with write_atomically(self.folder / FINGERPRINT) as temporary:
                temporary.write_text(json.dumps(self._facts, indent=1), encoding="utf-8")

    def path(self, name: str) -> Path:
        """Place of a file that is to be written; it claims the folder."""
        self.claim()
        return self.folder / name

    def _owner(self) -> dict[str, str] | None:
        """What the run depends on that the folder belongs to; None where it belongs to none."""
        try:
            found = json.loads((self.folder / FINGERPRINT).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) else None

    def arrays(self, name: str, needed: Collection[str] = ()) -> dict[str, np.ndarray] | None:
        """Arrays that were kept under a name; None where there are none, one is missing, or they cannot be read."""
        if self._owner() is None:
            return None
        try:
            with np.load(self.folder / f"{name}.npz", allow_pickle=False) as kept:
                return {key: kept[key] for key in {*kept.files, *needed}}
        except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
            return None

    def text(self, name: str) -> str | None:
        """Text of a file that was kept; None where there is none. Reading does not claim the folder."""
        if self._owner() is None:
            return None
        try:
            return (self.folder / name).read_text(encoding="utf-8")
        except (OSError, ValueError):
            return None

    def thing(self, name: str) -> Any:
        """What was kept as a pickle; None where there is none, or it cannot be read.

        A pickle may hold any program: only a folder that one has made oneself is to be gone on with.
        """
        if self._owner() is None:
            return None
        try:
            return pickle.loads((self.folder / f"{name}.pickle").read_bytes())
        except (OSError, *DAMAGED):
            return None

    def keep_thing(self, name: str, thing: Any) -> Any:
        """Keep a thing as a pickle, whole or not at all; gives what a run that is taken up would read.

        That may differ in the layout of arrays, and so in the last digit of what is made of them.
        """
        content = pickle.dumps(thing)
        with write_atomically(self.path(f"{name}.pickle")) as temporary:
            temporary.write_bytes(content)
        return pickle.loads(content)

    def keep(self, name: str, arrays: Arrays) -> None:
        """Keep arrays under a name, whole or not at all."""
        with write_atomically(self.path(f"{name}.npz")) as temporary, temporary.open("wb") as stream:
            # numpy's stubs take every keyword for allow_pickle
            np.savez(stream, **arrays)  # type: ignore[arg-type]


def kept(
    checkpoint: Checkpoint | None,
    name: str,
    generator: np.random.Generator,
    compute: Callable[[], Arrays],
) -> Arrays:
    """What `compute` gives, computed once: a run that is taken up reads it, and its generator goes on from there.

    Parameters
    ----------
    checkpoint
        Where it is kept; nowhere if None.
    name
        The name it is kept under.
    generator
        Source of the randomness that `compute` uses.
    compute
        The work.
    """
    found = checkpoint.arrays(name) if checkpoint is not None else None
    if found is not None and "generator" in found:
        generator.bit_generator.state = json.loads(str(found.pop("generator")))
        return found
    arrays = compute()
    if checkpoint is not None:
        checkpoint.keep(name, {**arrays, "generator": np.array(json.dumps(generator.bit_generator.state))})
    return arrays
