"""evaluation.html: scores, reliability diagrams, abstention curves and every wrong answer, on one page."""

from typing import Any

from vrdp_prob.evaluation.evaluate import GROUPS, Evaluation
from vrdp_prob.evaluation.judgement import Judgement
from vrdp_prob.evaluation.one_scene import BEST_FIT, POSTERIOR, PRIOR_DEFAULTS
from vrdp_prob.evaluation.scores import COVERAGES, Bin, Interval, Scores
from vrdp_prob.plain_words import several
from vrdp_prob.report.templating import asset, environment

TITLES = {
    "descriptive": "Descriptive",
    "explanatory": "Explanatory",
    "predictive": "Predictive",
    "counterfactual": "Counterfactual, all",
    "counterfactual_removal": "Counterfactual, object removed",
    "counterfactual_mass": "Counterfactual, heavier or lighter",
    "counterfactual_word": "Counterfactual, a learned word",
}
SIDE = 150.0
"""Width and height of a diagram in pixels."""


def render(evaluation: Evaluation) -> str:
    """The page as HTML text."""
    asked = [group for group in GROUPS if evaluation.scores[POSTERIOR][group].questions]
    wrong = sorted((one for one in evaluation.judgements() if not one.right), key=lambda one: -one.confidence)
    return (
        environment("vrdp_prob.evaluation")
        .get_template("evaluation.html.j2")
        .render(
            css=asset("page.css"),
            videos=several(len(evaluation.results), "video"),
            alone=len(evaluation.results) == 1,
            seconds=f"{evaluation.seconds_per_video:.1f}",
            questions=several(len(evaluation.judgements()), "question"),
            absent=absence(evaluation.absent) if evaluation.absent else "",
            failed=[{"scene": result.scene, "reason": result.failed} for result in evaluation.failed],
            unconverged=sum("has not converged" in result.convergence for result in evaluation.results),
            groups=[_group(evaluation, group) for group in asked],
            diagrams=[_diagrams(evaluation, group) for group in asked if group != "counterfactual"],
            side=SIDE,
            wrong=[_wrong(one) for one in wrong],
        )
    )


def absence(count: int) -> str:
    """That some videos are asked about and not there, in a sentence."""
    return f"{several(count, 'video')} of the question file {'is' if count == 1 else 'are'} not in the folder."


def _group(evaluation: Evaluation, group: str) -> dict[str, Any]:
    ours, prior, best = (evaluation.scores[variant][group] for variant in (POSTERIOR, PRIOR_DEFAULTS, BEST_FIT))
    gain = evaluation.gains[group]
    return {
        "title": TITLES[group],
        "questions": ours.questions,
        "options": ours.options or "",
        "per_question": _share(ours, "accuracy_per_question"),
        "per_option": _share(ours, "accuracy_per_option"),
        "brier": _number(ours.brier),
        "brier_prior": _number(prior.brier),
        "brier_map": _number(best.brier),
        "gain": "" if gain is None else _gain(*gain),
        "gain_is_sure": gain is not None and gain[1] is not None and gain[1].low > 0,
        "log_score": _number(ours.log_score),
        "ece": _number(ours.ece),
        "ece_q95": _number(ours.ece_if_calibrated_q95),
        "calibrated": (ours.ece or 0.0) <= (ours.ece_if_calibrated_q95 or 0.0),
        "map_per_question": _percent(best.accuracy_per_question),
    }


def _share(scores: Scores, name: str) -> str:
    value: float | None = getattr(scores, name)
    interval: Interval | None = scores.intervals.get(name)
    if value is None:
        return ""
    return _percent(value) + ("" if interval is None else f" ({100 * interval.low:.0f} to {100 * interval.high:.0f})")


def _gain(gain: float, interval: Interval | None) -> str:
    return f"{gain:+.3f}" + ("" if interval is None else f" ({interval.low:+.3f} to {interval.high:+.3f})")


def _percent(value: float | None) -> str:
    return "" if value is None else f"{100 * value:.1f} %"


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _diagrams(evaluation: Evaluation, group: str) -> dict[str, Any]:
    ours = evaluation.scores[POSTERIOR][group]
    most = max(one.count for one in ours.reliability)
    best = evaluation.scores[BEST_FIT][group].accuracy_per_question or 0.0
    curve = [(SIDE * float(share), _height(right)) for share, right in zip(COVERAGES, ours.abstention, strict=True)]
    return {
        "title": TITLES[group],
        "bins": [_bin(one, most) for one in ours.reliability],
        "curve": " ".join(f"{x:.1f},{y:.1f}" for x, y in curve),
        "ends": curve[-1],
        "best": _height(best),
        "words": "; ".join(
            f"of {one.count} around {one.forecast:.2f}, {one.observed:.2f} were so" for one in ours.reliability
        ),
    }


def _bin(one: Bin, most: int) -> dict[str, Any]:
    return {
        "x": SIDE * one.forecast,
        "y": _height(one.observed),
        "low": _height(one.low),
        "high": _height(one.high),
        "radius": 2.5 + 5 * (one.count / most) ** 0.5,
        "count": one.count,
        "outside": not one.low <= one.observed <= one.high,
    }


def _height(share: float) -> float:
    return SIDE * (1 - share)


def _wrong(one: Judgement) -> dict[str, Any]:
    return {
        "scene": one.scene,
        "id": one.question_id,
        "question": one.question,
        "answer": [one.refused] if one.refused is not None else _told(one, one.answer),
        "truth": _told(one, one.truth),
        "confidence": f"{one.confidence:.2f}",
        "probability": f"{one.probability:.2f}",
    }


def _told(one: Judgement, answer: str) -> list[str]:
    """An answer as lines: of choices each with its id and text."""
    if not one.texts:
        return [answer or "none of the choices"]
    chosen = answer.split(",")
    return [f"{name}: {text}" for name, text in one.texts if name in chosen] or ["none of the choices"]
