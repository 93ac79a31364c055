"""The file of a learned word: a JSON document that a person can read, and that is checked when it is read."""

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from vrdp_prob.concepts.physical.belief import Belief
from vrdp_prob.concepts.physical.hypotheses import HYPOTHESES
from vrdp_prob.concepts.physical.learned_word import Evidence, Interval, LearnedWord
from vrdp_prob.concepts.physical.naming import check_name
from vrdp_prob.datasets.clevrer import read_json
from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically
from vrdp_prob.reasoning.changes import PhysicalParameter, Rule

FORMAT, VERSION = "vrdp-prob word", 1

FIELDS = frozenset(("format", "version", "summary", *(field.name for field in fields(LearnedWord))))

Choice = TypeVar("Choice", bound=StrEnum)

TOLERANCE = 1e-6
"""By how much probabilities may miss 1, and amounts a limit, in a file that was written with rounded numbers."""


def write_word(word: LearnedWord, path: Path) -> None:
    """Save a word."""
    document = {"format": FORMAT, "version": VERSION, "summary": list(word.summary), **asdict(word)}
    with write_atomically(path) as temporary:
        temporary.write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_word(path: Path) -> LearnedWord:
    """Open a word.

    Raises
    ------
    InputError
        If the file cannot be read, is not a word, is of another version, its probabilities do not add up to 1, or an
        amount is beyond those that are considered.
    """
    document = _json(path)
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise InputError(f"{path}: not a learned word; give a file that `vrdp-prob learn-word` wrote.")
    if document.get("version") != VERSION:
        raise InputError(
            f"{path}: a word of version {document.get('version')!r}, but version {VERSION} is read; learn it anew."
        )
    try:
        word = _word(document)
        check_name(word.name)
        _check_beliefs(word)
        _check_sums(word)
        _check_amounts(word)
        _check_lapse(word)
    except (ValueError, OverflowError) as error:
        raise InputError(f"{path}: not a whole word ({error}); learn it anew.") from error
    return word


def _json(path: Path) -> Any:
    """Content of the file; what is not even text was never a word."""
    try:
        path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: not a learned word; give a file that `vrdp-prob learn-word` wrote, which is a JSON document."
        ) from error
    except OSError:
        pass  # read_json says why
    return read_json(path)


def _word(document: Mapping[str, Any]) -> LearnedWord:
    _check_fields("the document", document, FIELDS)
    return LearnedWord(
        str(document["name"]),
        tuple(_belief(f"beliefs {n}", one) for n, one in enumerate(_list("beliefs", document["beliefs"]), start=1)),
        {name: _number(f"mc_errors.{name}", error) for name, error in _object(document, "mc_errors").items()},
        _lapse(_object(document, "lapse")),
        _number("log_gain", document["log_gain"]),
        _number("log_gain_error", document["log_gain_error"]),
        _evidence(_object(document, "evidence")),
    )


def _lapse(entry: Mapping[str, Any]) -> Interval:
    _check_fields("lapse", entry, _fields_of(Interval))
    return Interval(**{name: _number(f"lapse.{name}", value) for name, value in entry.items()})


def _evidence(entry: Mapping[str, Any]) -> Evidence:
    _check_fields("evidence", entry, _fields_of(Evidence))
    left_out = tuple(str(reason) for reason in _list("evidence.left_out", entry["left_out"]))
    counts = {name: value for name, value in entry.items() if name != "left_out"}
    for name, value in counts.items():
        if not isinstance(value, int) or value < 0:
            raise ValueError(f"evidence.{name} is {value!r}, and no whole number from 0 on")
    return Evidence(**counts, left_out=left_out)


def _belief(place: str, entry: Any) -> Belief:
    _check_fields(place, entry, _fields_of(Belief))
    return Belief(
        _one_of(f"{place}, parameter", entry["parameter"], PhysicalParameter),
        _one_of(f"{place}, rule", entry["rule"], Rule),
        probability=_number(f"{place}, probability", entry["probability"]),
        mc_error=_number(f"{place}, mc_error", entry["mc_error"]),
        log_evidence=_number(f"{place}, log_evidence", entry["log_evidence"]),
        amounts=_numbers(f"{place}, amounts", entry["amounts"]),
        weights=_numbers(f"{place}, weights", entry["weights"]),
    )


def _fields_of(kind: type[Belief | Evidence | Interval]) -> frozenset[str]:
    return frozenset(field.name for field in fields(kind))


def _check_fields(place: str, entry: Any, expected: frozenset[str]) -> None:
    if not isinstance(entry, dict):
        raise ValueError(f"{place} is no JSON object")
    if set(entry) != expected:
        raise ValueError(f"in {place} the fields {', '.join(sorted(expected ^ set(entry)))} are missing or unknown")


def _object(document: Mapping[str, Any], name: str) -> dict[str, Any]:
    if not isinstance(document[name], dict):
        raise ValueError(f"{name} is no JSON object")
    return dict(document[name])


def _list(place: str, value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise ValueError(f"{place} is no list")
    return value


def _one_of(place: str, value: Any, kind: type[Choice]) -> Choice | None:
    if value is None:
        return None
    if value not in tuple(kind):
        raise ValueError(f"{place} is {value!r}, and none of {', '.join(kind)} or null")
    return kind(value)


def _number(place: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{place} is {value!r}, and no number")
    if not np.isfinite(float(value)):
        raise ValueError(f"{place}: a number is not finite")
    return float(value)


def _numbers(place: str, value: Any) -> tuple[float, ...]:
    return tuple(_number(place, one) for one in _list(place, value))


def _check_beliefs(word: LearnedWord) -> None:
    """Beliefs are about what a word may mean, each once, and every number is finite."""
    believed = [(belief.parameter, belief.rule) for belief in word.beliefs]
    possible = {(None, None), *((one.parameter, one.rule) for one in HYPOTHESES)}
    if not believed or len(set(believed)) < len(believed) or not possible.issuperset(believed):
        raise ValueError("the beliefs are not about changes that a word may mean, each once")
    if set(word.mc_errors) != set(word.probabilities):
        raise ValueError("mc_errors and beliefs are not about the same parameters")
    errors = {**word.mc_errors, "log_gain_error": word.log_gain_error}
    errors |= {f"mc_error of {one.name}": one.mc_error for one in word.beliefs}
    for name, error in errors.items():
        if error < 0:
            raise ValueError(f"the Monte Carlo error {name} is {error:g}, below 0")


def _check_sums(word: LearnedWord) -> None:
    shares = [("beliefs", [belief.probability for belief in word.beliefs])]
    shares += [(f"weights of {belief.name}", list(belief.weights)) for belief in word.beliefs if belief.weights]
    for name, values in shares:
        if not (min(values) >= 0 and abs(sum(values) - 1) < TOLERANCE):
            raise ValueError(f"the probabilities of {name} do not add up to 1")
    for belief in word.beliefs:
        if (belief.parameter is None) != (not belief.amounts):
            raise ValueError(f"{belief.name} has amounts without a parameter, or a parameter without amounts")
        if len(belief.amounts) != len(belief.weights) or (np.diff(belief.amounts) <= 0).any():
            raise ValueError(f"the amounts of {belief.name} are not ascending numbers, one for each weight")


def _check_amounts(word: LearnedWord) -> None:
    """Amounts are among those that a word may mean, which is where answers can be trusted."""
    considered = {(one.parameter, one.rule): one.range for one in HYPOTHESES}
    for place, belief in enumerate(word.beliefs, start=1):
        if not belief.amounts or belief.parameter is None or belief.rule is None:
            continue
        low, high = considered[belief.parameter, belief.rule]
        slack = TOLERANCE * (high - low)
        if belief.amounts[0] < low - slack or belief.amounts[-1] > high + slack:
            raise ValueError(
                f"beliefs {place}, amounts: {belief.name} from {belief.amounts[0]:g} to {belief.amounts[-1]:g}, but "
                f"{low:g} to {high:g} is considered"
            )


def _check_lapse(word: LearnedWord) -> None:
    """Shares are between 0 and 1, and quantiles in order."""
    for name, share in asdict(word.lapse).items():
        if not 0 <= share <= 1:
            raise ValueError(f"lapse.{name} is {share:g}, and no share between 0 and 1")
    if word.lapse.q05 > word.lapse.q95:
        raise ValueError(f"lapse.q05 is {word.lapse.q05:g}, above lapse.q95, {word.lapse.q95:g}")
