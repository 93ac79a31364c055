"""Scores of answers as cells of a table; empty where there is no score."""

from vrdp_prob.evaluation.scores import Interval


def number(value: float | None) -> str:
    """A score with four decimal places."""
    return "" if value is None else f"{value:.4f}"


def percent(value: float | None) -> str:
    """A share."""
    return "" if value is None else f"{100 * value:.1f} %"


def gain(value: float, interval: Interval | None) -> str:
    """By how much a score is better, with its interval where there is one."""
    return number(value) + ("" if interval is None else f" ({number(interval.low)} to {number(interval.high)})")
