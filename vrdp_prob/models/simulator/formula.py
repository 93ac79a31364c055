"""A physical law is written once, as a plain function of numbers; this module records and differentiates it.

A law calls the mathematics of `vrdp_prob.models.simulator.mathematics` and the ordinary operators. Called with numbers
or tensors it computes. Called with the symbols of this module it is recorded, common steps once. `vector_jacobian`
records its derivative in turn (reverse mode; A. Griewank and A. Walther, Evaluating Derivatives, 2nd ed. 2008,
section 3.2), and `machine_code.py` turns what was recorded into compiled functions.
"""

import operator
from collections.abc import Callable, Iterable, Sequence
from typing import Any

Scalar = Any
"""A number in a law: float, tensor or `Symbol`."""

COMPARISONS = frozenset({"<", "<=", ">", ">="})
_ARITHMETIC: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
_TINY = 1e-300
"""Keeps a derivative finite where a root or a logarithm has none."""


class Symbol:
    """A recorded step of a law (or an input, or a constant); made by a `Recorder`."""

    __slots__ = ("arguments", "number", "operation", "recorder", "value")

    def __init__(
        self, recorder: "Recorder", number: int, operation: str, arguments: tuple["Symbol", ...], value: object
    ) -> None:
        self.recorder, self.number = recorder, number
        self.operation, self.arguments, self.value = operation, arguments, value

    @property
    def constant(self) -> float | None:
        """The number where the symbol is a constant, else None."""
        return self.value if isinstance(self.value, float) else None

    def __add__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("+", self, other)

    def __radd__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("+", other, self)

    def __sub__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("-", self, other)

    def __rsub__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("-", other, self)

    def __mul__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("*", self, other)

    def __rmul__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("*", other, self)

    def __truediv__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("/", self, other)

    def __rtruediv__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("/", other, self)

    def __pow__(self, exponent: Scalar) -> "Symbol":
        return self.recorder.step("pow", self, exponent)

    def __neg__(self) -> "Symbol":
        return self.recorder.step("neg", self)

    def __lt__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("<", self, other)

    def __le__(self, other: Scalar) -> "Symbol":
        return self.recorder.step("<=", self, other)

    def __gt__(self, other: Scalar) -> "Symbol":
        return self.recorder.step(">", self, other)

    def __ge__(self, other: Scalar) -> "Symbol":
        return self.recorder.step(">=", self, other)

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        raise TypeError("a law cannot ask whether its inputs are equal; compare them with < or > in mathematics.where.")

    def __ne__(self, other: object) -> bool:
        raise TypeError("a law cannot ask whether its inputs differ; compare them with < or > in mathematics.where.")

    def __bool__(self) -> bool:
        raise TypeError("a law cannot branch on its inputs with 'if'; use mathematics.where instead.")


class Recorder:
    """Records the steps of a law, equal steps once."""

    def __init__(self) -> None:
        self._steps: dict[tuple[object, ...], Symbol] = {}

    def input(self, name: str, place: int | None = None) -> Symbol:
        """An input: an argument of the compiled function, or a number of an array."""
        return self._intern("input", (), (name, place))

    def constant(self, value: float) -> Symbol:
        """A constant."""
        return self._intern("constant", (), float(value))

    def step(self, operation: str, *operands: Scalar) -> Symbol:
        """The result of an operation, simplified where a constant makes that possible."""
        arguments = tuple(item if isinstance(item, Symbol) else self.constant(item) for item in operands)
        simple = self._simplified(operation, arguments)
        if simple is not None:
            return simple
        if operation in "+*" and arguments[0].number > arguments[1].number:
            arguments = (arguments[1], arguments[0])
        return self._intern(operation, arguments, None)

    def _intern(self, operation: str, arguments: tuple[Symbol, ...], value: object) -> Symbol:
        key = (operation, value, *(argument.number for argument in arguments))
        if key not in self._steps:
            self._steps[key] = Symbol(self, len(self._steps), operation, arguments, value)
        return self._steps[key]

    def _simplified(self, operation: str, arguments: tuple[Symbol, ...]) -> Symbol | None:
        if operation == "where":
            return arguments[1] if arguments[1] is arguments[2] else None
        if operation == "neg":
            return self._negated(arguments[0])
        if operation == "pow":
            return self._power(*arguments)
        if operation not in _ARITHMETIC:
            return None
        a, b = arguments[0].constant, arguments[1].constant
        if a is not None and b is not None and not (operation == "/" and b == 0):
            return self.constant(_ARITHMETIC[operation](a, b))
        simplify = {"+": self._sum, "-": self._difference, "*": self._product, "/": self._quotient}[operation]
        return simplify(*arguments)

    def _negated(self, inner: Symbol) -> Symbol | None:
        if inner.operation == "neg":
            return inner.arguments[0]
        return None if inner.constant is None else self.constant(-inner.constant)

    def _sum(self, left: Symbol, right: Symbol) -> Symbol | None:
        return right if left.constant == 0 else left if right.constant == 0 else None

    def _difference(self, left: Symbol, right: Symbol) -> Symbol | None:
        if left is right:
            return self.constant(0)
        return -right if left.constant == 0 else left if right.constant == 0 else None

    def _product(self, left: Symbol, right: Symbol) -> Symbol | None:
        for factor, other in ((left, right), (right, left)):
            if factor.constant == 0:
                return factor
            if factor.constant in (1, -1):
                return other if factor.constant == 1 else -other
        return None

    def _power(self, base: Symbol, exponent: Symbol) -> Symbol | None:
        return base if exponent.constant == 1 else base * base if exponent.constant == 2 else None

    def _quotient(self, left: Symbol, right: Symbol) -> Symbol | None:
        return left if right.constant == 1 or left.constant == 0 else None


def ordered(outputs: Iterable[Symbol]) -> list[Symbol]:
    """Steps that the outputs need, arguments first, each once."""
    order: list[Symbol] = []
    seen: set[int] = set()
    stack = [(output, False) for output in reversed(list(outputs))]
    while stack:
        symbol, expanded = stack.pop()
        if expanded:
            order.append(symbol)
        elif symbol.number not in seen:
            seen.add(symbol.number)
            stack.append((symbol, True))
            stack.extend((argument, False) for argument in reversed(symbol.arguments))
    return order


def _partials(symbol: Symbol, bar: Symbol) -> tuple[Scalar, ...]:
    """Adjoints of the arguments of one step from the adjoint of its result."""
    if symbol.operation not in _DERIVATIVES:
        raise NotImplementedError(f"no derivative is known for the operation '{symbol.operation}'")
    return _DERIVATIVES[symbol.operation](symbol, bar, *symbol.arguments)


def _of_arc_tangent(_: Symbol, bar: Symbol, y: Symbol, x: Symbol) -> tuple[Scalar, ...]:
    square = x * x + y * y
    return bar * x / square, -(bar * y) / square


def _of_power(result: Symbol, bar: Symbol, base: Symbol, exponent: Symbol) -> tuple[Scalar, ...]:
    step = bar.recorder.step
    return bar * exponent * base ** (exponent - 1), bar * result * step("log", step("max", base, _TINY))


def _if(condition: Symbol, a: Scalar, b: Scalar) -> Symbol:
    return condition.recorder.step("where", condition, a, b)


_DERIVATIVES: dict[str, Callable[..., tuple[Scalar, ...]]] = {
    "+": lambda _, bar, a, b: (bar, bar),
    "-": lambda _, bar, a, b: (bar, -bar),
    "*": lambda _, bar, a, b: (bar * b, bar * a),
    "/": lambda result, bar, a, b: (bar / b, -(bar * result) / b),
    "neg": lambda _, bar, a: (-bar,),
    "sqrt": lambda result, bar, a: (bar * 0.5 / bar.recorder.step("max", result, _TINY),),
    "sin": lambda _, bar, a: (bar * bar.recorder.step("cos", a),),
    "cos": lambda _, bar, a: (-(bar * bar.recorder.step("sin", a)),),
    "exp": lambda result, bar, a: (bar * result,),
    "log": lambda _, bar, a: (bar / a,),
    "tanh": lambda result, bar, a: (bar * (1 - result * result),),
    "abs": lambda _, bar, a: (_if(a < 0, -bar, bar),),
    "atan2": _of_arc_tangent,
    "pow": _of_power,
    "max": lambda _, bar, a, b: (_if(a < b, 0.0, bar), _if(a < b, bar, 0.0)),
    "min": lambda _, bar, a, b: (_if(b < a, 0.0, bar), _if(b < a, bar, 0.0)),
    "where": lambda _, bar, condition, a, b: (0.0, _if(condition, bar, 0.0), _if(condition, 0.0, bar)),
}
"""Adjoints of the arguments of a step from its result, the adjoint of the result, and the arguments."""


def vector_jacobian(outputs: Sequence[Scalar], bars: Sequence[Symbol], inputs: Sequence[Symbol]) -> list[Symbol]:
    """Adjoints of the inputs of a recorded law from adjoints (`bars`) of its outputs."""
    recorder = bars[0].recorder
    adjoint: dict[int, Symbol] = {}
    symbols = [output if isinstance(output, Symbol) else recorder.constant(output) for output in outputs]
    for output, bar in zip(symbols, bars, strict=True):
        adjoint[output.number] = adjoint.get(output.number, recorder.constant(0)) + bar
    for symbol in reversed(ordered(symbols)):
        bar = adjoint.get(symbol.number, recorder.constant(0))
        if bar.constant == 0 or not symbol.arguments or symbol.operation in COMPARISONS:
            continue
        for argument, part in zip(symbol.arguments, _partials(symbol, bar), strict=True):
            adjoint[argument.number] = adjoint.get(argument.number, recorder.constant(0)) + part
    return [adjoint.get(symbol.number, recorder.constant(0)) for symbol in inputs]


def depends(outputs: Sequence[Scalar], on: Symbol) -> bool:
    """Whether one of the outputs of a recorded law depends on an input."""
    return any(step is on for step in ordered(output for output in outputs if isinstance(output, Symbol)))
