"""Processes that make pieces of NUTS chains for another one: tasks come in as pickles, pieces go out.

Each is a fresh interpreter, neither a fork (threads of torch do not survive one) nor a child of multiprocessing (which
would run the user's script again), and ends when the one who started it is gone.
"""

import os
import pickle
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from queue import SimpleQueue
from types import TracebackType

import torch

from vrdp_prob.inference.samplers.nuts_chain import Piece, Task, make


class _Worker:
    """The process, seen from outside."""

    def __init__(self) -> None:
        paths = [path for path in sys.path if path]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-c", "from vrdp_prob.inference.samplers.nuts_worker import serve; serve()"]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment)

    def __enter__(self) -> "_Worker":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.communicate()

    def make(self, pickled: bytes) -> Piece | None:
        """What a task gives; None where the process cannot take it (or is gone)."""
        if self._process.stdin is None or self._process.stdout is None:
            return None
        try:
            pickle.dump(pickled, self._process.stdin)
            self._process.stdin.flush()
            answer = pickle.load(self._process.stdout)
        except (OSError, EOFError, pickle.UnpicklingError):
            return None
        if isinstance(answer, Exception):
            raise answer
        return answer if isinstance(answer, Piece) else None


class Workers:
    """Makes several pieces at once, one here and one in each process, or one after the other where there are none.

    Parameters
    ----------
    workers
        The processes.
    """

    def __init__(self, workers: Sequence[_Worker]) -> None:
        self._free: SimpleQueue[_Worker] = SimpleQueue()
        for worker in workers:
            self._free.put(worker)
        self._count = len(workers)

    def make(self, tasks: Sequence[Task]) -> list[Piece]:
        """What each task gives, in order."""
        pickled = [one for task in tasks[1:] if (one := _pickled(task)) is not None] if self._count else []
        if not pickled or len(pickled) < len(tasks) - 1:
            return [make(task) for task in tasks]
        with ThreadPoolExecutor(self._count) as threads:
            coming = [threads.submit(self._made, one) for one in pickled]
            pieces = [make(tasks[0]), *(one.result() for one in coming)]
        # A process that is gone has made nothing.
        return [make(task) if piece is None else piece for task, piece in zip(tasks, pieces, strict=True)]

    def _made(self, pickled: bytes) -> Piece | None:
        worker = self._free.get()
        try:
            return worker.make(pickled)
        finally:
            self._free.put(worker)


@contextmanager
def workers(count: int) -> Iterator[Workers]:
    """So many processes, this one among them; they end with the block."""
    with ExitStack() as stack:
        yield Workers([stack.enter_context(_Worker()) for _ in range(count - 1)])


def _pickled(task: Task) -> bytes | None:
    """The task as bytes; None where something of it cannot be sent, such as a function within a function."""
    try:
        return pickle.dumps(task)
    except (pickle.PicklingError, AttributeError, TypeError):
        return None


def serve() -> None:
    """Make what comes in on standard input until it ends; answer on standard output, and print nothing else there."""
    torch.set_num_threads(1)
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    while True:
        try:
            pickled = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        pickle.dump(_answer(pickled), answers)
        answers.flush()


def _answer(pickled: bytes) -> Piece | Exception | None:
    try:
        task = pickle.loads(pickled)
    except Exception:
        return None
    try:
        piece = make(task)
    except Exception as error:
        return error
    return piece
