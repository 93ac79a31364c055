"""From recorded laws to machine code: functions as LLVM text, compiled in memory within milliseconds.

What a law computes is a straight line of operations on float64 numbers, so nothing is left to infer or to optimise: the
text goes to LLVM's code generator as it is. A function takes addresses of arrays and numbers, in the order in which
`laws_kernel.py` calls it, and keeps the order of operations, so that the same law gives the same numbers everywhere.
"""

import struct
from collections.abc import Iterable, Mapping, Sequence
from functools import cache

import llvmlite.binding as llvm  # type: ignore[import-untyped]  # publishes no types

from vrdp_prob.models.simulator.formula import COMPARISONS, Scalar, Symbol, ordered

NUMBER, ARRAY, INTEGER = "double", "ptr", "i64"
"""Types of arguments."""
_ARITHMETIC = {"+": "fadd", "-": "fsub", "*": "fmul", "/": "fdiv"}
_CONDITIONS = {"<": "olt", "<=": "ole", ">": "ogt", ">=": "oge"}
_CHOICES = {"min": "olt", "max": "ogt"}
_CALLS = {
    "sqrt": "llvm.sqrt.f64",
    "abs": "llvm.fabs.f64",
    **{name: name for name in ("sin", "cos", "atan2", "exp", "log", "tanh", "pow")},
}
_BINARY = frozenset({"atan2", "pow"})


def declarations() -> str:
    """What every text of functions begins with: the mathematics that it may call."""
    lines = []
    for operation, name in _CALLS.items():
        arguments = "double, double" if operation in _BINARY else "double"
        lines.append(f"declare double @{name}({arguments})")
    return "\n".join(lines) + "\n"


def literal(value: float) -> str:
    """A number, exactly."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


class _Lines:
    """Instructions of one function."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._names: dict[int, str] = {}
        self._count = 0

    def add(self, instruction: str) -> str:
        """Append an instruction; returns the name of its result."""
        self._count += 1
        self.lines.append(f"  %v{self._count} = {instruction}")
        return f"%v{self._count}"

    def place(self, array: str, index: int) -> str:
        """Address of a number of an array."""
        return self.add(f"getelementptr double, ptr %{array}, i64 {index}")

    def record(self, steps: Iterable[Symbol]) -> None:
        """Append the steps of a law, arguments before what needs them."""
        for step in steps:
            if step.constant is not None:
                self._names[step.number] = literal(step.constant)
            elif step.operation == "input":
                self._names[step.number] = self._input(*step.value)  # type: ignore[misc]  # a pair, see Recorder.input
            else:
                self._names[step.number] = self._step(step)

    def value(self, of: Scalar) -> str:
        """A number that was recorded, or is constant."""
        if not isinstance(of, Symbol):
            return literal(of)
        name = self._names[of.number]
        return self.add(f"uitofp i1 {name} to double") if of.operation in COMPARISONS else name

    def _input(self, name: str, index: int | None) -> str:
        return f"%{name}" if index is None else self.add(f"load double, ptr {self.place(name, index)}")

    def _step(self, step: Symbol) -> str:
        operation = step.operation
        if operation == "where":
            condition = self._condition(step.arguments[0])
            chosen, other = (self.value(argument) for argument in step.arguments[1:])
            return self.add(f"select i1 {condition}, double {chosen}, double {other}")
        values = [self.value(argument) for argument in step.arguments]
        if operation in _ARITHMETIC:
            return self.add(f"{_ARITHMETIC[operation]} double {values[0]}, {values[1]}")
        if operation in _CONDITIONS:
            return self.add(f"fcmp {_CONDITIONS[operation]} double {values[0]}, {values[1]}")
        if operation in _CHOICES:
            # As in Python: the second only where it is really smaller, or larger.
            second = self.add(f"fcmp {_CHOICES[operation]} double {values[1]}, {values[0]}")
            return self.add(f"select i1 {second}, double {values[1]}, double {values[0]}")
        if operation == "neg":
            return self.add(f"fneg double {values[0]}")
        arguments = ", ".join(f"double {value}" for value in values)
        return self.add(f"call double @{_CALLS[operation]}({arguments})")

    def _condition(self, symbol: Symbol) -> str:
        if symbol.operation in COMPARISONS:
            return self._names[symbol.number]
        return self.add(f"fcmp une double {self._names[symbol.number]}, {literal(0.0)}")


def law_function(
    name: str,
    arguments: Mapping[str, str],
    outputs: Mapping[str, Sequence[Scalar]],
    *,
    add: bool = False,
    result: Scalar = None,
) -> str:
    """Text of a function that computes a recorded law.

    Parameters
    ----------
    name
        Its name.
    arguments
        Types of the arguments by name, in their order.
    outputs
        Recorded numbers by the array that takes them, from its first place on.
    add
        Whether they are added to what the arrays hold.
    result
        A recorded number that the function returns, if it does.
    """
    body = _Lines()
    wanted = [(array, place, value) for array, values in outputs.items() for place, value in enumerate(values)]
    wanted = [entry for entry in wanted if not (add and _is_zero(entry[2]))]
    body.record(ordered(value for value in (*(entry[2] for entry in wanted), result) if isinstance(value, Symbol)))
    for array, place, number in wanted:
        address, value = body.place(array, place), body.value(number)
        if add:
            value = body.add(f"fadd double {body.add(f'load double, ptr {address}')}, {value}")
        body.lines.append(f"  store double {value}, ptr {address}")
    returned = "void" if result is None else f"double {body.value(result)}"
    return function_text(name, arguments, [*body.lines, f"  ret {returned}"])


def function_text(name: str, arguments: Mapping[str, str], lines: Sequence[str]) -> str:
    """Text of a function from its instructions."""
    stated = ", ".join(f"{kind} %{argument}" for argument, kind in arguments.items())
    returned = "double" if lines[-1].startswith("  ret double") else "void"
    return "\n".join([f"define {returned} @{name}({stated}) {{", *lines, "}\n"])


def _is_zero(value: Scalar) -> bool:
    return bool((value.constant if isinstance(value, Symbol) else value) == 0)


class MachineCode:
    """Compiled functions, which live as long as this object.

    Parameters
    ----------
    text
        Functions as `law_function` and `function_text` write them.
    """

    def __init__(self, text: str) -> None:
        module = llvm.parse_assembly(declarations() + text)
        module.verify()
        self._engine = llvm.create_mcjit_compiler(module, _target().create_target_machine(**_host()))
        self._engine.finalize_object()

    def address(self, name: str) -> int:
        """Where a function begins."""
        return int(self._engine.get_function_address(name))


@cache
def _target() -> llvm.Target:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple()


def _host() -> dict[str, object]:
    features = llvm.get_host_cpu_features().flatten()
    return {"cpu": llvm.get_host_cpu_name(), "features": features, "opt": 2, "codemodel": "jitdefault"}
