"""Table, figure and page of what learned concepts reach."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from _concepts_scores import ATTRIBUTES, Score
from _page import write_between

FIGURE = "concepts-videos.svg"
COLUMNS = (*ATTRIBUTES, "moving", "descriptive", "explanatory")


def table(scores: Mapping[str, Score]) -> str:
    """One row for each variant."""
    head = ["", *COLUMNS, "Brier score"]
    rows = [
        [name, *(_percent(score.share(column)) for column in COLUMNS), f"{score.brier:.3f}"]
        for name, score in scores.items()
    ]
    return "\n".join("| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows])


def write_page(page: Path, scores: Mapping[str, Score], note: str) -> None:
    """Put the table, and the figure that `draw` drew, between the marks of a page."""
    picture = f"![Accuracy against the number of videos that concepts were learned from](figures/{FIGURE})"
    write_between(page, "\n\n".join([note, table(scores), picture]))


def draw(path: Path, sizes: Sequence[int], learned: Sequence[Score], alone: Sequence[Score], rules: Score) -> None:
    """Accuracy against the number of training videos."""
    import matplotlib as mpl  # noqa: PLC0415 (only the figure needs it)

    mpl.use("svg")
    import matplotlib.pyplot as plt  # noqa: PLC0415 (after the backend is chosen)

    plt.rcParams["svg.hashsalt"] = "concepts"
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True, layout="constrained")
    for name, marker, color in zip(ATTRIBUTES, "os^", ("C0", "C1", "C2"), strict=True):
        left.plot(sizes, [100 * score.share(name) for score in learned], marker=marker, color=color, label=name)
        left.axhline(100 * rules.share(name), color=color, linewidth=0.8, linestyle="--")
    left.plot(sizes, [100 * score.share("moving") for score in alone], "v:", color="C3", label="moving, learned events")
    left.axhline(100 * rules.share("moving"), color="C3", linewidth=0.8, linestyle="--")
    for name, color in (("descriptive", "C0"), ("explanatory", "C1")):
        right.plot(sizes, [100 * score.share(name) for score in learned], marker="o", color=color, label=name)
        right.plot(
            sizes, [100 * score.share(name) for score in alone], "x:", color=color, label=f"{name}, learned events"
        )
        right.axhline(100 * rules.share(name), color=color, linewidth=0.8, linestyle="--")
    for axes, title in ((left, "concepts (dashed: rules)"), (right, "questions (dashed: rules)")):
        axes.set_xscale("log", base=2)
        axes.set_xticks(sizes, [str(size) for size in sizes])
        axes.set_xlabel("videos learned from")
        axes.set_title(title, fontsize=10)
        axes.legend(fontsize=8, frameon=False)
        axes.grid(alpha=0.3)
    left.set_ylabel("right, %")
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
