"""Table, figure and checks of the learned words."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from _page import write_between
from _resumable import Result

from vrdp_prob.concepts.physical import LearnedWord

COUNTS = (1, 2, 5, 10, 25)
UNCHANGED = "unchanged"
TRUTH = {"heavier": ("mass", 5.0), "lighter": ("mass", 0.2), UNCHANGED: ("nothing", None)}
"""What each word really changes, and by which factor."""
LEAST_PROBABILITY, LARGEST_LOSS = 0.95, 0.02

Check = dict[str, object]
Words = Mapping[str, Sequence[LearnedWord]]


def accuracy(asked: Sequence[Result], word: str, meaning: str) -> tuple[float, float] | None:
    """Share of choices judged rightly, and their Brier score; None where nothing was asked."""
    choices = np.array([choice for one in asked for choice in one["answers"][word].get(meaning, ())], dtype=float)
    if not len(choices):
        return None
    probability, right = choices.T
    return float(((probability > 0.5) == right).mean()), float(((probability - right) ** 2).mean())


def table(words: Words, asked: Sequence[Result]) -> str:
    """What is believed of each word after so many videos, and how the other videos' questions are answered with it."""
    lines = [
        "| word | videos | answers | nothing | mass | restitution | friction | speed | factor of the mass: median, "
        "90 % | guessed answers | accuracy per option | Brier |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for word, several in words.items():
        if word in TRUTH and word != UNCHANGED and (known := accuracy(asked, word, "built-in")):
            lines.append(f"| {word}, built in | | | | | | | | {TRUTH[word][1]} | | {known[0]:.3f} | {known[1]:.4f} |")
        lines += [_row(word, one, asked) for one in several]
    return "\n".join(lines)


def _row(word: str, learned: LearnedWord, asked: Sequence[Result]) -> str:
    shares = " | ".join(
        f"{learned.probabilities[name]:.3f}" for name in ("nothing", "mass", "restitution", "friction", "speed")
    )
    mass = _mass(learned)
    low, high = mass.interval()
    found = None if word == UNCHANGED else accuracy(asked, word, str(learned.evidence.videos))
    judged = "| |" if found is None else f"| {found[0]:.3f} | {found[1]:.4f} |"
    return (
        f"| {word} | {learned.evidence.videos} | {learned.evidence.answers} | {shares} | "
        f"{mass.quantile(0.5):.3g}, {low:.3g} to {high:.3g} | {100 * learned.lapse.mean:.0f} % {judged}"
    )


def _mass(learned: LearnedWord) -> Any:
    (belief,) = (belief for belief in learned.beliefs if belief.name == "mass factor")
    return belief


def checks(words: Words, asked: Sequence[Result]) -> list[Check]:
    """The goals, for the words learned from all videos that teach."""
    found: list[Check] = []
    for word, (parameter, factor) in TRUTH.items():
        last = words[word][-1] if words.get(word) else None
        probability = None if last is None else last.probabilities[parameter]
        found.append(_check(f"{word}: probability of {parameter}", probability, LEAST_PROBABILITY))
        if factor is None:
            continue
        low, high = (np.nan, np.nan) if last is None else _mass(last).interval()
        inside = None if last is None else float(low <= factor <= high)
        found.append(_check(f"{word}: {factor:g} in the 90 % interval of the factor", inside, 1.0))
        own = None if last is None else accuracy(asked, word, str(last.evidence.videos))
        known = accuracy(asked, word, "built-in")
        gain = None if own is None or known is None else own[0] - known[0]
        found.append(_check(f"{word}: accuracy per option, learned less built-in", gain, -LARGEST_LOSS))
    return found


def _check(name: str, value: float | None, goal: float) -> Check:
    return {"name": name, "value": value, "goal": goal, "ok": value is not None and value >= goal}


def page(text: str, path: Path) -> None:
    """Write the table into the page."""
    write_between(path, text)


def figure(words: Mapping[str, Mapping[int, Sequence[LearnedWord]]], path: Path) -> None:
    """Probability of what each word really changes, and the factor, against the number of videos."""
    import matplotlib.pyplot as plt  # noqa: PLC0415 - only the figure needs it

    drawing, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6))
    for (word, by_count), colour in zip(words.items(), ("C0", "C1", "C2"), strict=True):
        parameter, factor = TRUTH[word]
        found = np.array(list(by_count))
        shares = np.array([[one.probabilities[parameter] for one in several] for several in by_count.values()])
        _band(left, found, shares, colour, f"'{word}': {parameter}")
        if factor is not None:
            ends = [np.median([_mass(one).interval() for one in several], axis=0) for several in by_count.values()]
            middle = [np.median([_mass(one).quantile(0.5) for one in several]) for several in by_count.values()]
            right.fill_between(found, *np.transpose(ends), color=colour, alpha=0.25, lw=0)
            right.plot(found, middle, color=colour, marker="o", label=f"'{word}'")
            right.axhline(factor, color=colour, ls=":")
    left.set(xlabel="videos", ylabel="posterior probability of what it changes", ylim=(0, 1.02))
    right.set(xlabel="videos", ylabel="factor of the mass", yscale="log")
    right.set_yticks([0.1, 0.2, 0.5, 1, 2, 5, 10], ["0.1", "0.2", "0.5", "1", "2", "5", "10"])
    for axes in (left, right):
        axes.set_xscale("log")
        axes.set_xticks(COUNTS, [str(count) for count in COUNTS])
        axes.minorticks_off()
        axes.legend(frameon=False)
    drawing.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    drawing.savefig(path)
    plt.close(drawing)


def _band(axes: Any, places: np.ndarray, values: np.ndarray, colour: str, label: str) -> None:
    """Median and central 80 % over random orders."""
    low, middle, high = np.quantile(values, [0.1, 0.5, 0.9], axis=1)
    axes.fill_between(places, low, high, color=colour, alpha=0.25, lw=0)
    axes.plot(places, middle, color=colour, marker="o", label=label)
