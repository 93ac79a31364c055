"""The run-time type checker of the tests: an int will do where a float is asked for, as for static checkers.

A function is checked in its first calls and now and then after these: a fit makes some in the ten thousands, and checks
would take longer than the fit.
"""

from collections.abc import Callable
from functools import cache, wraps
from inspect import isclass
from types import FunctionType
from typing import Any

import jaxtyping
from beartype import BeartypeConf, beartype

ALWAYS = 100
"""Calls of a function that are checked, one and all..."""
SOMETIMES = 101
"""...and of the further ones one of so many."""

check = beartype(conf=BeartypeConf(is_pep484_tower=True))


def check_now_and_then() -> None:
    """Have the decorator that the import hook of jaxtyping puts before everything look at some calls only."""
    every_call = jaxtyping.jaxtyped

    def decorator(*, typechecker: Callable[..., Any]) -> Callable[[Any], Any]:
        def decorate(thing: Any) -> Any:
            if isinstance(thing, FunctionType):
                return _some_calls(thing, lambda: every_call(thing, typechecker=typechecker))
            made = thing.__init__ if isclass(thing) else None
            checked = every_call(thing, typechecker=typechecker)
            if isclass(thing) and (checked_init := thing.__init__) is not made:
                thing.__init__ = _some_calls(made, lambda: checked_init)
            return checked

        return decorate

    jaxtyping.jaxtyped = decorator


def _some_calls(plain: Callable[..., Any], make_checked: Callable[[], Callable[..., Any]]) -> Callable[..., Any]:
    """A function of which some calls are checked; the checks are made with its first one."""
    make, calls = cache(make_checked), 0

    @wraps(plain)
    def call(*arguments: Any, **named: Any) -> Any:
        nonlocal calls
        calls += 1
        chosen = calls <= ALWAYS or calls % SOMETIMES == 0
        return make()(*arguments, **named) if chosen else plain(*arguments, **named)

    return call
