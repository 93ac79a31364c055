"""Whether bodies in free flight are pushed by anything that the model lacks, and by what it depends on.

Each check asks for a few patterns of missing acceleration in all videos at once. In the linear model the amplitudes of
patterns are Gaussian under the fitted model; their chi-square is the limit of endlessly many replications.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vrdp_prob.discovery.checks.false_discovery import SEEN
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.free_flight import FreeFlight, Part
from vrdp_prob.discovery.residuals.look_elsewhere import anywhere
from vrdp_prob.discovery.words import by, direction_words, number, opposite
from vrdp_prob.scene import Shape

BESIDE = "Nothing is left of it beside"
"""How the sentence of a check begins that another check explains."""


@dataclass(frozen=True)
class Question:
    """A check of free flight.

    Parameters
    ----------
    name
        Its name.
    names, given
        The patterns it looks for, and those that may show besides.
    sentence
        What was seen.
    """

    name: str
    names: tuple[str, ...]
    sentence: Callable[[Part], str]
    given: tuple[str, ...] = ()


PUSH = ("push x", "push y")
SHAKING = "push against time"
DISTANCE = "the distance to other bodies"

QUESTIONS = (
    Question(
        "push in one direction",
        PUSH,
        lambda part: (
            f"bodies are pushed by {number(part.size)} m/s^2 towards {_direction(part, PUSH)}, the same everywhere"
        ),
    ),
    Question(
        "push against place",
        ("push x x", "push x y", "push y x", "push y y"),
        lambda part: (
            f"bodies are pushed by {number(part.size)} m/s^2 (root mean square) in directions that change "
            f"with the place: {_spreading(part)}"
        ),
        PUSH,
    ),
    Question(
        "push against speed",
        ("push x speed", "push y speed"),
        lambda part: (
            f"bodies are pushed towards {_direction(part, ('push x speed', 'push y speed'))}, the more the "
            f"faster they are: by {number(_length(part, ('push x speed', 'push y speed')))} m/s^2 per m/s"
        ),
        PUSH,
    ),
    Question(
        "acceleration along the velocity against speed",
        ("along speed", "along slowness"),
        lambda part: (
            f"along their velocity bodies are accelerated by {number(part.size)} m/s^2 (root mean square) "
            f"in a way that changes with speed: {_by_speed(part)}"
        ),
    ),
    Question(
        "acceleration along the velocity against the direction of motion",
        ("along cosine", "along sine", "across cosine", "across sine"),
        lambda part: (
            f"the resistance depends on the direction of motion, by {number(part.size)} m/s^2 (root mean square)"
        ),
    ),
    Question(
        "acceleration along the velocity against place",
        ("along x", "along y", "along distance"),
        lambda part: (
            f"along their velocity bodies are accelerated by {number(part.size)} m/s^2 (root mean square) in "
            f"a way that changes with the place: {_by_place(part, 'along')}"
        ),
    ),
    Question(
        "acceleration along the velocity against time",
        ("along time",),
        lambda part: (
            "along their velocity the acceleration of bodies changes in the course of the video, by "
            f"{by(part.estimate('along time'), 'm/s^2 per s')}"
        ),
    ),
    Question(
        "acceleration along the velocity against the way travelled",
        ("along way",),
        lambda part: (
            "along their velocity the acceleration of bodies changes with the way that they have travelled, "
            f"by {by(part.estimate('along way'), 'm/s^2 per m')}"
        ),
    ),
    Question(
        "acceleration along the velocity against spin",
        ("along spin",),
        lambda part: (
            "along their velocity bodies are accelerated the more they spin, by "
            f"{by(part.estimate('along spin'), 'm/s^2 per rad/s')}"
        ),
    ),
    Question(
        "acceleration along the velocity against shape",
        ("along cube",),
        lambda part: (
            f"cubes are slowed {opposite(part.estimate('along cube'), 'more', 'less')} than cylinders, by "
            f"{number(part.size)} m/s^2"
        ),
    ),
    Question(
        "acceleration along the velocity against material",
        ("along material",),
        lambda part: f"bodies of one material are slowed more than others, by {number(part.size)} m/s^2",
    ),
    Question(
        "acceleration along the velocity against mass",
        ("along mass",),
        lambda part: (
            f"heavy bodies are slowed {opposite(part.estimate('along mass'), 'more', 'less')} than light "
            f"ones, by {number(part.size)} m/s^2"
        ),
    ),
    Question(
        f"acceleration along the velocity against {DISTANCE}",
        ("along others",),
        lambda part: (
            f"near others bodies are {opposite(part.estimate('along others'), 'slowed', 'sped up')} along their "
            f"velocity, by {number(part.size)} m/s^2 (root mean square)"
        ),
    ),
    Question(
        "acceleration across the velocity against speed",
        ("across", "across speed"),
        lambda part: (
            f"bodies are pushed sideways by {number(part.size)} m/s^2 (root mean square): "
            f"{by(part.estimate('across'), 'm/s^2 to the left')} and {by(part.estimate('across speed'), 'per m/s')}"
        ),
    ),
    Question(
        "acceleration across the velocity against place",
        ("across speed x", "across speed y"),
        lambda part: (
            f"bodies are pushed sideways by {number(part.size)} m/s^2 (root mean square) in a way that "
            "changes with the place"
        ),
        ("across", "across speed"),
    ),
    Question(
        "acceleration across the velocity against time",
        ("across speed time",),
        lambda part: (
            f"bodies are pushed sideways in a way that changes in the course of the video, by "
            f"{number(part.size)} m/s^2 (root mean square)"
        ),
        ("across", "across speed"),
    ),
    Question(
        "acceleration across the velocity against spin",
        ("across speed spin",),
        lambda part: (
            "bodies that spin counter-clockwise are pushed to the "
            f"{opposite(part.estimate('across speed spin'), 'right', 'left')}, by "
            f"{number(abs(part.estimate('across speed spin')))} m/s^2 per m/s and rad/s"
        ),
    ),
    Question(
        "acceleration across the velocity against shape",
        tuple(f"across speed {shape}" for shape in Shape),
        lambda part: f"bodies of one shape are pushed sideways and others are not, {_sideways(part)}",
        ("across", "across speed"),
    ),
    Question(
        "acceleration across the velocity against material",
        ("across speed material",),
        lambda part: f"bodies of one material are pushed sideways and others are not, {_sideways(part)}",
        ("across", "across speed"),
    ),
    Question(
        "acceleration across the velocity against mass",
        ("across speed mass",),
        lambda part: (
            f"heavy bodies are pushed more to the {opposite(part.estimate('across speed mass'), 'right', 'left')} than "
            f"light ones, {_sideways(part)}"
        ),
        ("across", "across speed"),
    ),
    Question(
        f"acceleration across the velocity against {DISTANCE}",
        ("across others",),
        lambda part: (
            f"near others bodies are pushed to the {opposite(part.estimate('across others'), 'right', 'left')} of "
            f"their velocity, {_sideways(part)}"
        ),
        ("across", "across speed"),
    ),
    Question(
        f"acceleration against {DISTANCE}",
        ("others", "others square"),
        lambda part: f"bodies {_pull(part)} each other: {number(part.size)} m/s^2 (root mean square)",
    ),
)


def free_flight_checks(flight: FreeFlight) -> list[Check]:
    """All checks of free flight that these videos allow."""
    parts = [(question, flight.part(question.names, question.given)) for question in QUESTIONS]
    found = [(question, part, part.score.p_value) for question, part in parts if part.score.degrees]
    found += _shaking(flight)
    if not found:
        return []
    strongest = min(found, key=lambda one: one[2])[0]
    return [_check(flight, question, part, p_value, strongest) for question, part, p_value in found]


def _shaking(flight: FreeFlight) -> Iterator[tuple[Question, Part, float]]:
    """Whether the table shakes, at whatever frequency, in step with the start of the videos."""
    parts = {
        (name, frequency): flight.part(phases(name), PUSH) for name, frequency in flight.scales.frequencies.items()
    }
    known = {key: part for key, part in parts.items() if part.score.degrees}
    if not known:
        return
    name, frequency = min(known, key=lambda key: known[key].score.p_value)
    best = known[name, frequency]

    def sentence(part: Part) -> str:
        times = "once" if round(frequency, 1) == 1 else f"{number(frequency)} times"
        pushed = f"all bodies are pushed to and fro {times} a second, in step with the start of the videos,"
        return f"{pushed} by {number(part.size)} m/s^2 (root mean square)"

    question = Question(SHAKING, phases(name), sentence, PUSH)
    yield question, best, anywhere(best.score.p_value, len(known))


def phases(name: str) -> tuple[str, ...]:
    """Names of the patterns of shaking at one frequency."""
    return tuple(f"{name} {phase} {axis}" for phase in ("cosine", "sine") for axis in "xy")


def _check(flight: FreeFlight, question: Question, part: Part, p_value: float, strongest: Question) -> Check:
    """A check with what was seen, and whether the strongest one is enough to explain it."""
    if p_value >= SEEN:
        sentence = f"Nothing seen; {number(part.visible)} m/s^2 would have shown."
    else:
        found = question.sentence(part)
        sentence = f"{found[0].upper()}{found[1:]}."
        given = {*question.given, *strongest.names}
        if question is not strongest and flight.part(question.names, tuple(given)).score.p_value >= SEEN:
            sentence += f" {BESIDE} what was found for '{strongest.name}'."
    return Check(question.name, part.size, p_value, False, sentence)


def _length(part: Part, names: Sequence[str]) -> float:
    return float(np.linalg.norm([part.estimate(name) for name in names]))


def _direction(part: Part, names: Sequence[str]) -> str:
    x, y = (part.estimate(name) for name in names)
    return direction_words(x, y)


def _by_place(part: Part, what: str) -> str:
    """How fast something changes along each axis along which bodies move."""
    shown = {one.name for one in part.patterns}
    return ", ".join(
        by(part.estimate(f"{what} {axis}"), f"m/s^2 per m along {axis}") for axis in "xy" if f"{what} {axis}" in shown
    )


def _spreading(part: Part) -> str:
    if {f"push {a} {b}" for a in "xy" for b in "xy"} - {one.name for one in part.patterns}:
        return " and ".join(f"towards {towards} {_by_place(part, f'push {towards}')}" for towards in "xy")
    xx, xy, yx, yy = (part.estimate(f"push {a} {b}") for a in "xy" for b in "xy")
    away, turn = (xx + yy) / 2, (yx - xy) / 2
    outward = opposite(away, "towards a middle", "away from a middle")
    around = opposite(turn, "clockwise", "counter-clockwise")
    return f"{number(abs(away))} m/s^2 per m {outward}, {number(abs(turn))} m/s^2 per m around it {around}"


def _sideways(part: Part) -> str:
    return f"by {number(part.size)} m/s^2 (root mean square)"


def _by_speed(part: Part) -> str:
    return by(part.estimate("along speed"), "m/s^2 per m/s") + (
        f", and {by(part.estimate('along slowness'), 'm/s^2 near rest')}"
    )


def _pull(part: Part) -> str:
    found = part.fields @ part.score.estimate
    toward = part.fields.sum(axis=2)
    return opposite(float((found * toward).sum()), "repel", "attract")
