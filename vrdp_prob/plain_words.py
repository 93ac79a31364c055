"""Numbers and lists in the words of a sentence."""

import math
from collections.abc import Iterable


def several(count: int, noun: str) -> str:
    """A number in digits with its noun: '1 video', '12 videos'."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def listed(items: Iterable[str]) -> str:
    """Items as a list in a sentence: 'a', 'a and b', 'a, b and c'."""
    parts = list(items)
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}" if parts else "none"


def counted(count: int, noun: str) -> str:
    """A small number in words with its noun: 'two objects', 'one object', 'no objects', '14 questions'."""
    return f"{number_word(count)} {noun}{'s' * (count != 1)}"


def number_word(count: int) -> str:
    """A small number as a word, a larger one in digits."""
    words = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
    return words[count] if count < len(words) else str(count)


def sentence(text: str) -> str:
    """A text with a capital letter at its start."""
    return text[:1].upper() + text[1:]


def percent(probability: float, error: float = 0.0) -> str:
    """A probability in per cent; certain only where it is, and its Monte Carlo error is nothing.

    A share of (nearly) no or all draws is given as a bound three errors away, which for 30 draws is 93 %, not 99 %.
    """
    if probability in (0, 1) and error == 0:
        return f"{100 * probability:.0f} %"
    bound = min(max(1, math.ceil(300 * error)), 99)
    if probability <= 0.005:
        return f"< {bound} %"
    return f"> {100 - bound} %" if probability >= 0.995 else f"{100 * probability:.0f} %"


def percent_error(probability: float, error: float) -> str:
    """A Monte Carlo error in percentage points; empty where it is too small to tell or the probability is extreme."""
    if error < 0.0005 or not 0.005 < probability < 0.995:
        return ""
    return f"± {100 * error:.1f}" if error < 0.0095 else f"± {100 * error:.0f}"
