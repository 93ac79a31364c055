"""report.json: the report for programs."""

import json
import math
from dataclasses import asdict
from importlib import resources
from typing import Any, Literal

from vrdp_prob.inference.search.misfit import Misfit
from vrdp_prob.report.content import ReportContent


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
                "id": body.id,
                "shape": str(body.shape),
                "color": body.color,
                "material": body.material,
                "attribute_probabilities": {
                    name: dict(values) for name, values in body.attribute_probabilities.items()
                },
                "mass": learned.mass.to_document(),
                "restitution": learned.restitution.to_document(),
            }
            for body, learned in zip(content.tracks.bodies, content.objects, strict=True)
        ],
        "mass_ratios": [pair.to_document() for pair in content.mass_ratios],
        "restitution_pairs": [pair.to_document() for pair in content.restitution_pairs],
        "convergence": {
            "sampler": convergence.sampler,
            "converged": convergence.converged,
            "r_hat": _finite(convergence.r_hat),
            "ess_bulk": _finite(convergence.ess_bulk),
            "divergences": convergence.divergences,
            "pareto_k": _finite(convergence.pareto_k),
            "ess_tail": _finite(convergence.ess_tail),
            "worst": convergence.worst,
        },
        "misfit": None if content.misfit is None else _misfit(content.misfit),
        "collision_groups": [asdict(group) for group in content.groups],
        "prior_sensitivity": [one.to_document() for one in content.sensitivities],
        "answers": [item.to_document() for item in content.answers],
        "warnings": list(content.warnings),
    }


def _misfit(misfit: Misfit) -> dict[str, Any]:
    return {**asdict(misfit), "chi_square": misfit.chi_square, "fits": misfit.fits}


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
