"""Who works on the videos: processes of this machine, or a Dask cluster."""

import os
import threading
import time
import warnings
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager

import loky

from vrdp_prob.errors import InputError, check_whole_number

PATIENCE = 20
"""Seconds in which a cluster has to answer."""


def check_processes(processes: int | None) -> None:
    """Refuse a number of processes that is none.

    Raises
    ------
    InputError
        If it is neither None nor a whole number of at least 1.
    """
    if processes is not None:
        check_whole_number("processes", processes, least=1)


@contextmanager
def local_workers(processes: int | None, *, tasks: int) -> Iterator[Executor]:
    """Processes of this machine, as many as there are cores where None; they end with the block, however it ends.

    There are no more of them than tasks.
    """
    check_processes(processes)
    workers = loky.ProcessPoolExecutor(
        max_workers=min(processes or os.cpu_count() or 1, max(tasks, 1)), initializer=_end_with, initargs=(os.getpid(),)
    )
    finished = False
    try:
        with warnings.catch_warnings():  # a worker that has grown is replaced between two tasks, which loses nothing
            warnings.filterwarnings("ignore", "A worker was restarted", UserWarning)
            yield workers
        finished = True
    finally:
        workers.shutdown(wait=finished, kill_workers=not finished)


def _end_with(parent: int) -> None:
    """Let this process end once its parent is gone, which may have been killed without a chance to tell."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """The workers of a Dask cluster.

    Raises
    ------
    InputError
        If the library is not installed, or no scheduler answers.
    """
    try:
        from distributed import Client  # noqa: PLC0415 - an optional part
    except ImportError as error:
        raise InputError(
            "--dask needs the library distributed; install it with pip install 'vrdp-prob[dask]'."
        ) from error
    try:
        client = Client(address, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"{address}: no Dask scheduler answers there; start one (dask scheduler) or check the address."
        ) from error
    with client, client.get_executor(pure=False) as workers:
        yield workers
