"""evaluation.json and evaluation.html: written whole or not at all."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from vrdp_prob.evaluation.evaluate import GROUPS, Evaluation
from vrdp_prob.evaluation.one_scene import VARIANTS
from vrdp_prob.evaluation.page import absence, render
from vrdp_prob.evaluation.scores import COVERAGES, Interval
from vrdp_prob.files import write_atomically
from vrdp_prob.plain_words import several


def to_document(evaluation: Evaluation) -> dict[str, Any]:
    """The evaluation as in evaluation.schema.json, with what the schema leaves open."""
    return {
        **{
            variant: {group: asdict(scores) for group, scores in of_variant.items()}
            for variant, of_variant in evaluation.scores.items()
        },
        "brier_gain_over_map": {group: _gain(found) for group, found in evaluation.gains.items()},
        "abstention_coverages": [round(float(share), 3) for share in COVERAGES],
        "scenes": len(evaluation.results),
        "absent": evaluation.absent,
        "failed": [{"scene": result.scene, "reason": result.failed} for result in evaluation.failed],
        "seconds_per_video": evaluation.seconds_per_video,
    }


def write_evaluation(evaluation: Evaluation, directory: Path) -> tuple[Path, Path]:
    """Write evaluation.json and evaluation.html into a folder; gives their paths, the page first.

    Raises
    ------
    InputError
        If the folder cannot be made or written.
    """
    page, document = directory / "evaluation.html", directory / "evaluation.json"
    html = render(evaluation)
    text = json.dumps(to_document(evaluation), indent=1, allow_nan=False) + "\n"
    with write_atomically(page) as new_page, write_atomically(document) as new_document:
        new_page.write_text(html, encoding="utf-8")
        new_document.write_text(text, encoding="utf-8")
    return page, document


def table(evaluation: Evaluation) -> list[str]:
    """The scores as lines of text."""
    lines = [f"{'':26}questions  right, per question  per option   Brier      map    ECE  calibrated if below"]
    for group in GROUPS:
        ours, map_scores = (evaluation.scores[variant][group] for variant in (VARIANTS[0], VARIANTS[-1]))
        if not ours.questions:
            continue
        lines.append(
            f"{group:26}{ours.questions:9d}{_percent(ours.accuracy_per_question):>21}"
            f"{_percent(ours.accuracy_per_option):>12}{ours.brier or 0.0:8.3f}{map_scores.brier or 0.0:9.3f}"
            f"{ours.ece or 0.0:7.3f}{ours.ece_if_calibrated_q95 or 0.0:21.3f}"
        )
    each = "" if len(evaluation.results) == 1 else " each"
    lines.append(f"{several(len(evaluation.results), 'video')}, {evaluation.seconds_per_video:.1f} s{each}")
    lines += [f"{result.scene} failed: {result.failed}" for result in evaluation.failed]
    if evaluation.absent:
        lines.append(absence(evaluation.absent))
    return lines


def _gain(found: tuple[float, Interval | None] | None) -> dict[str, float | None] | None:
    if found is None:
        return None
    gain, interval = found
    low, high = (None, None) if interval is None else (interval.low, interval.high)
    return {"gain": gain, "low": low, "high": high}


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.1f} %"
