"""Source of the sums of a Runge-Kutta step, written down term by term.

A loop over a table of weights spends its time on zeros and on counting; these functions hold every weight that is not
zero as a number, in the order of the stages.
"""

import numpy as np

from vrdp_prob.models.simulator.formula import function_source
from vrdp_prob.models.simulator.tableau import DEGREE, DENSE, STAGES, WEIGHTS


def _sum(weights: np.ndarray, terms: str) -> str:
    """Sum of weighted terms, whose text has a place for the number of the stage."""
    parts = [f"{weight!r} * {terms.format(index)}" for index, weight in enumerate(weights.tolist()) if weight != 0.0]
    return " + ".join(parts)


def _loop(statements: list[str]) -> list[str]:
    return ["for c in range(STATE_SIZE):", *(f"    {statement}" for statement in statements)]


def _by_stage(blocks: list[list[str]]) -> list[str]:
    """One block of statements for each stage."""
    lines = []
    for stage, block in enumerate(blocks):
        lines.append(f"{'if' if stage == 0 else 'elif'} stage == {stage}:")
        lines += [f"    {line}" for line in block]
    return lines


def step_source() -> str:
    """Source of the functions on stages that `laws_kernel.py` describes."""
    state = [
        _loop([f"out[c] = y[c] + h * ({_sum(WEIGHTS[stage], 'stages[{}, body, c]')})" if stage else "out[c] = y[c]"])
        for stage in range(STAGES)
    ]
    spread = [
        _loop(
            [
                f"bars[{earlier}, body, c] += {float(WEIGHTS[stage, earlier])!r} * (h * before[c])"
                for earlier in range(stage)
                if WEIGHTS[stage, earlier] != 0.0
            ]
        )
        if stage
        else ["pass"]
        for stage in range(STAGES)
    ]
    polynomial = [
        f"out[{power}, c] = h * ({_sum(DENSE[power], 'stages[{}, body, c]')})" for power in range(1, DEGREE + 1)
    ]
    of_polynomial = []
    for stage in range(STAGES):
        column = DENSE[:, stage]
        total = _sum(column, "bar[{}, c]")
        of_polynomial.append(f"bars[{stage}, body, c] = " + (f"h * ({total})" if total else "0.0"))
    return "\n".join(
        [
            function_source("stage_state", "y, stages, body, stage, h, out", _by_stage(state)),
            function_source("stage_state_vjp", "before, bars, body, stage, h", _by_stage(spread)),
            function_source("dense_output", "stages, body, h, out", _loop(polynomial)),
            function_source("dense_output_vjp", "bar, body, h, bars", _loop(of_polynomial)),
        ]
    )
