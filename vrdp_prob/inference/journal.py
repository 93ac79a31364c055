"""The results of a long run, step by step, so that a run that was killed reads them and goes on from there.

For work whose steps follow from a seed: the same run takes the same steps in the same order, and finds each result
where it was kept. A result counts only for the very work that it was made by, so a run that has taken another way makes
anew what it needs. A run that keeps a journal goes on with what it would read from it, also where it has just made it,
and works on copies of what it is given: else it would find things worked out, or alike, that are not when it is taken
up.
"""

import io
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from functools import wraps
from hashlib import sha256
from typing import Any, ParamSpec, TypeVar

import xarray

from vrdp_prob.inference.checkpoint import Checkpoint

Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")

_journal: ContextVar["Journal | None"] = ContextVar("_journal", default=None)
_DAMAGED = (pickle.UnpicklingError, EOFError, AttributeError, ImportError, IndexError, KeyError, TypeError, ValueError)
"""What reading a file says that was not written to its end, or damaged since."""


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
        self._file = f"step_{number:05d}.pickle"
        self._work = pickle.dumps(work)
        self._digest = _digest(work)

    def read(self) -> tuple[Any] | None:
        """Its result, alone in a tuple; None where it has to be made."""
        content = self._checkpoint.content(self._file)
        if content is None:
            return None
        try:
            work, result = pickle.loads(content)
        except _DAMAGED:
            return None
        return (result,) if work == self._digest else None

    def make(self) -> Any:
        """Its result, which is kept."""
        function, arguments = pickle.loads(self._work)
        content = pickle.dumps((self._digest, function(*arguments)))
        self._checkpoint.keep_content(self._file, content)
        return pickle.loads(content)[1]


class _Facts(pickle.Pickler):
    """Writes what objects are, and nothing of what they have worked out of it since."""

    def reducer_override(self, thing: object) -> Any:
        if isinstance(thing, type):
            return NotImplemented
        if is_dataclass(thing):
            return tuple, ((type(thing), *(getattr(thing, one.name) for one in fields(thing))),)
        if isinstance(thing, xarray.Dataset):
            return tuple, ([(str(name), values.dims, values.values) for name, values in thing.variables.items()],)
        return NotImplemented


def _digest(work: object) -> str:
    """Work in a short text: the same for what is alike."""
    written = io.BytesIO()
    facts = _Facts(written)
    facts.fast = True  # what stands there twice is written twice, be it one object or two that are alike
    facts.dump(work)
    return sha256(written.getvalue()).hexdigest()


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
