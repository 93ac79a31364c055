"""The results of a long run, step by step, so that a run that was killed reads them and goes on from there.

For work whose steps follow from a seed: the same run takes the same steps in the same order, and finds each result
where it was kept. A result counts only for the very work that it was made by, so a run that has taken another way makes
anew what it needs. A run that keeps a journal goes on with what it would read from it, also where it has just made it,
and works on copies of what it is given: else it would find things worked out, or alike, that are not when it is taken
up.
"""

import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from functools import partial, wraps
from hashlib import sha256
from types import FunctionType, MethodType
from typing import Any, ParamSpec, TypeVar

import numpy as np
import torch
import xarray

from vrdp_prob.inference.runs.checkpoint import Checkpoint

Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")

_journal: ContextVar["Journal | None"] = ContextVar("_journal", default=None)


class Step:
    """One step of a run.

    Parameters
    ----------
    checkpoint
        Where its result is kept.
    number
        Which step it is.
    work
        A function and what it is given; both can be pickled, and so can its result.
    """

    def __init__(self, checkpoint: Checkpoint, number: int, work: tuple[Callable[..., Any], tuple[Any, ...]]) -> None:
        self._checkpoint = checkpoint
        self._name = f"step_{number:05d}"
        self._work = pickle.dumps(work)
        self._digest = _digest(work)

    def read(self) -> tuple[Any] | None:
        """Its result, alone in a tuple; None where it has to be made."""
        found = self._checkpoint.thing(self._name)
        if not isinstance(found, tuple) or len(found) != len(("digest", "result")):
            return None
        work, result = found
        return (result,) if work == self._digest else None

    def make(self) -> Any:
        """Its result, which is kept."""
        function, arguments = pickle.loads(self._work)
        _, result = self._checkpoint.keep_thing(self._name, (self._digest, function(*arguments)))
        return result


def _digest(thing: object) -> str:
    """A thing in a short text: what it is, and nothing of what it has worked out of that since."""
    text = sha256()
    _tell(thing, text.update)
    return text.hexdigest()


def _tell(thing: Any, told: Callable[[bytes], None]) -> None:
    """Tell what a thing is, in the same words wherever it is alike."""
    kind = type(thing)
    told(f"{kind.__module__}.{kind.__qualname__}(".encode())
    if thing is None or isinstance(thing, bool | int | float | complex | str | bytes | np.generic):
        told(repr(thing).encode())
    elif isinstance(thing, type | FunctionType):
        told(f"{thing.__module__}.{thing.__qualname__}".encode())
    elif isinstance(thing, np.ndarray) and thing.dtype != object:
        told(f"{thing.dtype} {thing.shape} ".encode() + np.ascontiguousarray(thing).tobytes())
    elif isinstance(thing, set | frozenset):
        told(" ".join(sorted(map(_digest, thing))).encode())
    elif (parts := _parts(thing)) is not None:
        for part in parts:
            _tell(part, told)
    else:
        told(pickle.dumps(thing))
    told(b")")


def _parts(thing: Any) -> Iterable[Any] | None:
    """What a thing consists of; None where it is not known to consist of anything."""
    parts: Iterable[Any] | None = None
    if is_dataclass(thing):
        parts = [getattr(thing, one.name) for one in fields(thing)]
    elif isinstance(thing, xarray.Dataset):
        parts = [(str(name), values.dims, values.values) for name, values in thing.variables.items()]
    elif isinstance(thing, Mapping):
        parts = [part for item in thing.items() for part in item]
    elif isinstance(thing, list | tuple):
        parts = thing
    elif isinstance(thing, np.ndarray):
        parts = thing.tolist()
    elif isinstance(thing, torch.Tensor):
        parts = [thing.detach().cpu().numpy()]
    elif isinstance(thing, partial):
        parts = [thing.func, thing.args, thing.keywords]
    elif isinstance(thing, MethodType):
        parts = [thing.__func__, thing.__self__]
    return parts


class Journal:
    """The steps of a run.

    Parameters
    ----------
    checkpoint
        Where their results are kept.
    """

    def __init__(self, checkpoint: Checkpoint) -> None:
        self._checkpoint = checkpoint
        self._steps = 0

    def step(self, function: Callable[..., Any], *arguments: Any) -> Step:
        """The next step: a function that is called with some arguments."""
        self._steps += 1
        return Step(self._checkpoint, self._steps, (function, arguments))


@contextmanager
def journal(checkpoint: Checkpoint | None) -> Iterator[None]:
    """A run whose steps are kept, or are read where they were; nothing is kept where the checkpoint is None.

    Parameters
    ----------
    checkpoint
        Of this very run. Results are pickles: a checkpoint of somebody else may hold any program.
    """
    token = _journal.set(None if checkpoint is None else Journal(checkpoint))
    try:
        yield
    finally:
        _journal.reset(token)


@contextmanager
def in_a_step() -> Iterator[Journal | None]:
    """The journal of the run, which does not see what is done meanwhile; None where none is kept."""
    current = _journal.get()
    token = _journal.set(None)
    try:
        yield current
    finally:
        _journal.reset(token)


def kept(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A function of a module each call of which is a step of the run; what it raises is not kept but raised anew."""

    @wraps(function)
    def stepping(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        with in_a_step() as current:
            if current is None:
                return function(*arguments, **options)
            one = current.step(_called, stepping, arguments, options)
            found = one.read()
            result: Result = one.make() if found is None else found[0]
            return result

    return stepping


def _called(function: Callable[..., Result], arguments: tuple[Any, ...], options: dict[str, Any]) -> Result:
    return function(*arguments, **options)
