"""A Runge-Kutta step of one body as machine code: its stages, its errors, its polynomial, and their derivatives.

Every weight that is not zero is written down as a number, in the order of the stages, and the state of a body is one
vector of eight numbers. The functions take the address of the law of motion, so one text serves all models; what they
compute is described in `laws_kernel.py`.
"""

from collections.abc import Callable, Sequence

import numpy as np

from vrdp_prob.models.simulator.machine_code import ARRAY, INTEGER, NUMBER, function_text, literal
from vrdp_prob.models.simulator.tableau import DEGREE, DENSE, ERRORS, NODES, STAGES, WEIGHTS

WIDTH = 8
"""Numbers in a body's state."""
_VECTOR = f"<{WIDTH} x double>"
_LAW = "ptr %phase, ptr %body, ptr %shared"


class _Lines:
    """Instructions on vectors."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._count = 0

    def add(self, instruction: str) -> str:
        """Append an instruction; returns the name of its result."""
        self._count += 1
        self.lines.append(f"  %v{self._count} = {instruction}")
        return f"%v{self._count}"

    def do(self, instruction: str) -> None:
        """Append an instruction without a result."""
        self.lines.append(f"  {instruction}")

    def label(self, name: str) -> None:
        """Begin a block."""
        self.lines.append(f"{name}:")

    def row(self, array: str, index: int, stride: str = str(WIDTH)) -> str:
        """Address of a row of an array."""
        return self.add(f"getelementptr double, ptr %{array}, i64 {self.add(f'mul i64 {stride}, {index}')}")

    def load(self, address: str) -> str:
        """The vector at an address."""
        return self.add(f"load {_VECTOR}, ptr {address}, align 8")

    def store(self, value: str, address: str) -> None:
        """Write a vector."""
        self.do(f"store {_VECTOR} {value}, ptr {address}, align 8")

    def spread(self, number: str) -> str:
        """A number as a vector."""
        first = self.add(f"insertelement {_VECTOR} poison, double {number}, i64 0")
        return self.add(f"shufflevector {_VECTOR} {first}, {_VECTOR} poison, <{WIDTH} x i32> zeroinitializer")

    def plus(self, a: str, b: str) -> str:
        """Sum of vectors."""
        return self.add(f"fadd {_VECTOR} {a}, {b}")

    def times(self, a: str, b: str) -> str:
        """Product of vectors, number by number."""
        return self.add(f"fmul {_VECTOR} {a}, {b}")

    def sum(self, weights: np.ndarray, term: Callable[[int], str]) -> str:
        """Sum of weighted vectors, in their order, without those of weight 0."""
        total = ""
        for index, weight in enumerate(weights.tolist()):
            if weight != 0.0:
                product = self.times(_constant(weight), term(index))
                total = self.plus(total, product) if total else product
        return total or "zeroinitializer"


def _constant(value: float) -> str:
    return "<" + ", ".join([f"double {literal(value)}"] * WIDTH) + ">"


def _state_at(lines: _Lines, stage: int) -> None:
    """State at which a stage is evaluated, from the earlier stages."""
    value = lines.load("%y")
    if stage:
        total = lines.sum(WEIGHTS[stage], lambda earlier: lines.load(lines.row("stages", earlier, "%stride")))
        value = lines.plus(value, lines.times(lines.spread("%h"), total))
    lines.store(value, "%state")


def _time_of(lines: _Lines, stage: int) -> str:
    return lines.add(f"fadd double %t, {lines.add(f'fmul double {literal(NODES[stage])}, %h')}")


def _dispatch(lines: _Lines, stages: Sequence[int]) -> None:
    """Jump to the block of the stage `begin`."""
    cases = " ".join(f"i64 {stage}, label %stage{stage}" for stage in stages)
    lines.do(f"switch i64 %begin, label %done [ {cases} ]")


def _go_on(lines: _Lines, following: int, *, last: bool) -> None:
    """Pass on to another stage, unless it is the stage `end`."""
    if last:
        lines.do("br label %done")
        return
    over = lines.add(f"icmp eq i64 %end, {following}")
    lines.do(f"br i1 {over}, label %done, label %stage{following}")


def _returned(lines: _Lines) -> list[str]:
    return [*lines.lines, "done:", "  ret void"]


def _stage_state() -> str:
    lines = _Lines()
    _dispatch(lines, range(STAGES))
    for stage in range(STAGES):
        lines.label(f"stage{stage}")
        _state_at(lines, stage)
        lines.do("br label %done")
    arguments = {"y": ARRAY, "stages": ARRAY, "stride": INTEGER, "begin": INTEGER, "h": NUMBER, "state": ARRAY}
    return function_text("stage_state", arguments, _returned(lines))


def _body_stages() -> str:
    lines = _Lines()
    _dispatch(lines, range(STAGES))
    for stage in range(STAGES):
        lines.label(f"stage{stage}")
        _state_at(lines, stage)
        out = lines.row("stages", stage, "%stride")
        lines.do(f"call void %law(double {_time_of(lines, stage)}, ptr %state, {_LAW}, ptr {out})")
        _go_on(lines, stage + 1, last=stage == STAGES - 1)
    arrays = ("y", "stages", "state", "phase", "body", "shared")
    numbers = {"stride": INTEGER, "t": NUMBER, "h": NUMBER, "begin": INTEGER, "end": INTEGER}
    return function_text("body_stages", {"law": ARRAY, **dict.fromkeys(arrays, ARRAY), **numbers}, _returned(lines))


def _body_stages_vjp() -> str:
    lines = _Lines()
    still = lines.add("icmp ne i64 %still, 0")
    _dispatch(lines, range(STAGES))
    for stage in reversed(range(STAGES)):
        lines.label(f"stage{stage}")
        _state_at(lines, stage)
        lines.do(f"br i1 {still}, label %after{stage}, label %law{stage}")
        lines.label(f"law{stage}")
        bars = "ptr %before, ptr %body_bar, ptr %shared_bar, ptr %t_bar"
        bar = lines.row("bars", stage, "%stride")
        lines.do(f"call void %law(double {_time_of(lines, stage)}, ptr %state, {_LAW}, ptr {bar}, {bars})")
        lines.do(f"br label %after{stage}")
        lines.label(f"after{stage}")
        before = lines.load("%before")
        if stage:
            scaled = lines.times(lines.spread("%h"), before)
            for earlier in np.flatnonzero(WEIGHTS[stage]).tolist():
                row = lines.row("bars", earlier, "%stride")
                more = lines.times(_constant(float(WEIGHTS[stage, earlier])), scaled)
                lines.store(lines.plus(lines.load(row), more), row)
        lines.store(lines.plus(lines.load("%state_bar"), before), "%state_bar")
        lines.store("zeroinitializer", "%before")
        _go_on(lines, stage - 1, last=stage == 0)
    arrays = ("y", "stages", "state", "phase", "body", "shared")
    of_bars = ("bars", "before", "state_bar", "body_bar", "shared_bar", "t_bar")
    integers = dict.fromkeys(("begin", "end", "still"), INTEGER)
    pointers = dict.fromkeys(("law", *arrays, *of_bars), ARRAY)
    arguments = {**pointers, "stride": INTEGER, "t": NUMBER, "h": NUMBER, **integers}
    return function_text("body_stages_vjp", arguments, _returned(lines))


def _dense_output() -> str:
    lines = _Lines()
    stages = [lines.load(lines.row("stages", stage, "%stride")) for stage in range(STAGES)]
    for power in range(1, DEGREE + 1):
        total = lines.sum(DENSE[power], stages.__getitem__)
        lines.store(lines.times(lines.spread("%h"), total), lines.row("out", power))
    arguments = {"stages": ARRAY, "stride": INTEGER, "h": NUMBER, "out": ARRAY}
    return function_text("dense_output", arguments, [*lines.lines, "  ret void"])


def _dense_output_vjp() -> str:
    lines = _Lines()
    powers = [lines.load(lines.row("bar", power)) for power in range(DEGREE + 1)]
    for stage in range(STAGES):
        total = lines.sum(DENSE[:, stage], powers.__getitem__)
        lines.store(lines.times(lines.spread("%h"), total), lines.row("bars", stage, "%stride"))
    arguments = {"bar": ARRAY, "h": NUMBER, "bars": ARRAY, "stride": INTEGER}
    return function_text("dense_output_vjp", arguments, [*lines.lines, "  ret void"])


def _step_errors() -> str:
    lines = _Lines()
    for row, weights in enumerate(ERRORS):
        total = lines.sum(weights, lambda stage: lines.load(lines.row("stages", stage, "%stride")))
        lines.store(total, lines.row("out", row))
    arguments = {"stages": ARRAY, "stride": INTEGER, "out": ARRAY}
    return function_text("step_errors", arguments, [*lines.lines, "  ret void"])


def step_functions() -> str:
    """Text of the functions of a step."""
    return "".join(
        [_stage_state(), _body_stages(), _body_stages_vjp(), _dense_output(), _dense_output_vjp(), _step_errors()]
    )
