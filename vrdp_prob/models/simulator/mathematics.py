"""The functions a physical law may call: on numbers, on tensors, and on the symbols that record the law."""

import math
from collections.abc import Callable

import torch

from vrdp_prob.models.simulator.formula import Scalar, Symbol

_ON_NUMBERS: dict[str, Callable[..., Scalar]] = {
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "atan2": math.atan2,
    "exp": math.exp,
    "log": math.log,
    "tanh": math.tanh,
    "abs": abs,
    "min": min,
    "max": max,
}
_ON_TENSORS: dict[str, Callable[..., Scalar]] = {
    "sqrt": torch.sqrt,
    "sin": torch.sin,
    "cos": torch.cos,
    "atan2": torch.atan2,
    "exp": torch.exp,
    "log": torch.log,
    "tanh": torch.tanh,
    "abs": torch.abs,
    "min": torch.minimum,
    "max": torch.maximum,
}


def _apply(operation: str, *operands: Scalar) -> Scalar:
    for operand in operands:
        if isinstance(operand, Symbol):
            return operand.recorder.step(operation, *operands)
    if any(isinstance(operand, torch.Tensor) for operand in operands):
        return _ON_TENSORS[operation](*(torch.as_tensor(operand) for operand in operands))
    return _ON_NUMBERS[operation](*operands)


def sqrt(x: Scalar) -> Scalar:
    """Square root."""
    return _apply("sqrt", x)


def sin(x: Scalar) -> Scalar:
    """Sine of an angle in rad."""
    return _apply("sin", x)


def cos(x: Scalar) -> Scalar:
    """Cosine of an angle in rad."""
    return _apply("cos", x)


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Angle in rad of the vector (x, y)."""
    return _apply("atan2", y, x)


def exp(x: Scalar) -> Scalar:
    """Exponential."""
    return _apply("exp", x)


def log(x: Scalar) -> Scalar:
    """Natural logarithm."""
    return _apply("log", x)


def tanh(x: Scalar) -> Scalar:
    """Hyperbolic tangent."""
    return _apply("tanh", x)


def absolute(x: Scalar) -> Scalar:
    """Absolute value."""
    return _apply("abs", x)


def minimum(a: Scalar, b: Scalar) -> Scalar:
    """The smaller of two numbers."""
    return _apply("min", a, b)


def maximum(a: Scalar, b: Scalar) -> Scalar:
    """The larger of two numbers."""
    return _apply("max", a, b)


def where(condition: Scalar, a: Scalar, b: Scalar) -> Scalar:
    """`a` where the condition holds, else `b`; both are computed, so both must be finite."""
    for operand in (condition, a, b):
        if isinstance(operand, Symbol):
            return operand.recorder.step("where", condition, a, b)
    if isinstance(condition, torch.Tensor):
        return torch.where(condition, a, b)
    return a if condition else b


def length(x: Scalar, y: Scalar) -> Scalar:
    """Length of the vector (x, y); its derivative is 0 where the vector is."""
    return sqrt(x * x + y * y + SMALLEST_SQUARE)


SMALLEST_SQUARE = 1e-100
"""Added under a square root so that the length of the zero vector has a derivative."""
