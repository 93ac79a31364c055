"""Paths of bodies that act on each other at a distance, by the rougher steps that these may take, and by finer ones."""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from jaxtyping import Float

from tests.simulator.comparison import scenes
from tests.simulator.scenes import FRAMES
from tests.simulator.test_differences import COUPLED, MIXES
from vrdp_prob.models.simulator.rollout import simulate
from vrdp_prob.models.simulator.source import CACHE_VARIABLE

ROOT = Path(__file__).parents[2]
COUNT = 150
WITHIN = {"discs": (2e-9, 2e-8), "mixed": (1e-8, 5e-6)}
"""Largest distance in m in the scene in the middle, and in the 95th of a hundred."""
FINER = """
import re
import sys
import numpy as np
from vrdp_prob.models.simulator import source
assembled = source.assemble()
finer, count = re.subn(r"^(TOLERANCE, COUPLED_TOLERANCE = \\S+), \\S+$", r"\\1, 1e-13", assembled, flags=re.MULTILINE)
assert count == 1
source.assemble = lambda: finer
from tests.simulator.test_coupled_steps import MIXES, paths
np.savez(sys.argv[1], **{mix: paths(shapes) for mix, shapes in MIXES.items()})
"""
"""What another interpreter runs, since errors of steps are compiled into the simulator."""


def paths(shapes: Sequence[object]) -> Float[np.ndarray, "scene time body column"]:
    """Motion in random scenes under attraction and repulsion of all sizes."""
    worlds = scenes(COUNT, shapes, 5, late=False)
    strengths = torch.linspace(-0.08, 0.08, COUNT, dtype=torch.float64)
    softening = torch.full((COUNT,), 0.1, dtype=torch.float64)
    worlds = replace(worlds, parameters={**worlds.parameters, "pair_strength": strengths, "pair_softening": softening})
    found: np.ndarray = simulate(worlds, FRAMES, COUPLED).trajectory.numpy()
    return found


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_rougher_steps_of_coupled_bodies_lead_nowhere_else(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    finer = tmp_path / "finer.npz"
    compiled = {CACHE_VARIABLE: str(tmp_path)}
    subprocess.run([sys.executable, "-c", FINER, str(finer)], check=True, cwd=ROOT, env={**os.environ, **compiled})
    exact = np.load(finer)
    for mix, shapes in MIXES.items():
        apart = np.abs(paths(shapes) - exact[mix]).reshape(COUNT, -1).max(axis=1)
        assert apart.max() > 0  # or both took the same steps
        middle, most = np.quantile(apart, [0.5, 0.95])
        print(f"{mix}: {middle:.1e} m in the scene in the middle, {most:.1e} m in the 95th of a hundred")
        record_property(mix, (middle, most))
        assert middle <= WITHIN[mix][0]
        assert most <= WITHIN[mix][1]
