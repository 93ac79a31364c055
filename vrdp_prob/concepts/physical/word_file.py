"""The file of a learned word: a JSON document that a person can read, and that is checked when it is read."""

import json
from collections.abc import Mapping
from dataclasses import asdict, astuple, fields
from pathlib import Path
from typing import Any

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

TOLERANCE = 1e-6
"""By how much probabilities may miss 1 in a file that was written with rounded numbers."""


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
        If the file cannot be read, is not a word, is of another version, or its probabilities do not add up to 1.
    """
    document = read_json(path)
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
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not a whole word ({error}); learn it anew.") from error
    return word


def _word(document: Mapping[str, Any]) -> LearnedWord:
    if set(document) != FIELDS:
        raise ValueError(f"fields {', '.join(sorted(FIELDS ^ set(document)))} are missing or unknown")
    return LearnedWord(
        str(document["name"]),
        tuple(_belief(one) for one in document["beliefs"]),
        {str(name): float(error) for name, error in document["mc_errors"].items()},
        Interval(**{name: float(value) for name, value in document["lapse"].items()}),
        float(document["log_gain"]),
        float(document["log_gain_error"]),
        _evidence(document["evidence"]),
    )


def _evidence(entry: Mapping[str, Any]) -> Evidence:
    counts = {name: int(value) for name, value in entry.items() if name != "left_out"}
    return Evidence(**counts, left_out=tuple(str(reason) for reason in entry["left_out"]))


def _belief(entry: Mapping[str, Any]) -> Belief:
    parameter, rule = entry["parameter"], entry["rule"]
    return Belief(
        **{
            **entry,
            "parameter": None if parameter is None else PhysicalParameter(parameter),
            "rule": None if rule is None else Rule(rule),
            **{name: float(entry[name]) for name in ("probability", "mc_error", "log_evidence")},
            **{name: tuple(float(value) for value in entry[name]) for name in ("amounts", "weights")},
        }
    )


def _check_beliefs(word: LearnedWord) -> None:
    """Beliefs are about what a word may mean, each once, and every number is finite."""
    believed = [(belief.parameter, belief.rule) for belief in word.beliefs]
    possible = {(None, None), *((one.parameter, one.rule) for one in HYPOTHESES)}
    if not believed or len(set(believed)) < len(believed) or not possible.issuperset(believed):
        raise ValueError("the beliefs are not about changes that a word may mean, each once")
    if set(word.mc_errors) != set(word.probabilities):
        raise ValueError("mc_errors and beliefs are not about the same parameters")
    numbers = [word.log_gain, word.log_gain_error, *astuple(word.lapse), *word.mc_errors.values()]
    numbers += [number for one in word.beliefs for number in (one.probability, one.mc_error, one.log_evidence)]
    if not np.isfinite(numbers).all():
        raise ValueError("a number is not finite")


def _check_sums(word: LearnedWord) -> None:
    shares = [("beliefs", [belief.probability for belief in word.beliefs])]
    shares += [(f"weights of {belief.name}", list(belief.weights)) for belief in word.beliefs if belief.weights]
    for name, values in shares:
        if not (np.isfinite(values).all() and min(values) >= 0 and abs(sum(values) - 1) < TOLERANCE):
            raise ValueError(f"the probabilities of {name} do not add up to 1")
    for belief in word.beliefs:
        if (belief.parameter is None) != (not belief.amounts):
            raise ValueError(f"{belief.name} has amounts without a parameter, or a parameter without amounts")
        if not np.isfinite(belief.amounts).all() or (belief.rule is Rule.FACTOR and min(belief.amounts) <= 0):
            raise ValueError(f"the amounts of {belief.name} are not finite, or a factor is not positive")
        if len(belief.amounts) != len(belief.weights) or (np.diff(belief.amounts) <= 0).any():
            raise ValueError(f"the amounts of {belief.name} are not ascending numbers, one for each weight")
