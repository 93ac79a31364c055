"""Programs written token by token: every token that is admitted leads to a well-typed program, and no other is."""

from itertools import product

import numpy as np
import pytest

from vrdp_prob.errors import InputError
from vrdp_prob.reasoning.language.learned.decoding import STARTS, PartialProgram
from vrdp_prob.reasoning.language.meaning import draw
from vrdp_prob.reasoning.operations import REGISTRY
from vrdp_prob.reasoning.program import check
from vrdp_prob.reasoning.tokens import CONCEPTS

TOKENS = (*sorted(REGISTRY), *sorted(CONCEPTS))


def written(kind: str, tokens: tuple[str, ...]) -> PartialProgram | None:
    """The program so far, None where one of the tokens is not admitted."""
    partial = PartialProgram(kind)
    for token in tokens:
        if not partial.admits(token):
            return None
        partial.push(token)
    return partial


def is_well_typed(kind: str, tokens: tuple[str, ...]) -> bool:
    for stack, ends in STARTS[kind]:
        try:
            (given,) = stack or (None,)
            check(tokens, ends_in=ends, given=given)
        except InputError:
            continue
        return True
    return False


@pytest.mark.parametrize("kind", ["question", "choice"])
def test_random_programs_meet_no_dead_end_and_type_check_where_they_may_end(kind: str) -> None:
    generator, ends = np.random.default_rng(0), 0
    for _ in range(60):
        partial, tokens = PartialProgram(kind), []
        for _ in range(25):
            admitted = [token for token in TOKENS if partial.admits(token)]
            assert admitted or partial.is_whole, tokens
            if partial.is_whole:
                ends += 1
                assert is_well_typed(kind, tuple(tokens)), tokens
            if not admitted:
                break
            tokens.append(admitted[int(generator.integers(len(admitted)))])
            partial.push(tokens[-1])
        assert is_well_typed(kind, tuple(tokens)) == partial.is_whole
    assert ends > 20


@pytest.mark.parametrize("kind", ["question", "choice"])
def test_every_program_of_the_grammar_can_be_written(kind: str) -> None:
    generator = np.random.default_rng(1)
    for _ in range(300):
        program = draw(kind, generator).program
        partial = written(kind, program)
        assert partial is not None, program
        assert partial.is_whole


def test_short_programs_are_admitted_exactly_where_the_type_checker_passes_them() -> None:
    some = ("objects", "events", "unseen_events", "red", "filter_color", "unique", "count", "belong_to", "get_frame")
    for length in (1, 2, 3, 4):
        for tokens in product(some, repeat=length):
            partial = written("question", tokens)
            assert (partial is not None and partial.is_whole) == is_well_typed("question", tokens), tokens


@pytest.mark.parametrize(
    "tokens", ["red", "objects metal filter_color", "count", "objects red red", "objects unique unique"]
)
def test_tokens_that_lead_nowhere_are_not_admitted(tokens: str) -> None:
    *before, last = tokens.split()
    partial = written("choice", tuple(before))
    assert partial is not None
    assert not partial.admits(last)


def test_no_operation_takes_more_than_two_values() -> None:
    # becomes() follows operations of one and of two values
    assert all(len(operation.takes) <= 2 for signatures in REGISTRY.values() for operation in signatures)
