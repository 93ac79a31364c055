"""The registry of operations: every token that does something, with the types that it takes and gives.

An operation is a small function. Its first argument is the run (facts and valid draws), the others are what it takes
off the stack, in the order in which the program pushed them. A token with several signatures is tried from the longest
to the shortest. The functions are in `object_operations`, `event_operations`, `output_operations` and
`change_operations`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from vrdp_prob.reasoning.run import Run
from vrdp_prob.reasoning.values import Value, Word

Function = TypeVar("Function", bound=Callable[..., Value])


@dataclass(frozen=True)
class Operation:
    """One signature of a token.

    Parameters
    ----------
    token
        Its token.
    takes
        Types of its arguments, the last one on top of the stack; a tuple lists alternatives.
    gives
        Type of its result.
    function
        What it does.
    words
        Words that a word argument may be; empty where there is none.
    """

    token: str
    takes: tuple[tuple[type, ...], ...]
    gives: type
    function: Callable[..., Value]
    words: tuple[str, ...] = ()

    def fits(self, stack: list[type]) -> bool:
        """Whether the top of a stack of types holds its arguments."""
        if len(stack) < len(self.takes):
            return False
        given = stack[len(stack) - len(self.takes) :]
        return all(kind in allowed for kind, allowed in zip(given, self.takes, strict=True))

    def __call__(self, run: Run, *arguments: Any) -> Value:
        """Run it for all draws."""
        return self.function(run, *arguments)


REGISTRY: dict[str, list[Operation]] = {}


def register(signature: Operation) -> None:
    """Add a signature to the registry."""
    signatures = REGISTRY.setdefault(signature.token, [])
    signatures.append(signature)
    signatures.sort(key=_longest_first)


def by_token(operations: Sequence[Operation]) -> dict[str, list[Operation]]:
    """Signatures by their token, from the longest to the shortest."""
    return {
        token: sorted((one for one in operations if one.token == token), key=_longest_first)
        for token in dict.fromkeys(one.token for one in operations)
    }


def operation(
    token: str, *takes: type | tuple[type, ...], gives: type, words: tuple[str, ...] = ()
) -> Callable[[Function], Function]:
    """Register a function as a signature of a token."""

    def registered(function: Function) -> Function:
        allowed = tuple(kind if isinstance(kind, tuple) else (kind,) for kind in takes)
        if any(Word in kinds for kinds in allowed) != bool(words):
            raise TypeError(f"{token}: a word argument needs its list of words, and only that does")
        register(Operation(token, allowed, gives, function, words))
        return function

    return registered


def _longest_first(signature: Operation) -> int:
    return -len(signature.takes)
