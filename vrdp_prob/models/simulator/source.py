"""The kernels as compiled code: assemble their text to one module, compile it once per machine, keep it on disk."""

import contextlib
import hashlib
import importlib.util
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
from platformdirs import user_cache_dir

from vrdp_prob.files import write_atomically
from vrdp_prob.models.simulator import tableau
from vrdp_prob.models.simulator.motion import ROLLING_SHARE

CACHE_VARIABLE = "VRDP_PROB_CACHE"
"""Environment variable that names another folder for compiled kernels."""

_KERNELS = (
    "laws",
    "apart",
    "world",
    "cluster",
    "motion",
    "ending",
    "pressing",
    "step",
    "detection",
    "search",
    "tape",
    "piece",
    "event",
    "rollout",
    "adjoint",
    "adjoint_step",
    "adjoint_events",
    "batch",
)
_HEADER = '''"""Assembled by vrdp_prob.models.simulator.source; do not edit."""

import math

import numpy as np
from numba import njit
from numba.core.types import float64, int64, void

from vrdp_prob.models.simulator.bundle import Bundle, floats, integer_room, integers, new_bundle, room
from vrdp_prob.models.simulator.calls import call, call_for_integer, call_for_number

'''


def _without_imports(source: str) -> str:
    """Kernel source without the imports of other kernels, whose text stands before it."""
    return re.sub(r"^from vrdp_prob\.[\w.]+ import (\([^)]*\)|[^\n]*)\n", "", source, flags=re.MULTILINE)


def assemble() -> str:
    """Source of the module of all kernels."""
    folder = resources.files("vrdp_prob.models.simulator")
    parts = [
        _HEADER,
        f"ROLLING_SHARE = {ROLLING_SHARE!r}\n",
        *(f"{name} = np.array({getattr(tableau, name).tolist()!r})\n" for name in ("DENSE", "NODES")),
    ]
    parts += [_without_imports((folder / f"{name}_kernel.py").read_text(encoding="utf-8")) for name in _KERNELS]
    text = "\n".join(parts)
    _check_names(text)
    return text


def _check_names(text: str) -> None:
    """Raise where two kernels define the same name, as all share one module."""
    names = re.findall(r"^def (\w+)\(", text, flags=re.MULTILINE)
    for several in re.findall(r"^([A-Z][\w, ]*) = ", text, flags=re.MULTILINE):
        names += several.split(", ")
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise RuntimeError(f"the kernel defines {', '.join(twice)} more than once; rename one of each.")


def cache_folder() -> Path:
    """Folder of the compiled kernels: the user's cache, or a temporary one where that cannot be written."""
    chosen = os.environ.get(CACHE_VARIABLE)
    folder = Path(chosen) if chosen else Path(user_cache_dir("vrdp-prob")) / "kernels"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return Path(tempfile.mkdtemp(prefix="vrdp-prob-"))


def _digest(text: str) -> str:
    """Name of what the text of all kernels compiles to."""
    folder = resources.files("vrdp_prob.models.simulator")
    parts = [
        text,
        numba.__version__,
        *((folder / name).read_text(encoding="utf-8") for name in ("bundle.py", "calls.py")),
    ]
    return hashlib.sha256("".join(parts).encode()).hexdigest()[:16]


@cache
def kernels() -> ModuleType:
    """Import the kernels, compiled once per machine and version of numba."""
    text = assemble()
    name = f"vrdp_prob_kernel_{_digest(text)}"
    path = cache_folder() / f"{name}.py"
    if not path.is_file():
        with write_atomically(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    specification = importlib.util.spec_from_file_location(name, path)
    if specification is None or specification.loader is None:
        raise ImportError(f"{path}: the kernel cannot be imported.")
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module


@cache
def addresses_apart() -> dict[str, int]:
    """Addresses of the kernels that are compiled apart.

    Where they were never compiled on this machine, another process compiles half of them meanwhile.
    """
    functions = kernels()
    names = [function.__name__ for function in functions.APART]
    marker = Path(str(functions.__file__)).with_suffix(".compiled")
    if marker.is_file():
        return compile_apart(names)
    helper = _helper(marker.parent, names[len(names) // 2 :]) if _processors() > 1 else None
    addresses = compile_apart(names[: len(names) // 2])
    if helper is not None:
        helper.wait()
    addresses |= compile_apart(names[len(names) // 2 :])
    with contextlib.suppress(OSError):
        marker.touch()
    return addresses


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _helper(folder: Path, names: Sequence[str]) -> "subprocess.Popen[bytes] | None":
    """Process that compiles kernels into a folder; what it fails to compile is compiled here later."""
    code = f"from {__name__} import compile_apart; compile_apart({list(names)!r})"
    environment = {**os.environ, CACHE_VARIABLE: str(folder), "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    none = subprocess.DEVNULL
    try:
        return subprocess.Popen([sys.executable, "-c", code], env=environment, stdin=none, stdout=none, stderr=none)
    except OSError:
        return None


def compile_apart(names: Sequence[str]) -> dict[str, int]:
    """Addresses of kernels by name, compiled where they are not on disk yet."""
    options: dict[str, Any] = {"nopython": True, "error_model": "numpy", "_nrt": False}
    addresses: dict[str, int] = {}
    for function, signature in kernels().APART.items():
        if function.__name__ in names:
            _kept.append(numba.cfunc(signature, cache=True, **options)(function.py_func))
            addresses[function.__name__] = _kept[-1].address
    return addresses


_kept: list[Any] = []
"""Compiled kernels, which must live as long as their addresses are used."""
