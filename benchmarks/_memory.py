"""Peak memory of one evaluation in a fresh process: `python benchmarks/_memory.py PEER discs|mixed WORLDS`.

Prints MiB by which the resident memory rises at most above what it was before the evaluation; what is loaded and
compiled by then does not count.
"""

import subprocess
import sys
from pathlib import Path

MEGA = 1024.0
STATUS = Path("/proc/self/status")


def _status(field: str) -> float:
    line = next(line for line in STATUS.read_text(encoding="ascii").splitlines() if line.startswith(field))
    return int(line.split()[1]) / MEGA


def peak(peer: str, shapes: str, worlds: int) -> float | None:
    """The same from another process; None where the system does not tell."""
    if not STATUS.is_file():
        return None
    command = [sys.executable, __file__, peer, shapes, str(worlds)]
    return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def main() -> None:
    """Evaluate once with the peak reset."""
    import torch  # noqa: PLC0415 - the parent process only needs `peak`
    from _peers import JAX, OURS, peers  # noqa: PLC0415
    from _scenes import BASE, DISCS, MIXED, scenes  # noqa: PLC0415

    torch.set_num_threads(1)
    peer, shapes, count = sys.argv[1:]
    kinds = DISCS if shapes == "discs" else MIXED
    if peer != JAX:
        peers((peer,), [scenes(1, kinds)], BASE)[0][peer]()
    else:
        peers((OURS,), [scenes(1, kinds)], BASE)[0][OURS]()
    function = peers((peer,), [scenes(int(count), kinds)], BASE)[0][peer]
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    before = _status("VmRSS")
    function()
    print(_status("VmHWM") - before)


if __name__ == "__main__":
    main()
