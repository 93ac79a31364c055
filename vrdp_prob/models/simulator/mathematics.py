"""The functions a physical law may call: on numbers, on tensors, and on the symbols that record the law."""

import math

import torch

from vrdp_prob.models.simulator.formula import Scalar, Symbol


def _apply(operation: str, *operands: Scalar) -> Scalar:
    for operand in operands:
        if isinstance(operand, Symbol):
            return operand.recorder.step(operation, *operands)
    if not any(isinstance(operand, torch.Tensor) for operand in operands):
        return (
            {"min": min, "max": max, "abs": abs}[operation](*operands)
            if operation in _PLAIN
            else getattr(math, operation)(*operands)
        )
    tensors = [torch.as_tensor(operand, dtype=torch.float64) for operand in operands]
    return getattr(torch, _TORCH_NAMES.get(operation, operation))(*tensors)


_PLAIN = ("min", "max", "abs")
_TORCH_NAMES = {"min": "minimum", "max": "maximum"}


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
