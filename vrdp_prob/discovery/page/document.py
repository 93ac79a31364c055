"""finding.json, finding.html and model.toml: written all three or none."""

import json
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from vrdp_prob.discovery.finding import Check, ComparedAnswer, Finding, FoundCause, Gain, TriedCause, UpperBound
from vrdp_prob.discovery.page.finding_page import render
from vrdp_prob.discovery.page.summary import verdict_sentence
from vrdp_prob.files import write_atomically
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.version import __version__


class FindingFiles(NamedTuple):
    """Where a finding was written."""

    page: Path
    document: Path
    model: Path

    @classmethod
    def of(cls, directory: Path) -> "FindingFiles":
        """The files of a folder."""
        return cls(directory / "finding.html", directory / "finding.json", directory / "model.toml")


def to_document(finding: Finding, *, model: Path | None = None) -> dict[str, Any]:
    """The finding as strict JSON values that follow the schema `finding`, with all that the page shows.

    Parameters
    ----------
    finding
        What was found.
    model
        Where the extended model is written; None where it is not.
    """
    document = {
        "verdict": str(finding.verdict),
        "sentence": verdict_sentence(finding),
        "causes": [_cause(cause) for cause in finding.causes],
        "gain": None if finding.gain is None else _gain(finding.gain),
        "predicted": None if finding.predicted is None else {**asdict(finding.predicted), "noise_sd": finding.noise},
        "tried": [_of_effect(one) for one in finding.tried],
        "evidence": _evidence(finding.checks),
        "evidence_after": _evidence(finding.checks_after),
        "upper_bounds": [_of_effect(bound) for bound in finding.upper_bounds],
        "answers": None if finding.answers is None else [_answer(answer) for answer in finding.answers],
        "description": None if finding.description is None else asdict(finding.description),
        "model": None if model is None else str(model.absolute()),
        "base_model": _model(finding.model),
        "extended_model": {**_model(finding.extended), "toml": finding.extended.text},
        "videos": list(finding.videos),
        "notes": list(finding.notes),
        "version": __version__,
    }
    return {key: _strict(value) for key, value in document.items()}


def write_finding(finding: Finding, directory: Path | str) -> FindingFiles:
    """Write finding.html, finding.json and model.toml into a folder, which is made where it is missing.

    Parameters
    ----------
    finding
        What was found.
    directory
        The folder.

    Raises
    ------
    InputError
        If the folder cannot be made or written.
    """
    files = FindingFiles.of(Path(directory))
    texts = (
        render(finding),
        json.dumps(to_document(finding, model=files.model), indent=1, allow_nan=False) + "\n",
        finding.extended.text,
    )
    with (
        write_atomically(files.page) as page,
        write_atomically(files.document) as document,
        write_atomically(files.model) as model,
    ):
        for file, text in zip((page, document, model), texts, strict=True):
            file.write_text(text, encoding="utf-8")
    return files


def _cause(cause: FoundCause) -> dict[str, Any]:
    return {
        "name": cause.name,
        "effect": cause.effect,
        "probability": cause.probability,
        "named": cause.named,
        "sentence": cause.sentence,
        "parameters": {name: asdict(estimate) for name, estimate in cause.parameters.items()},
        "held_out_gain": _gain(cause.gain),
    }


def _of_effect(told: UpperBound | TriedCause) -> dict[str, Any]:
    """What is told of a cause, with the effect as which it acts."""
    facts = asdict(told)
    return {"name": facts.pop("name"), "effect": facts.pop("way") or told.name, **facts}


def _gain(gain: Gain) -> dict[str, Any]:
    """A gain. Where the schema wants a number, an infinite one is the largest there is, and an unknown one no gain."""
    return {
        "rmse_before": _finite(gain.before.rmse, math.inf),
        "rmse_after": _finite(gain.after.rmse, math.inf),
        "unit": "m",
        "elpd_difference": _finite(gain.elpd_difference, 0.0),
        "elpd_se": _finite(gain.elpd_se, math.inf),
        "noise_sd": gain.noise,
        "before": asdict(gain.before),
        "after": asdict(gain.after),
        "error_ratios": {name: asdict(ratio) for name, ratio in gain.error_ratios.items()},
        "elpd_difference_by_video": dict(gain.by_video),
    }


def _answer(answer: ComparedAnswer) -> dict[str, Any]:
    return {**asdict(answer), "differs": answer.differs}


def _evidence(checks: Sequence[Check]) -> list[dict[str, Any]]:
    return [
        {
            "check": check.name,
            "p_value": check.p_value,
            "significant": check.significant,
            "statistic": check.statistic,
            "sentence": check.sentence,
            "rival": check.rival or None,
        }
        for check in checks
    ]


def _model(model: PhysicsModel) -> dict[str, Any]:
    return {"name": model.name, "effects": [effect.name for effect in model.effects]}


def _finite(value: float, where_unknown: float) -> float:
    known = where_unknown if math.isnan(value) else value
    return min(max(known, -sys.float_info.max), sys.float_info.max)


def _strict(value: Any) -> Any:
    """Strict JSON values: numbers that are not finite become null."""
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _strict(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_strict(inner) for inner in value]
    return value
