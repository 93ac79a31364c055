"""What may come next in a program: tokens after which it can still become well-typed.

The types are those of `reasoning/operations.py`. A stack can be finished if what lies on top can be turned into a value
that an operation takes together with the value below, and so on down to one value of a wanted type. Nothing that is
below the top can change before that, so it is enough to know what a value can become by itself.
"""

from collections.abc import Callable, Iterator
from functools import cache

from vrdp_prob.reasoning import event_operations, object_operations, output_operations
from vrdp_prob.reasoning.operations import REGISTRY, Operation
from vrdp_prob.reasoning.program import ANSWERS, ENTRIES
from vrdp_prob.reasoning.tokens import CONCEPTS
from vrdp_prob.reasoning.values import Truth, Word

Item = type | str
"""What lies on the stack: a type, or a concept word by itself."""

Stack = tuple[Item, ...]

OPERATION_MODULES = (event_operations, object_operations, output_operations)
"""Modules whose import fills the registry."""

STARTS: dict[str, tuple[tuple[Stack, tuple[type, ...]], ...]] = {
    "question": (((), ANSWERS), *(((entry,), (Truth,)) for entry in ENTRIES)),
    "choice": (((), ENTRIES),),
}
"""Stacks that a program may begin with, and types that it may then end in; a question may find a choice's value."""


class PartialProgram:
    """A program that is being written.

    Parameters
    ----------
    kind
        `question` or `choice`.
    """

    def __init__(self, kind: str) -> None:
        self._readings = STARTS[kind]

    def admits(self, token: str) -> bool:
        """Whether the program can still become well-typed with the token next."""
        return bool(self._with(token))

    def push(self, token: str) -> None:
        """Write a token; it must be admitted."""
        self._readings = self._with(token)

    @property
    def is_whole(self) -> bool:
        """Whether the program may end here."""
        return any(len(stack) == 1 and stack[0] in ends for stack, ends in self._readings)

    def _with(self, token: str) -> tuple[tuple[Stack, tuple[type, ...]], ...]:
        longer = ((_after(stack, token), ends) for stack, ends in self._readings)
        return tuple((stack, ends) for stack, ends in longer if stack is not None and _can_end(stack, ends))


@cache
def _after(stack: Stack, token: str) -> Stack | None:
    """The stack after a token, None where the token does not fit; as `program.check` does it."""
    if token in CONCEPTS:
        return (*stack, token)
    types = [Word if isinstance(item, str) else item for item in stack]
    for operation in REGISTRY.get(token, ()):
        if operation.fits(types):
            count = len(operation.takes)
            taken = stack[len(stack) - count :]
            if any(isinstance(item, str) and item not in operation.words for item in taken):
                return None
            return (*stack[: len(stack) - count], operation.gives)
    return None


@cache
def _can_end(stack: Stack, ends: tuple[type, ...]) -> bool:
    *below, top = stack
    reached = becomes(top)
    for item in reversed(below):
        reached = frozenset[Item]().union(*(becomes(result) for other in reached for result in _joined(item, other)))
    return not reached.isdisjoint(ends)


@cache
def becomes(item: Item) -> frozenset[Item]:
    """What a value on top of the stack can become without anything below it."""
    return _TABLE[item]


def _table() -> dict[Item, frozenset[Item]]:
    """The least sets that hold each item, what operations make of it, and what they make of it and another value."""
    operations = [operation for signatures in REGISTRY.values() for operation in signatures]
    given: set[Item] = {operation.gives for operation in operations}
    sources: set[Item] = {operation.gives for operation in operations if not operation.takes} | CONCEPTS
    table = {item: frozenset([item]) for item in given | sources}
    growing = True
    while growing:
        growing = False
        tops = frozenset[Item]().union(*(table[source] for source in sources))
        for item, known in table.items():
            more = {result for one in known for result in _alone(one)}
            more |= {result for one in known for top in tops for result in _joined(one, top)}
            if not more <= known:
                table[item] = known | more
                growing = True
    return table


@cache
def _alone(item: Item) -> frozenset[Item]:
    return frozenset(_results(item))


@cache
def _joined(below: Item, top: Item) -> frozenset[Item]:
    return frozenset(_results(below, top))


def _results(*items: Item) -> Iterator[Item]:
    """What operations on exactly these values give."""
    for operation in (operation for signatures in REGISTRY.values() for operation in signatures):
        if len(operation.takes) == len(items) and all(map(_takes(operation), items, operation.takes)):
            yield operation.gives


def _takes(operation: Operation) -> Callable[[Item, tuple[type, ...]], bool]:
    def fits(item: Item, allowed: tuple[type, ...]) -> bool:
        return (Word in allowed and item in operation.words) if isinstance(item, str) else item in allowed

    return fits


_TABLE = _table()
