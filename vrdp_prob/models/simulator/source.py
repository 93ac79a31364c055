"""From a model to compiled code: assemble generated laws and kernels into one module and import it from a cache."""

import hashlib
import importlib.util
import os
import re
import sys
import tempfile
from collections.abc import Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from types import ModuleType

import numba
from platformdirs import user_cache_dir

from vrdp_prob.files import write_atomically
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.simulator import tableau
from vrdp_prob.models.simulator.contact import rubs
from vrdp_prob.models.simulator.law_check import check_laws
from vrdp_prob.models.simulator.laws import Layout, is_timed, law_source, state_size, with_boundary, with_kick
from vrdp_prob.models.simulator.motion import ROLLING_SHARE, slips
from vrdp_prob.models.simulator.stages import step_source

CACHE_VARIABLE = "VRDP_PROB_CACHE"
"""Environment variable that names another folder for compiled kernels."""

_KERNELS = (
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
_LIGHT = "no_cpython_wrapper=True, no_cfunc_wrapper=True"
"""Options of functions that only compiled code calls; numba needs less time for them."""
_HEADER = '"""Assembled by vrdp_prob.models.simulator.source; do not edit."""\n\n'


def _without_imports(source: str) -> str:
    """Kernel source without the imports of other kernels, whose text stands before it."""
    return re.sub(r"^from vrdp_prob\.[\w.]+ import (\([^)]*\)|[^\n]*)\n", "", source, flags=re.MULTILINE)


def assemble(effects: Sequence[Effect], layout: Layout) -> str:
    """Source of the module that simulates a model."""
    check_laws(effects, layout)
    folder = resources.files("vrdp_prob.models.simulator")
    parts = [
        _HEADER,
        "import math\nfrom typing import NamedTuple\n\nimport numpy as np\nfrom numba import njit\n\n",
        f"compiled = njit(nogil=True, error_model='numpy', {_LIGHT}, _nrt=False)\n",
        f"allocating = njit(nogil=True, error_model='numpy', {_LIGHT})\n",
        f"STATE_SIZE, SLIPS, RUBS = {state_size(effects)}, {slips(effects)}, {rubs(effects)}\n",
        f"ROLLING_SHARE = {ROLLING_SHARE!r}\n",
        f"COUPLED, TIMED = {_is_coupled(effects)}, {is_timed(effects, layout)}\n",
        f"KICKS, BOUNDARIES = {len(with_kick(effects))}, {len(with_boundary(effects))}\n",
        *(f"{name} = np.array({getattr(tableau, name).tolist()!r})\n" for name in ("DENSE", "ERRORS", "NODES")),
        step_source(),
        law_source(effects, layout),
    ]
    for name in _KERNELS:
        file = folder / f"{name}_kernel.py"
        if file.is_file():
            parts.append(_without_imports(file.read_text(encoding="utf-8")))
    text = "\n".join(parts)
    _check_names(text)
    return text


def _check_names(text: str) -> None:
    """Raise where two kernels define a function of the same name, as all share one module."""
    names = re.findall(r"^def (\w+)\(", text, flags=re.MULTILINE)
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise RuntimeError(f"the kernel defines {', '.join(twice)} more than once; rename one of each.")


def _is_coupled(effects: Sequence[Effect]) -> bool:
    return any(effect.overrides("pair_force") for effect in effects)


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


@cache
def load(effects: tuple[Effect, ...], layout: Layout) -> ModuleType:
    """Import the kernel of a model, compiled once per machine, version of numba and set of effects."""
    text = assemble(effects, layout)
    digest = hashlib.sha256((text + numba.__version__).encode()).hexdigest()[:16]
    name = f"vrdp_prob_kernel_{digest}"
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
