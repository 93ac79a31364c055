"""report.json: the report for programs."""

import json
import math
from importlib import resources
from typing import Any, Literal

from vrdp_prob.report.content import AnswerContent, Interval, PairContent, ParameterContent, ReportContent


def schema(name: Literal["report", "finding", "evaluation"]) -> dict[str, Any]:
    """JSON Schema of one of the documents that the commands write."""
    file = resources.files("vrdp_prob.report") / "schemas" / f"{name}.schema.json"
    document: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return document


def to_document(content: ReportContent) -> dict[str, Any]:
    """The report as strict JSON values that follow the schema `report`; answers in the order asked."""
    convergence = content.convergence
    return {
        "video": content.tracks.video,
        "seed": content.seed,
        "version": content.version,
        "model": {"name": content.model, "effects": list(content.effects)},
        "objects": [
            {
                "id": item.body.id,
                "shape": str(item.body.shape),
                "color": item.body.color,
                "material": item.body.material,
                "mass": _parameter(item.mass),
                "restitution": _parameter(item.restitution),
            }
            for item in content.bodies
        ],
        "mass_ratios": [_pair(pair) for pair in content.mass_ratios],
        "restitution_pairs": [_pair(pair) for pair in content.restitution_pairs],
        "convergence": {
            "sampler": convergence.sampler,
            "converged": convergence.converged,
            "r_hat": _finite(convergence.r_hat),
            "ess_bulk": _finite(convergence.ess_bulk),
            "divergences": convergence.divergences,
            "pareto_k": _finite(convergence.pareto_k),
        },
        "answers": [_answer(answer) for answer in content.answers],
        "warnings": list(content.warnings),
    }


def _interval(interval: Interval) -> dict[str, float]:
    return {"mean": interval.mean, "sd": interval.sd, "q05": interval.q05, "q95": interval.q95}


def _parameter(parameter: ParameterContent) -> dict[str, Any]:
    return {**_interval(parameter.interval), "status": parameter.status, "with": list(parameter.partners)}


def _pair(pair: PairContent) -> dict[str, Any]:
    return {"objects": list(pair.objects), **_interval(pair.interval)}


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _answer(answer: AnswerContent) -> dict[str, Any]:
    return {
        "question_id": answer.question_id,
        "question": answer.question,
        "question_type": str(answer.question_type),
        "answer": list(answer.answer) if isinstance(answer.answer, tuple) else answer.answer,
        "probability": answer.probability,
        "mc_error": answer.mc_error,
        "entropy": answer.entropy,
        "distribution": dict(answer.distribution),
        "choices": [
            {
                "choice_id": choice.choice_id,
                "choice": choice.choice,
                "probability": choice.probability,
                "mc_error": choice.mc_error,
            }
            for choice in answer.choices
        ],
        "relies_on_default": list(answer.relies_on_default),
        "notes": list(answer.notes),
    }
