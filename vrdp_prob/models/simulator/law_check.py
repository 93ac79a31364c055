"""Call every law of every effect once before it is compiled, so that a mistake in one is a sentence that names it."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from vrdp_prob.errors import InputError
from vrdp_prob.models.effects.effect import ContactView
from vrdp_prob.models.simulator.formula import Symbol
from vrdp_prob.models.simulator.laws import LawInputs, Layout

if TYPE_CHECKING:
    from vrdp_prob.models.effects.effect import Effect

_RESULTS = {
    "acceleration": 2,
    "friction_factor": 1,
    "spin_deceleration": 1,
    "slip_friction": 1,
    "pair_force": 2,
    "kick_time": 1,
    "kick": 3,
    "boundary": 1,
    "restitution": 1,
    "tangential_impulse": 1,
    "vertical_impulse": 1,
}
"""Number of results of each law."""


def check_laws(effects: "Sequence[Effect]", layout: Layout) -> None:
    """Call the laws with symbols.

    Raises
    ------
    InputError
        With effect and hook, if a law fails or does not return what it must.
    """
    inputs = LawInputs(effects, layout)
    moving = inputs.view(inputs.state("y"), inputs.constants("body"), inputs.phase())
    body, other = (inputs.view(inputs.state(name), inputs.constants(name)) for name in ("first", "second"))
    contact = ContactView(*inputs.array("contact", 7))
    number, shared = inputs.recorder.input("number"), inputs.shared
    arguments: dict[str, tuple[Any, ...]] = {
        **dict.fromkeys(("acceleration", "friction_factor", "spin_deceleration"), (inputs.time, moving, shared)),
        "slip_friction": (inputs.time, moving, shared),
        "pair_force": (inputs.time, body, other, shared),
        "kick_time": (shared,),
        "kick": (inputs.time, body, shared),
        "boundary": (body, shared),
        "restitution": (number, number, body, other, shared),
        **dict.fromkeys(("tangential_impulse", "vertical_impulse"), (contact, body, other, shared)),
    }
    for effect in effects:
        for hook, count in _RESULTS.items():
            # A kick needs a time, whether or not the effect has thought of it.
            if effect.overrides(hook) or (hook == "kick_time" and effect.overrides("kick")):
                where = f"effect '{effect.name}', {hook}"
                _check_results(where, count, _called(where, getattr(effect, hook), arguments[hook]))


def _called(where: str, law: Callable[..., object], arguments: tuple[Any, ...]) -> object:
    try:
        return law(*arguments)
    except KeyError as error:
        raise InputError(
            f"{where}: there is no {error} for it; state the parameter in 'parameters' with the scope it is read from."
        ) from error
    except NotImplementedError as error:
        raise InputError(f"{where}: {error}") from error
    except (AttributeError, TypeError, ValueError) as error:
        raise InputError(
            f"{where}: {error}; a law uses the operators and vrdp_prob.models.simulator.mathematics."
        ) from error


def _check_results(where: str, count: int, result: object) -> None:
    results = result if isinstance(result, tuple | list) else (result,)
    numbers = all(isinstance(one, Symbol | float | int) for one in results)
    if len(results) != count or not numbers or (count == 1 and isinstance(result, tuple | list)):
        wanted = "one number" if count == 1 else f"{count} numbers"
        raise InputError(f"{where}: it returns {type(result).__name__} of {len(results)}; it must return {wanted}.")
