"""Long runs of many tasks whose results are written one by one, so that a run that was interrupted goes on."""

import json
import subprocess
from collections.abc import Callable, Mapping
from concurrent.futures import as_completed
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from vrdp_prob.progress import progress_display
from vrdp_prob.workers import local_workers

Task = TypeVar("Task")
Result = dict[str, Any]


def measured(
    work: Callable[[Task], Result],
    tasks: Mapping[Any, Task],
    path: Path,
    *,
    field: str,
    label: str,
    processes: int,
) -> list[Result]:
    """Results of tasks, those that are not there yet computed in processes and written as they come.

    Each result says which version of the code it is of.

    Parameters
    ----------
    work
        Makes the result of a task.
    tasks
        The tasks by what their result has in `field`.
    path
        File of the results, one JSON document in a line.
    field, label
        Name of what tells results apart, and that of the work on the progress display.
    processes
        Number of processes at most.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    known = {result[field]: result for result in read(path)}
    missing = [task for key, task in tasks.items() if key not in known]
    code = version_of_code()
    if others := {str(known[key].get("version")) for key in tasks if key in known} - {code}:
        print(f"{path}: results of {', '.join(sorted(others))} are kept; delete them to measure all with {code}.")
    with (
        local_workers(processes, tasks=len(missing)) as workers,
        path.open("a", encoding="utf-8") as file,
        progress_display(quiet=False).stage(label, total=len(missing)) as advance,
    ):
        for future in as_completed([workers.submit(work, task) for task in missing]):
            result = {**future.result(), "version": code}
            file.write(json.dumps(result) + "\n")
            file.flush()
            known[result[field]] = result
            advance(1)
    return [known[key] for key in tasks]


def read(path: Path) -> list[Result]:
    """Results of an earlier run; a line that was cut short is left out."""
    found = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            found.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return found


def version_of_code() -> str:
    """The commit that this is, `-dirty` after it where files differ; the package's version where git does not know."""
    describe = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty"]
    try:
        return subprocess.run(describe, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return version("vrdp-prob")
