"""Physics models as TOML: the effects by name, and what is believed of each parameter.

::

    name = "base"
    effects = ["dry_friction", "air_drag", "angular_drag", "normal_impact"]  # an effect of your own: "module:Class"

    [parameters.sliding_friction]        # optional: a table for each parameter whose prior or default differs
    default = 0.1                        # in the parameter's unit
    prior_mean = -2.3                    # of the inferred coordinate (for most parameters the logarithm)
    prior_sd = 1.0

    [parameters."material_friction_ratio[metal]"]  # of one material, or of a wall: "wall_restitution[x1, y1, x2, y2]"
    prior_mean = 0.2
"""

import importlib
import json
import math
import pkgutil
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from vrdp_prob.errors import InputError
from vrdp_prob.models import effects as catalogue
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.parameters import MATTER, WALL_RESTITUTION, Parameter, Scope, belief_key, plain_name
from vrdp_prob.scene import Wall

_NUMBERS = ("default", "prior_mean", "prior_sd")


@cache
def known_effects() -> Mapping[str, type[Effect]]:
    """All effects by name: every file of `vrdp_prob.models.effects` that defines one."""
    for module in pkgutil.iter_modules(catalogue.__path__, catalogue.__name__ + "."):
        importlib.import_module(module.name)
    return {effect.name: effect for effect in _kinds_of(Effect) if effect.__module__.startswith(__package__ or "")}


def _kinds_of(effect: type[Effect]) -> Iterator[type[Effect]]:
    """All classes that derive from one."""
    for kind in effect.__subclasses__():
        yield kind
        yield from _kinds_of(kind)


def text(name: str, effects: Sequence[Effect], parameters: Mapping[str, Parameter]) -> str:
    """Content of a model file, with what is believed by name."""
    lines = [f"name = {json.dumps(name)}", "effects = ["]
    lines += [f"    {json.dumps(_reference(effect))}, # {effect.sentence}" for effect in effects]
    lines.append("]")
    for key, parameter in parameters.items():
        quoted = key if key == parameter.name else json.dumps(key)
        lines += [
            "",
            f"[parameters.{quoted}] # {parameter.description}, in {parameter.unit}",
            f"default = {parameter.default!r}",
            f"prior_mean = {parameter.prior.mean!r}",
            f"prior_sd = {parameter.prior.sd!r}",
        ]
    return "\n".join(lines) + "\n"


def parse(content: str) -> tuple[str, tuple[Effect, ...], dict[str, Parameter]]:
    """Name, effects and beliefs of a model file.

    Raises
    ------
    InputError
        With the field, if the content is not a model.
    """
    try:
        document = tomllib.loads(content)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"not a TOML file ({error}); see docs/effects.md for an example.") from error
    unknown = sorted(set(document) - {"name", "effects", "parameters"})
    if unknown:
        raise InputError(f"field '{unknown[0]}' is not known; a model has 'name', 'effects' and 'parameters'.")
    name, names = document.get("name"), document.get("effects")
    if not isinstance(name, str) or not name:
        raise InputError("field 'name' is missing; give the model a name.")
    if not isinstance(names, list) or not names:
        raise InputError("field 'effects' is missing; list the names of the model's effects.")
    effects = tuple(_effect(entry) for entry in names)
    stated = MATTER | {parameter.name: parameter for effect in effects for parameter in effect.parameters}
    tables = document.get("parameters", {})
    if not isinstance(tables, dict):
        raise InputError("field 'parameters' must hold one table for each parameter.")
    beliefs: dict[str, Parameter] = {}
    for key, table in sorted(tables.items(), key=lambda one: plain_name(one[0]) != one[0]):  # those of all first
        beliefs[_key(key)] = _belief(key, table, {name: beliefs.get(name, one) for name, one in stated.items()})
    return name, effects, beliefs


def _reference(effect: Effect) -> str:
    """How a model file names an effect: by its name, or, where it is not ours, by the module that has its class."""
    kind = type(effect)
    return effect.name if known_effects().get(effect.name) is kind else f"{kind.__module__}:{kind.__qualname__}"


def _effect(name: object) -> Effect:
    if isinstance(name, str) and ":" in name:
        return _effect_of_module(*name.split(":", 1))
    known = known_effects()
    if not isinstance(name, str) or name not in known:
        raise InputError(
            f"effect '{name}' is not known; the effects are {', '.join(sorted(known))}, or your own as 'module:Class'."
        )
    return known[name]()


def _effect_of_module(module: str, name: str) -> Effect:
    try:
        found = getattr(importlib.import_module(module), name)
    except (ImportError, ValueError, AttributeError) as error:
        raise InputError(
            f"effect '{module}:{name}' cannot be imported ({error}); check both names and that Python finds the module."
        ) from error
    if not (isinstance(found, type) and issubclass(found, Effect)):
        raise InputError(f"effect '{module}:{name}' is no subclass of Effect; name a class that is.")
    return found()


def _key(name: str) -> str:
    """By what a belief is looked up: that of a wall by its ends as every file has them."""
    plain = plain_name(name)
    if plain != WALL_RESTITUTION.name or plain == name:
        return name
    try:
        x1, y1, x2, y2 = map(float, name.removeprefix(f"{plain}[").removesuffix("]").split(","))
    except ValueError as error:
        raise InputError(f"field 'parameters.{name}': name the wall by its ends: {plain}[x1, y1, x2, y2].") from error
    return belief_key(plain, Wall(x1, y1, x2, y2).place)


def _belief(name: str, table: Any, stated: Mapping[str, Parameter]) -> Parameter:
    plain = plain_name(name)
    if plain not in stated or (plain != name and not name.endswith("]")):
        raise InputError(f"parameter '{name}' belongs to none of the effects; they have {', '.join(sorted(stated))}.")
    if not isinstance(table, dict):
        raise InputError(f"field 'parameters.{name}' must be a table with {', '.join(_NUMBERS)}.")
    for key, value in table.items():
        if key not in _NUMBERS:
            raise InputError(f"field 'parameters.{name}.{key}' is not known; use {', '.join(_NUMBERS)}.")
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"field 'parameters.{name}.{key}' is {value!r}; give a finite number.")
    parameter = stated[plain]
    if plain != name and parameter.scope is not Scope.MATERIAL and plain != WALL_RESTITUTION.name:
        raise InputError(f"field 'parameters.{name}': '{plain}' is of no material or wall; leave out the brackets.")
    prior = replace(
        parameter.prior,
        mean=float(table.get("prior_mean", parameter.prior.mean)),
        sd=float(table.get("prior_sd", parameter.prior.sd)),
    )
    return replace(parameter, prior=prior, default=float(table.get("default", parameter.default)))
