"""Work on many items side by side."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_parallel(task: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
    """Results of a task, one thread per processor; the simulator lets threads run side by side."""
    with ThreadPoolExecutor(max_workers=max(1, min(len(items), os.cpu_count() or 1))) as workers:
        return list(workers.map(task, items))
