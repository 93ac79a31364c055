"""What was found, in sentences: the verdict first, then what it is worth and what else is possible."""

import re
from collections.abc import Sequence

from vrdp_prob.discovery.finding import Check, Description, Finding, FoundCause, Gain, TriedCause, UpperBound, Verdict
from vrdp_prob.discovery.page.changed_answers import answers_sentence
from vrdp_prob.discovery.page.wording import (
    TOGETHER,
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
    ratio_words,
    told_gains,
    tried_words,
    with_unit,
)
from vrdp_prob.discovery.words import title
from vrdp_prob.plain_words import counted, listed, number_word, sentence

SURE = 0.9
"""Probability from which videos show a cause, and do not merely suggest it."""
POSSIBLE = 0.05
"""Probability from which a cause that was not named is told of as possible."""
UNEXPLAINED = "something that no cause of the catalogue explains"
"""What is told first where a finding leaves something."""
CARRIED = 0.9
"""Share of a gain from which a single video is said to carry it."""


def verdict_sentence(finding: Finding) -> str:
    """What was found, in one sentence."""
    videos = f"these {counted(len(finding.videos), 'video')}"
    if finding.named:
        verb = "show" if all(cause.probability >= SURE for cause in finding.named) else "suggest"
        found = ", and ".join(f"that {_clause(cause.sentence)}" for cause in finding.named)
        alone = finding.named[0] if len(finding.named) == 1 else None
        others = [one for one in possible(finding) if alone is not None and one.probability >= alone.probability]
        found += "".join(f", or, no less likely, that {_clause(cause.sentence)}" for cause in others)
        if _leaves_a_rest(finding):
            return f"{sentence(videos)} show {UNEXPLAINED}, and {verb} beside it {found}."
        return f"{sentence(videos)} {verb} {found}."
    if finding.verdict is Verdict.NONE:
        return f"The model explains {videos}."
    return f"{sentence(videos)} show {UNEXPLAINED}."


def summary(finding: Finding) -> list[str]:
    """What the verdict rests on and is worth, in sentences."""
    told = [_gains(told_gains(finding))] if finding.named else []
    if others := possible(finding):
        told.append(_others(others, beside=finding.named))
    if finding.verdict is Verdict.UNKNOWN and finding.tried:
        told.append(_tried(finding.tried))
    told += [f"{sentence(line)}." for line in _lines(finding) if line]
    if finding.verdict is Verdict.NONE:
        told.append(
            "No cause of the catalogue predicts videos that are left out so much better that it would be named."
        )
    return told


def _lines(finding: Finding) -> list[str]:
    answers = "" if finding.answers is None else answers_sentence(finding.answers)
    return [*_carried(finding.named), answers, _checks(finding), _rest(finding)]


def possible(finding: Finding) -> list[FoundCause]:
    """Causes that were not named but cannot be excluded."""
    return [cause for cause in finding.causes if not cause.named and cause.probability >= POSSIBLE]


def lines(finding: Finding) -> list[str]:
    """The finding as lines of text for a terminal."""
    told = [verdict_sentence(finding)]
    for cause in finding.named:
        told.append(f"  {cause_title(cause)}: probability {chance(cause.probability)}; {_gain_line(cause.gain)}")
        effect = effect_of(cause.effect, finding.extended)
        leading, own = leading_and_own(cause, effect)
        for name, estimate in leading.items():
            mean, interval = estimate_words(estimate)
            told.append(f"      {title(name)} {mean} (95 %: {interval})")
        told += [f"      and {own_words(own, effect)}"] if own else []
    told += [f"  {words}: {_gain_line(gain)}" for words, gain in told_gains(finding) if words == TOGETHER]
    if finding.description is not None:
        told += [f"  {line}" for line in finding.description.sentences]
        told += [f"  a description, not a cause: {formula}" for formula in _formulas(finding.description)]
    told += summary(finding)[bool(finding.named) :]
    if finding.verdict is Verdict.NONE and finding.upper_bounds:
        told += ["How strong each cause can be at most (95 %):", *_bounds(finding.upper_bounds)]
    return [*told, *(f"note: {note}" for note in finding.notes)]


def errors_words(gain: Gain) -> tuple[str, str, str, str]:
    """Held-out error before and after, the noise, and the unit of the three."""
    sizes = (gain.before.rmse, gain.after.rmse, gain.noise)
    factor, unit = length_unit(sizes)
    before, after, noise = (number(factor * size) for size in sizes)
    return before, after, noise, unit


def _clause(text: str) -> str:
    """The first of some sentences, without the intervals in brackets, to stand inside another one."""
    first = re.split(r"(?<=[.!?])\s+(?=[A-Z])", text.strip(), maxsplit=1)[0].removesuffix(".")
    first = re.sub(r"\s*\([^()]*\d[^()]*\)", "", first)
    is_acronym = len(first) > 1 and first[1].isupper()
    return first if is_acronym else first[:1].lower() + first[1:]


def _leaves_a_rest(finding: Finding) -> bool:
    return finding.verdict is Verdict.UNKNOWN or finding.description is not None


def _gains(gains: Sequence[tuple[str, Gain]]) -> str:
    parts: list[str] = []
    for words, gain in gains:
        before, after, _, unit = errors_words(gain)
        verb = "" if words == TOGETHER else "s"
        what = "it" if parts else "the error of predicted positions"
        change = (
            f"leave{verb} {what} at {after} {unit}"
            if before == after
            else f"take{verb} {what} from {before} to {after} {unit}"
        )
        parts.append(f"{words} {change}")
    *_, noise, unit = errors_words(gains[-1][1])
    return f"In videos that were left out, {listed(parts)}; the measurement noise is {noise} {unit}."


def _carried(causes: Sequence[FoundCause]) -> list[str]:
    """Causes that one video alone speaks for."""
    told = []
    for cause in causes:
        video, most = max(cause.gain.by_video.items(), key=lambda item: item[1])
        if most > CARRIED * cause.gain.elpd_difference:
            told.append(f"the gain of {cause_title(cause)} comes from {video} alone and may be something of that video")
    return told


def _gain_line(gain: Gain) -> str:
    before, after, noise, unit = errors_words(gain)
    share = f", a factor of {ratio_words(ratio)}" if (ratio := gain.error_ratios.get("rmse")) is not None else ""
    errors = f"error {before} to {after} {unit} (noise {noise} {unit}){share}"
    return f"left-out videos: {difference_words(gain)} nats, {errors}"


def _others(others: Sequence[FoundCause], *, beside: Sequence[FoundCause]) -> str:
    told = listed(f"{cause_title(cause)} ({chance(cause.probability)})" for cause in others)
    return f"{'Also possible' if beside else 'Not excluded'}: {told}."


def _tried(tried: Sequence[TriedCause]) -> str:
    words = listed(f"{cause_title(one)} ({tried_words(one)})" for one in tried)
    needed = number(tried[0].gain_needed)
    return f"Tried and not established: {words}; nats in left-out videos, of which {needed} are needed."


def _checks(finding: Finding) -> str:
    if not finding.checks:
        return ""
    said = f"of {counted(len(finding.checks), 'check')} of the residuals, {_failing(finding.checks)}"
    if finding.named and finding.checks_after:
        said += f" under the model that was given, and {_failing(finding.checks_after)} under the extended one"
    return said


def _failing(checks: Sequence[Check]) -> str:
    count = sum(check.significant for check in checks)
    return f"{number_word(count)} fail" if count > 1 else "one fails" if count else "none fails"


def _formulas(description: Description) -> list[str]:
    """The formulas that explain anything, each in one line."""
    flight = ["; ".join(description.formula.splitlines())] if description.has_formula else []
    return [*flight, *([description.contact_formula] if description.contact_formula else [])]


def _bounds(bounds: Sequence[UpperBound]) -> list[str]:
    words = {bound: f"{bound.measure or title(bound.parameter)} {bound_words(bound)}" for bound in bounds}
    return [
        f"  {title(name)}: {', '.join(told for bound, told in words.items() if bound.name == name)}"
        for name in dict.fromkeys(bound.name for bound in bounds)
    ]


def _rest(finding: Finding) -> str:
    description = finding.description
    if description is None or description.size is None:
        return ""
    size = f"the missing acceleration is {with_unit(number(description.size), 'm/s^2')} on average (root mean square)"
    if not description.has_formula:
        return size
    return (
        f"{size}; a formula that describes it, without saying why, explains {chance(description.explained)} of it in "
        "videos that were left out"
    )
