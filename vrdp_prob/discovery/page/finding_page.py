"""finding.html: what was found, what it is worth, and what could have hidden, on one page that opens from disk."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from markupsafe import Markup

from vrdp_prob.datasets.folder import some
from vrdp_prob.discovery.finding import (
    Check,
    Description,
    Estimate,
    Finding,
    FoundCause,
    Gain,
    HeldOut,
    UpperBound,
    Verdict,
)
from vrdp_prob.discovery.page.changed_answers import rows
from vrdp_prob.discovery.page.gain_figure import STRETCHES, error_figure, video_figure
from vrdp_prob.discovery.page.summary import POSSIBLE, possible, summary, verdict_sentence
from vrdp_prob.discovery.page.wording import (
    UNDEFINED,
    bound_words,
    cause_title,
    chance,
    difference_words,
    effect_of,
    estimate_words,
    leading_and_own,
    length_unit,
    number,
    own_words,
    p_words,
    parameter_words,
    ratio_words,
    told_gains,
    tried_words,
    typeset,
    with_unit,
)
from vrdp_prob.discovery.selection.forecast import TENTHS
from vrdp_prob.discovery.words import title
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.plain_words import counted, listed, sentence
from vrdp_prob.report.templating import asset, environment
from vrdp_prob.version import __version__

ALIKE = (
    "These leave nearly the same traces in such videos. Their probabilities say how well the videos tell them apart; "
    "other starts, speeds or places would tell more."
)
ASKED_LATER = "Only with the named causes is enough known to ask this."
EVEN_BAR = 30.0
"""Height of bars of equal shares, in per cent of the room for them."""
NOT_EXCLUDED = "The likeliest causes of the catalogue. None of them explains the videos well enough to be named."


def render(finding: Finding) -> str:
    """The page as HTML text; the same finding gives the same text."""
    named, gains = finding.named, told_gains(finding)
    strengths = [one for one in finding.upper_bounds if one.measure is None]
    values = {
        "css": asset("page.css"),
        "verdict": typeset(verdict_sentence(finding)),
        "summary": [typeset(one) for one in summary(finding)],
        "notes": [typeset(note) for note in finding.notes],
        "video_count": counted(len(finding.videos), "video"),
        "errors": error_figure(gains) if gains else None,
        "description": None if finding.description is None else _description(finding.description),
        "causes": [{**_cause(cause, finding), "videos": video_figure(cause.gain)} for cause in named],
        "answers": None if finding.answers is None else rows(finding.answers),
        **_others(finding),
        "tried": _tried(finding),
        "coverage": _coverage(gains),
        "predicted": None if named or finding.predicted is None else _predicted(finding.predicted, finding.noise),
        "ratios": _ratios(gains),
        "stretches": list(STRETCHES.values()),
        "even": EVEN_BAR,
        "even_tenths": [EVEN_BAR] * TENTHS,
        "checks": _checks(finding),
        "figures": [(name, _inline(figure, index)) for index, (name, figure) in enumerate(finding.figures.items())],
        "bounds": _bounds(finding),
        "unbounded": finding.verdict is Verdict.UNKNOWN and {one.bound for one in strengths} == {None},
        "bounds_lead": finding.verdict is Verdict.NONE and bool(finding.upper_bounds),
        **_model(finding),
    }
    return environment("vrdp_prob.discovery.page").get_template("finding.html.j2").render(values)


def _cause(cause: FoundCause, finding: Finding) -> dict[str, Any]:
    effect = effect_of(cause.effect, finding.extended)
    leading, own = leading_and_own(cause, effect)
    said = chance(cause.probability)
    return {
        "title": cause_title(cause),
        "sentence": typeset(cause.sentence),
        "chance": said,
        "bar": {
            "probability": round(cause.probability, 6),
            "place": round(100 * cause.probability, 2),
            "error_low": 0,
            "error_high": 0,
            "chosen": cause.named,
            "label": f"{cause_title(cause)}: {said}",
        },
        "parameters": _estimates(leading, effect),
        "own": _estimates(own, effect),
        "own_words": sentence(own_words(own, effect)),
        "law": effect.law if effect is not None else "",
        "source": effect.source if effect is not None else "",
        "difference": difference_words(cause.gain),
    }


def _estimates(estimates: Mapping[str, Estimate], effect: Effect | type[Effect] | None) -> list[dict[str, str]]:
    """Rows of a table of estimates."""
    return [
        {
            "name": name,
            "words": sentence(parameter_words(name, effect)),
            **dict(zip(("mean", "interval"), estimate_words(estimate), strict=True)),
        }
        for name, estimate in estimates.items()
    ]


def _others(finding: Finding) -> dict[str, Any]:
    """Causes that were looked at closely and not named."""
    rejected = [cause for cause in finding.causes if not cause.named and not cause.probability >= POSSIBLE]
    return {
        "possible": [_cause(cause, finding) for cause in possible(finding)],
        "possible_title": "Also possible" if finding.named else "Not excluded",
        "possible_words": ALIKE if finding.named else NOT_EXCLUDED,
        "rejected": [_cause(cause, finding) for cause in rejected],
    }


def _tried(finding: Finding) -> dict[str, Any] | None:
    """Causes that were tried and not established, with what they would have needed."""
    if not finding.tried:
        return None
    first = finding.tried[0]
    return {
        "needed": number(first.gain_needed),
        "probability_needed": _percent(first.probability_needed),
        "rows": [
            {"title": cause_title(one), "gain": tried_words(one), "chance": chance(one.probability), "why": one.why}
            for one in finding.tried
        ],
    }


def _ratios(gains: Sequence[tuple[str, Gain]]) -> list[dict[str, Any]]:
    """Errors with each cause as shares of those without."""
    return [
        {
            "words": f"with {words}",
            "shares": [
                UNDEFINED if (ratio := gain.error_ratios.get(name)) is None else ratio_words(ratio)
                for name in STRETCHES
            ],
        }
        for words, gain in gains
        if gain.error_ratios
    ]


def _coverage(gains: Sequence[tuple[str, Gain]]) -> list[dict[str, Any]]:
    """Calibration of the predictions, without and with each cause."""
    return [
        _calibration(f"{word} {words}", held)
        for words, gain in gains
        for word, held in (("without", gain.before), ("with", gain.after))
    ]


def _calibration(words: str, held: HeldOut) -> dict[str, Any]:
    return {
        "words": words,
        "half": _percent(held.coverage_50),
        "most": _percent(held.coverage_90),
        "tenths": _bars(held.pit),
        "tenths_words": ", ".join(_percent(share) for share in held.pit),
    }


def _predicted(held: HeldOut, noise: float | None) -> dict[str, Any]:
    """How well the model that was given predicts left-out videos, where no cause makes it better."""
    errors = {label: getattr(held, name) for name, label in STRETCHES.items()}
    known = [one for one in (*errors.values(), noise) if one is not None and math.isfinite(one)]
    factor, unit = length_unit(known)
    return {
        "unit": unit,
        "errors": [UNDEFINED if one is None else number(factor * one) for one in errors.values()],
        "noise": UNDEFINED if noise is None else number(factor * noise),
        "coverage": [_calibration("the model that was given", held)],
    }


def _bars(shares: Sequence[float]) -> list[float]:
    """Heights of bars in per cent of the room for them, in which those of equal shares are `EVEN_BAR`."""
    return [min(EVEN_BAR * len(shares) * share, 100.0) for share in shares]


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if 0 <= share <= 1 else UNDEFINED


def _checks(finding: Finding) -> dict[str, Any] | None:
    """Checks that fail and checks that do not, each by p-value; the extended model's where it differs."""
    if not finding.checks:
        return None
    after = {check.name: check for check in finding.checks_after} if finding.named else {}
    before = {check.name for check in finding.checks}
    asked_later = partial(replace, p_value=math.nan, significant=False, sentence=ASKED_LATER)
    new = [asked_later(check) for name, check in after.items() if name not in before]
    ordered = sorted(
        [*finding.checks, *new], key=lambda check: (not check.significant, not check.p_value >= 0, check.p_value)
    )
    fails = [check for check in ordered if check.significant or _fails(after.get(check.name))]
    passes = [check for check in ordered if check not in fails]
    unremarkable = counted(len(passes), "check") + (" that shows" if len(passes) == 1 else " that show")
    return {
        "has_after": bool(after),
        "failing": [_check(check, after.get(check.name)) for check in fails],
        "passing": [_check(check, after.get(check.name)) for check in passes],
        "passing_words": f"{sentence(unremarkable)} nothing",
    }


def _fails(check: Check | None) -> bool:
    return check is not None and check.significant


def _check(check: Check, after: Check | None) -> dict[str, Any]:
    return {
        "name": sentence(check.name),
        "sentence": typeset(f"{check.sentence} {check.rival}".strip()),
        "p": p_words(check.p_value),
        "fails": check.significant,
        "p_after": UNDEFINED if after is None else p_words(after.p_value),
        "fails_after": _fails(after),
        "sentence_after": typeset(after.sentence) if after is not None and after.significant else "",
    }


def _bounds(finding: Finding) -> list[dict[str, Any]]:
    """Upper bounds by cause, in the order given; causes without any bound last."""
    groups: dict[tuple[str, str | None], list[UpperBound]] = {}
    for bound in finding.upper_bounds:
        groups.setdefault((bound.name, bound.way), []).append(bound)
    told = [
        {
            "title": cause_title(bounds[0]),
            "rows": [
                {
                    "name": bound.parameter,
                    "words": sentence(
                        bound.measure or parameter_words(bound.parameter, effect_of(way or name, finding.extended))
                    ),
                    "bound": bound_words(bound),
                    "is_known": bound.bound is not None,
                }
                for bound in bounds
            ],
        }
        for (name, way), bounds in groups.items()
    ]
    return sorted(told, key=lambda group: not any(row["is_known"] for row in group["rows"]))


def _description(description: Description) -> dict[str, Any]:
    return {
        "sentences": [typeset(one) for one in description.sentences],
        "formula": description.formula if description.has_formula else "",
        "size": with_unit(number(description.size), "m/s^2") if description.size is not None else "",
        "explained": _percent(description.explained),
        "contact_formula": description.contact_formula,
        "contact_explained": _percent(description.contact_explained),
    }


def _model(finding: Finding) -> dict[str, Any]:
    added = [cause_title(cause) for cause in finding.named]
    if added:
        words = f"The model that was given, with {listed(added)} added."
    else:
        words = "The model that was given: nothing is added to it that has no name."
    if finding.extended.beliefs != finding.model.beliefs:
        words += (
            " It is for further videos of the same table: it believes what these videos say of the table, and of single"
            " bodies (masses, restitutions, frictions) what they say of all. Given to one of these videos, it counts"
            " what that video says twice."
        )
    kept = {effect.name for effect in finding.extended.effects}
    if past := [cause_title(cause) for cause in finding.named if cause.effect not in kept]:
        words += f" {listed(past)} is no part of it, since that happened once in a video."
    return {
        "model": finding.model.name,
        "model_words": words,
        "effects": listed(title(effect.name) for effect in finding.model.effects),
        "videos": some(finding.videos),
        "toml": finding.extended.text,
        "version": __version__,
    }


def _inline(figure: str, index: int) -> Markup:
    """An SVG element to stand in the page, without its prologue and with names that no other figure has."""
    start, end = figure.find("<svg"), figure.rfind("</svg>")
    if start < 0 or end < 0:
        raise ValueError("a figure must be an SVG element as text.")
    element = re.sub(r"<metadata>.*?</metadata>", "", figure[start : end + len("</svg>")], flags=re.DOTALL)
    element = re.sub(r'(\bid="|\bhref="#|url\(#)', rf"\g<1>figure{index}-", element)
    return Markup(element)
