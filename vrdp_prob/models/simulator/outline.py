"""Outlines that the simulator knows."""

from enum import IntEnum


class Outline(IntEnum):
    """What meets what; the numbers are those of the compiled kernels."""

    DISC = 0
    SQUARE = 1
    WALL = 2
