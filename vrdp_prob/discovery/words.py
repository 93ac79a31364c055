"""Names, numbers and directions in sentences."""

import math

NEAR_AXIS = math.radians(10.0)
"""Angle to an axis below which a direction is called by it."""


def title(name: str) -> str:
    """Name of a cause or parameter as words."""
    return name.replace("_", " ")


def number(value: float) -> str:
    """A number of two figures."""
    if value == 0 or not math.isfinite(value):
        return f"{value:g}"
    digits = max(0, 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}" if 1e-4 <= abs(value) < 1e5 else f"{value:.1e}"


def by(value: float, unit: str) -> str:
    """A change with its sign and unit."""
    return f"{'+' if value >= 0 else '-'}{number(abs(value))} {unit}"


def opposite(value: float, negative: str, positive: str) -> str:
    """One of two words by a sign."""
    return negative if value < 0 else positive


def direction_words(x: float, y: float) -> str:
    """A direction of the plane."""
    angle = math.atan2(y, x)
    for name, axis in (("+x", 0.0), ("+y", math.pi / 2), ("-x", math.pi), ("-x", -math.pi), ("-y", -math.pi / 2)):
        if abs(angle - axis) < NEAR_AXIS:
            return name
    return f"{math.degrees(angle):.0f} degrees (counter-clockwise from +x)"
