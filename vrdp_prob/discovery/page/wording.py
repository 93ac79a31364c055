"""Numbers of a finding as a physicist reads them: rounded to what they mean, with their units."""

import math
import re
from collections.abc import Collection, Iterable

from vrdp_prob.discovery.finding import (
    ErrorRatio,
    Estimate,
    Finding,
    FoundCause,
    Gain,
    TriedCause,
    UpperBound,
)
from vrdp_prob.discovery.words import title
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.model_file import known_effects
from vrdp_prob.models.parameters import Scope
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.plain_words import counted, percent

UNDEFINED = "\N{EN DASH}"
"""Stands where a number is not defined."""
TOGETHER = "all named causes"
"""What a gain is of that all named causes bring together."""
MINUS = "\N{MINUS SIGN}"
TIMES = " \N{MULTIPLICATION SIGN} "
LEAST_P_VALUE = 1e-99
"""So far out no law of chance is known to hold."""
MOST_OF_SINGLES = 4
"""Estimates of single bodies and videos that stand among the others of a cause."""
PLAIN_FROM, PLAIN_TO = 1e-4, 1e5
"""Sizes that are written without a power of ten."""
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
UNIT_POWERS = {"^2": "²", "^3": "³"}


def number(value: float, precision: float | None = None, *, beside: float = 0.0) -> str:
    """A number with two digits of a precision, or of its own size.

    Parameters
    ----------
    value
        The number.
    precision
        What tells how many digits mean something, for example the standard deviation; the number itself by default.
    beside
        Largest number that stands beside this one, in the same power of ten.
    """
    if math.isnan(value):
        return UNDEFINED
    if math.isinf(value):
        return "∞" if value > 0 else f"{MINUS}∞"
    finest = precision if precision and math.isfinite(precision) else abs(value)
    largest = max(abs(value), finest, beside)
    if largest == 0:
        return "0"
    power = 0 if PLAIN_FROM <= largest < PLAIN_TO else math.floor(math.log10(largest))
    places = max(1 - math.floor(math.log10(finest)) + power, 0)
    text = f"{value / 10.0**power:.{places}f}"
    if float(text) == 0:
        text = text.removeprefix("-")
    return text.replace("-", MINUS) + (TIMES + _power_of_ten(power) if power else "")


def signed(value: float, precision: float | None = None) -> str:
    """A difference, with its sign."""
    return f"+{number(value, precision)}" if value > 0 else number(value, precision)


def with_unit(text: str, unit: str) -> str:
    """A number with its unit, which is left out where it is 1."""
    return text if unit == "1" or text == UNDEFINED else f"{text} {unit_words(unit)}"


def unit_words(unit: str) -> str:
    """A unit with its powers raised: `m/s^2` as `m/s²`."""
    for plain, raised in UNIT_POWERS.items():
        unit = unit.replace(plain, raised)
    return unit


def typeset(text: str) -> str:
    """A sentence with raised powers and true minus signs where `1e-05` and `m/s^2` stand in it."""
    number_with_power = r"(?<![\w.-])(-?\d+(?:\.\d+)?)e([-+]\d+)\b"
    raised = re.sub(number_with_power, lambda it: it[1] + TIMES + _power_of_ten(int(it[2])), unit_words(text))
    return re.sub(r"(?<![\w.)])-(?=\d|[xy]\b)", MINUS, raised)


def estimate_words(estimate: Estimate) -> tuple[str, str]:
    """The mean with its unit, and the 95 % interval."""
    precision, values = (estimate.q975 - estimate.q025) / 4, (estimate.mean, estimate.q025, estimate.q975)
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    mean, low, high = (number(value, precision, beside=largest) for value in values)
    return with_unit(mean, estimate.unit), f"{low} to {high}"


def difference_words(gain: Gain) -> str:
    """The elpd difference with its standard error: `+231 ± 24`."""
    return _with_error(gain.elpd_difference, gain.elpd_se)


def tried_words(tried: TriedCause) -> str:
    """What a cause gains that was tried, with its standard error: `+3.1 ± 2.0`."""
    return _with_error(tried.gain, tried.gain_se)


def _with_error(value: float, error: float) -> str:
    return f"{signed(value, error)} ± {number(error)}"


def ratio_words(ratio: ErrorRatio) -> str:
    """An error as a share of that before, with its 95 % interval where there is one: `0.29 (0.21 to 0.43)`."""
    interval = "" if math.isnan(ratio.q025) else f" ({number(ratio.q025)} to {number(ratio.q975)})"
    return f"{number(ratio.ratio)}{interval}"


def told_gains(finding: Finding) -> list[tuple[str, Gain]]:
    """Gains that are told of, each with the words for what it is of: all named causes together first where several."""
    each = [(cause_title(cause), cause.gain) for cause in finding.named]
    return each if finding.gain is None or len(each) == 1 else [(TOGETHER, finding.gain), *each]


def bound_words(bound: UpperBound) -> str:
    """An upper bound with its unit, from where it counts if that is not 0, and where; or that there is none."""
    if bound.bound is None or not math.isfinite(bound.bound):
        return "no bound"
    if bound.measure is not None and bound.bound <= 0:
        return "no room for any"
    where = f" at {bound.told} of {bound.places} places, the others tell nothing" if bound.told < bound.places else ""
    remark = f", {bound.remark}" if bound.remark else ""
    return f"{_bound_size(bound)}{remark}{where}"


def _bound_size(bound: UpperBound) -> str:
    assert bound.bound is not None
    digits, times, power = number(bound.bound, bound.bound / 10).partition(TIMES)
    if "." in digits:
        digits = digits.rstrip("0").rstrip(".")
    size = with_unit(digits + times + power, bound.unit)
    if isinstance(bound.vanishes_at, str):
        return f"within {size} of the {title(bound.vanishes_at)}"
    return f"within {size} of {bound.vanishes_at:g}" if bound.vanishes_at else f"≤ {size}"


def chance(probability: float) -> str:
    """A probability in per cent, never certain."""
    return percent(min(max(probability, 1e-6), 1 - 1e-6))


def p_words(p_value: float) -> str:
    """A p-value: two digits, and a power of ten where it is small."""
    if not 0 <= p_value <= 1:
        return UNDEFINED
    if p_value < LEAST_P_VALUE:
        return f"< {_power_of_ten(round(math.log10(LEAST_P_VALUE)))}"
    if p_value >= 0.001:
        return f"{p_value:.2g}"
    digit, power = f"{p_value:.0e}".split("e")
    return digit + TIMES + _power_of_ten(int(power))


def length_unit(lengths: Iterable[float]) -> tuple[float, str]:
    """Unit in which some lengths (m) are well read, as its factor and its name."""
    largest = max((length for length in lengths if math.isfinite(length)), default=0.0)
    return next(
        (unit for unit in ((1.0, "m"), (1e3, "mm")) if largest * unit[0] >= 1 or largest == 0),
        (1e6, "µm"),
    )


def cause_title(cause: FoundCause | TriedCause | UpperBound) -> str:
    """Name of a cause as words, with the way in which it acts where that is a further one."""
    if cause.way is None or cause.way.endswith(cause.name):  # a second wall
        return title(cause.way or cause.name)
    return f"{title(cause.name)} by {title(cause.way)}"


def effect_of(name: str, model: PhysicsModel) -> Effect | type[Effect] | None:
    """The effect of a name, of a model or the catalogue; None for a stranger."""
    own = next((effect for effect in model.effects if effect.name == name), None)
    return own if own is not None else known_effects().get(name)


def leading_and_own(
    cause: FoundCause, effect: Effect | type[Effect] | None
) -> tuple[dict[str, Estimate], dict[str, Estimate]]:
    """Estimates of a cause that lead, and those of single bodies and videos where they are many and others lead."""
    scopes = {name: _scope(name, effect) for name in cause.parameters}
    own = {name: one for name, one in cause.parameters.items() if scopes[name] in (Scope.BODY, Scope.VIDEO)}
    if len(own) <= MOST_OF_SINGLES or not {Scope.SHARED, Scope.MATERIAL} & set(scopes.values()):
        return dict(cause.parameters), {}
    return {name: one for name, one in cause.parameters.items() if name not in own}, own


def own_words(own: Collection[str], effect: Effect | type[Effect] | None) -> str:
    """How many estimates belong to single bodies or videos, by their names."""
    of_videos = {_scope(name, effect) for name in own} == {Scope.VIDEO}
    return f"{counted(len(own), 'value')} of single {'videos' if of_videos else 'bodies'}"


def _scope(name: str, effect: Effect | type[Effect] | None) -> Scope | None:
    """What has one value each of a parameter of an effect, of which one value has a name."""
    plain = name.partition("[")[0]
    return next((one.scope for one in (() if effect is None else effect.parameters) if one.name == plain), None)


def parameter_words(name: str, effect: Effect | type[Effect] | None) -> str:
    """What a parameter is; one of a single thing, `ratio[metal]`, with that thing."""
    plain, _, which = name.partition("[")
    stated = () if effect is None else effect.parameters
    described = next((parameter.description for parameter in stated if parameter.name == plain), title(plain))
    return f"{described} ({which.removesuffix(']')})" if which else described


def _power_of_ten(power: int) -> str:
    return f"10{str(power).translate(SUPERSCRIPTS)}"
