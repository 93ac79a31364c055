"""From a model to compiled code: its laws become machine code in memory, and the kernels are told where it is."""

from dataclasses import dataclass
from functools import cache
from types import ModuleType

import numpy as np
from jaxtyping import Int

from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.simulator.contact import ContactKind, rubs
from vrdp_prob.models.simulator.law_check import check_laws
from vrdp_prob.models.simulator.laws import (
    Layout,
    geometry_text,
    is_coupled,
    is_timed,
    law_text,
    with_boundary,
    with_kick,
)
from vrdp_prob.models.simulator.machine_code import MachineCode
from vrdp_prob.models.simulator.motion import slips
from vrdp_prob.models.simulator.source import addresses_apart, kernels
from vrdp_prob.models.simulator.stages import step_functions


@dataclass(frozen=True, eq=False)
class Kernel:
    """The compiled simulator of a model.

    Parameters
    ----------
    functions
        Module of the kernels, the same for all models.
    model
        Entries of the model, as `laws_kernel.py` names them.
    code
        The machine code whose addresses stand there.
    """

    functions: ModuleType
    model: Int[np.ndarray, "entry"]
    code: tuple[MachineCode, ...]

    @property
    def kick_count(self) -> int:
        """Number of effects that change velocities at one time."""
        return int(self.model[self.functions.KICKS])

    @property
    def boundary_count(self) -> int:
        """Number of effects with a boundary."""
        return int(self.model[self.functions.BOUNDARIES])


@cache
def _common_code() -> MachineCode:
    """What is machine code in all models."""
    return MachineCode(step_functions() + geometry_text())


_LAWS = ("motion", "motion_vjp", "external", "pair_force", "pair_force_vjp")
_STEP = ("stage_state", "body_stages", "body_stages_vjp", "dense_output", "dense_output_vjp", "step_errors")
_CONTACT_LAWS = ("contact_law", "contact_law_vjp")
_CONTACT_GEOMETRY = ("gap_law_vjp", "constraint_law", "constraint_law_vjp")
_KICK = ("kick_time", "kick_time_vjp", "kick", "kick_vjp")
_BOUNDARY = ("boundary", "boundary_rate", "boundary_vjp")


@cache
def load(effects: tuple[Effect, ...], layout: Layout) -> Kernel:
    """The kernel of a model; its laws are compiled in memory, once per process."""
    check_laws(effects, layout)
    functions, common, own = kernels(), _common_code(), MachineCode(law_text(effects, layout))
    kicks, boundaries = len(with_kick(effects)), len(with_boundary(effects))
    entries = {
        "slips": slips(effects),
        "rubs": rubs(effects),
        "coupled": is_coupled(effects),
        "timed": is_timed(effects, layout),
        "kicks": kicks,
        "boundaries": boundaries,
        **addresses_apart(),
        **{name: own.address(name) for name in _LAWS},
        **{name: common.address(name) for name in _STEP},
    }
    model = np.zeros(functions.FIRST_KICK + len(_KICK) * kicks + len(_BOUNDARY) * boundaries, np.int64)
    for name, entry in entries.items():
        model[getattr(functions, name.upper())] = entry
    for code, names in ((own, _CONTACT_LAWS), (common, _CONTACT_GEOMETRY)):
        for name in names:
            first = getattr(functions, name.upper())
            model[first : first + len(ContactKind)] = [code.address(f"{name}_{int(kind)}") for kind in ContactKind]
    of_kicks = [own.address(f"{name}_{number}") for number in range(kicks) for name in _KICK]
    of_boundaries = [own.address(f"{name}_{number}") for number in range(boundaries) for name in _BOUNDARY]
    model[functions.FIRST_KICK :] = [*of_kicks, *of_boundaries]
    return Kernel(functions, model, (common, own))
