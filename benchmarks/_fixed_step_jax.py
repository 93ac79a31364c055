"""The peer in JAX: the same simulator with fixed steps as a compiled scan, differentiated by JAX.

The physics is in `_fixed_step.py` and `_fixed_step_contacts.py`.

What was tried to make it fast (milliseconds per world for log density and gradient
of 5 discs, at 1 world and at 256 worlds): ten steps unrolled per frame 5.4 and 1.5, a scan of single steps 9.7 and 1.7,
pairs as slices of bodies instead of matrix products 7 to 12 and 1.1 to 2.0, frames computed again in the derivative
(`jax.checkpoint`) 6.3 and 0.43, all contacts skipped in steps where no pair is near (`lax.cond`) 3.7 at 1 world. With
squares at 256 worlds, matrix products that pick the bodies of a pair instead of indices (their derivative scatters):
2.6 after 4.5; x and y as separate arrays: no gain. The benchmark takes what was fastest: frames computed again, with
contacts skipped at 1 world and not skipped at many.
"""

import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np

# Read when JAX starts; a benchmark compares single threads.
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
os.environ["JAX_PLATFORMS"] = "cpu"

import jax
import jax.numpy as jnp
from _fixed_step import (
    STEPS_PER_FRAME,
    Constants,
    Inputs,
    Motion,
    System,
    begin,
    constants_of,
    meet,
    resist,
    step,
    system_of,
)
from _fixed_step_contacts import Laws, dot, matmul

from vrdp_prob.scene import Shape

jax.config.update("jax_enable_x64", True)


def meet_if_near(xp: Any, system: System, constants: Constants, motion: Motion) -> Motion:
    """What `meet` does, where in any world the outer circles of a pair overlap and, for discs, close."""
    near = jnp.zeros((), bool)
    for kind, pairs in system.pairs.items():
        offset = matmul(pairs.difference, motion.position)
        overlap = dot(offset, offset) < constants.pairs[kind].reach
        if kind == "disc_disc":
            overlap &= dot(offset, matmul(pairs.difference, motion.velocity)) < 0
        near |= overlap.any()

    def all_pairs() -> Motion:
        return meet(xp, system, constants, motion)

    def nothing() -> Motion:
        return motion

    return jax.lax.cond(near, all_pairs, nothing)


FORMULATIONS = {"all pairs": meet, "near pairs": meet_if_near}
"""How contacts are treated."""
Gradient = Callable[[dict[str, Any], Inputs, np.ndarray], tuple[Any, dict[str, Any]]]


def value_and_gradient(
    inputs: Inputs,
    target: np.ndarray,
    shapes: tuple[Shape, ...],
    *,
    noise: float,
    laws: Laws,
    contacts: Any,
    again: bool,
) -> tuple[Gradient, float]:
    """Compiled log density with its gradient, and the processor time in s that the compilation took.

    Parameters
    ----------
    inputs
        Arrays with the world as last axis, of the sizes to compile for; rows after those of `shapes` are walls.
    target
        Positions [frame, body, 2, world] in m that were seen.
    shapes
        Shapes of the bodies.
    noise
        Standard deviation of the errors in m.
    laws
        Which laws are on.
    contacts
        One of `FORMULATIONS`.
    again
        Whether frames are computed again in the derivative instead of being kept.

    Returns
    -------
    A function of the leaves, the inputs (whose fields of the same names are replaced) and the target.
    """
    system = system_of(np, shapes, laws, len(inputs.mass) - len(shapes))

    def log_density(leaves: dict[str, Any], inputs: Inputs, target: Any) -> Any:
        own = inputs._replace(**leaves)
        constants = constants_of(jnp, system, own)

        def one(motion: Motion, _: None) -> tuple[Motion, None]:
            return step(jnp, system, constants, motion, contacts=contacts, resistance=resist), None

        def frame(motion: Motion, _: None) -> tuple[Motion, Any]:
            motion, _ = jax.lax.scan(one, motion, None, length=STEPS_PER_FRAME, unroll=STEPS_PER_FRAME)
            return motion, motion.position[: len(shapes)]

        _, shown = jax.lax.scan(
            jax.checkpoint(frame) if again else frame, begin(jnp, system, own), None, length=len(target) - 1
        )
        shown = jnp.concatenate([own.position[None, : len(shapes)], shown])
        return -0.5 * jnp.sum(((shown - target) / noise) ** 2)

    leaves = {name: getattr(inputs, name) for name in ("position", "velocity", "mass", "restitution")}
    start = time.process_time()
    compiled = jax.jit(jax.value_and_grad(log_density)).lower(leaves, inputs, target).compile()
    seconds = time.process_time() - start

    def evaluate(leaves: dict[str, Any], inputs: Inputs, target: np.ndarray) -> tuple[Any, dict[str, Any]]:
        return jax.block_until_ready(compiled(leaves, inputs, target))

    return evaluate, seconds
