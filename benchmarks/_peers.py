"""Everything that computes the log density and its gradient, under one interface."""

import importlib.util
from collections.abc import Callable
from functools import partial

import torch
from _fixed_step_contacts import Laws
from _fixed_step_torch import BODY_FIELDS, FORMULATIONS, inputs_of, positions
from _scenes import EXTENDED, FRAMES, LEAVES, NOISE, gradient_of, positions_of

from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds

OURS, COMPILED, JAX = "event-driven", "torch.compile", "JAX"
TORCH = tuple(f"torch, {formulation}" for formulation in FORMULATIONS)
HAS_JAX = importlib.util.find_spec("jax") is not None
Peer = Callable[[], object]


def laws_of(model: PhysicsModel) -> Laws:
    """Laws of the fixed-step simulator for a model."""
    return Laws(True, True, True) if model == EXTENDED else Laws()


def peers(
    names: tuple[str, ...], batches: list[Worlds], model: PhysicsModel
) -> tuple[dict[str, Peer], dict[str, float]]:
    """Functions that evaluate all batches once, and seconds that were needed to compile them."""
    seen = [positions_of(model)(worlds).detach() for worlds in batches]
    functions: dict[str, Peer] = {}
    compile_seconds: dict[str, float] = {}
    for name in names:
        if name == JAX:
            functions[name], compile_seconds[name] = _jax(batches, seen, model)
        else:
            simulator = _simulator(name, model)
            functions[name] = partial(_evaluate, simulator, batches, seen)
    return functions, compile_seconds


def _simulator(name: str, model: PhysicsModel) -> Callable[[Worlds], torch.Tensor]:
    if name == OURS:
        return positions_of(model)
    formulation = "all pairs" if name == COMPILED else name.removeprefix("torch, ")
    contacts = FORMULATIONS[formulation]
    compiled = name == COMPILED
    return lambda worlds: positions(worlds, len(FRAMES), laws_of(model), contacts, compiled=compiled)


def _evaluate(simulator: Callable[[Worlds], torch.Tensor], batches: list[Worlds], seen: list[torch.Tensor]) -> None:
    for worlds, target in zip(batches, seen, strict=True):
        gradient_of(worlds, simulator, target)


def _jax(batches: list[Worlds], seen: list[torch.Tensor], model: PhysicsModel) -> tuple[Peer, float]:
    from _fixed_step_jax import FORMULATIONS as IN_JAX  # noqa: PLC0415 - jax is an extra
    from _fixed_step_jax import value_and_gradient  # noqa: PLC0415

    inputs = []
    for worlds in batches:
        arrays = inputs_of(worlds)
        fields = {name: getattr(arrays, name).numpy() for name in BODY_FIELDS}
        parameters = {name: value.numpy() for name, value in arrays.parameters.items() if value.ndim == 1}
        inputs.append(arrays._replace(**fields, parameters=parameters))
    targets = [target.permute(1, 2, 3, 0).contiguous().numpy() for target in seen]
    contacts = IN_JAX["near pairs" if len(batches[0]) == 1 else "all pairs"]
    function, taken = value_and_gradient(
        inputs[0], targets[0], batches[0].shapes, noise=NOISE, laws=laws_of(model), contacts=contacts, again=True
    )

    def evaluate() -> None:
        for own, target in zip(inputs, targets, strict=True):
            function({name: getattr(own, name) for name in LEAVES}, own, target)

    return evaluate, taken
