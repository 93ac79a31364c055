"""Findings made by hand, one of every kind, for what a reader and a program see of them."""

from dataclasses import replace

import numpy as np

from vrdp_prob.discovery.finding import (
    Check,
    ComparedAnswer,
    ComparedOption,
    Description,
    Estimate,
    Finding,
    FoundCause,
    Gain,
    HeldOut,
    TriedCause,
    UpperBound,
    Verdict,
    VideoErrors,
)
from vrdp_prob.discovery.selection.forecast import error_ratios
from vrdp_prob.models.effects.contact_friction import ContactFriction
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.physics import PhysicsModel

VIDEOS = tuple(f"run_{number:02d}" for number in range(12))
BASE = PhysicsModel.base()
ALONG = "Acceleration along the velocity, against speed"
DIRECTION = "Acceleration in one direction of the table"
SPIN_CHANGE = "Spin after a contact, against its normal impulse"


def held_out(millimetres: float, coverage: tuple[float, float]) -> HeldOut:
    """A prediction whose error, beyond a noise of 3 mm, is half as large one second ahead and doubled at the end.

    The last two videos end before one second.
    """
    excess = (millimetres**2 - 9.0) ** 0.5
    half, most = coverage
    known = (0.0, (1 - most) / 2, (1 - half) / 2, (1 + half) / 2, (1 + most) / 2, 1.0)
    tenths = np.diff(np.interp(np.linspace(0.0, 1.0, 11), (0.0, 0.05, 0.25, 0.75, 0.95, 1.0), known))
    whole, ahead, end = (float(np.hypot(3.0, factor * excess)) / 1000 for factor in (1.0, 0.5, 2.0))
    by_video = tuple(
        VideoErrors(share * whole, share * ahead if index < len(VIDEOS) - 2 else None, share * end)
        for index, share in enumerate(np.geomspace(0.6, 1.7, len(VIDEOS)) ** (millimetres / 10))
    )
    return HeldOut(whole, ahead, end, *coverage, tuple(tenths.tolist()), by_video)


def gain(before: HeldOut, after: HeldOut, total: float, *, seed: int, videos: tuple[str, ...] = VIDEOS) -> Gain:
    """A gain whose differences of single videos add up to a total."""
    share = np.random.default_rng(seed).gamma(3.0, size=len(videos)) - 0.6
    by_video = dict(zip(videos, (total * share / share.sum()).tolist(), strict=True))
    spread = float(np.std(list(by_video.values()), ddof=1) * len(videos) ** 0.5)
    return Gain(before, after, 0.003, total, spread, by_video, error_ratios(before, after))


WORST = held_out(12.3, (0.21, 0.48))
BETTER = held_out(5.9, (0.38, 0.77))
BEST = held_out(3.4, (0.49, 0.9))

TILT = FoundCause(
    "surface_tilt",
    0.9991,
    "The table slopes by 0.15 degrees (0.13 to 0.17), down towards x = 0.83, y = -0.56.",
    {
        "tilt_x": Estimate(0.002172, 0.000148, 0.00188, 0.002463, "1"),
        "tilt_y": Estimate(-0.001466, 0.000151, -0.001762, -0.001169, "1"),
    },
    gain(WORST, BETTER, 231.4, seed=1),
    named=True,
)
RUBBING = FoundCause(
    "contact_friction",
    0.94,
    "Bodies that touch rub on each other, with a friction coefficient of 0.18 (0.15 to 0.21). "
    "Nine of the twelve contacts stick.",
    {"contact_friction": Estimate(0.1812, 0.0151, 0.1526, 0.2118, "1")},
    gain(BETTER, BEST, 87.2, seed=2),
    named=True,
)
WIND = FoundCause(
    "wind",
    0.31,
    "The air moves at 0.42 m/s (0.2 to 0.9) towards x = 0.8, y = -0.6.",
    {"wind_x": Estimate(0.34, 0.16, 0.11, 0.74, "m/s"), "wind_y": Estimate(-0.25, 0.12, -0.55, -0.08, "m/s")},
    gain(WORST, held_out(6.4, (0.36, 0.74)), 214.9, seed=3),
    named=False,
)
LENS = FoundCause(
    "lens_distortion",
    0.004,
    "The lens displaces positions by 0.1 % of their distance from its middle, times the distance in m squared.",
    {"distortion": Estimate(0.0011, 0.0009, -0.0006, 0.0029, "1/m^2")},
    gain(WORST, held_out(12.2, (0.21, 0.49)), 2.2, seed=4),
    named=False,
)

CHECKS = (
    Check(
        ALONG,
        1.1,
        0.27,
        significant=False,
        sentence="Bodies are slowed at every speed as friction and drag of the model say.",
    ),
    Check(
        DIRECTION,
        212.0,
        3.1e-38,
        significant=True,
        sentence="All bodies are drawn towards x = 0.8, y = -0.5 with 0.026 m/s², wherever they are.",
    ),
    Check(
        SPIN_CHANGE,
        19.2,
        0.00021,
        significant=True,
        sentence="Contacts change the spin by up to 4 rad/s; the model has no spin change for discs.",
    ),
    Check(
        "Acceleration against the place on the table",
        5.2,
        0.081,
        significant=False,
        sentence="No place of the table differs from the others.",
    ),
    Check(
        "Speed of parting against speed of approach",
        2.2,
        0.0107,
        significant=False,
        sentence="The restitution is the same for slow and fast contacts.",
    ),
    Check(
        "Shift of a video's time stamps",
        0.2,
        0.84,
        significant=False,
        sentence="Time stamps and motion agree to 1 ms.",
    ),
)
CHECKS_AFTER = (
    replace(CHECKS[0], p_value=0.41),
    replace(CHECKS[1], p_value=0.62, significant=False, sentence="Nothing is left in any direction."),
    replace(CHECKS[2], p_value=0.0043, significant=True, sentence="Slow contacts still change the spin too much."),
    replace(CHECKS[3], p_value=0.19),
    replace(CHECKS[4], p_value=0.022),
    replace(CHECKS[5], p_value=0.83),
)
BOUNDS = (
    UpperBound("linear_drag", "linear_drag", 0.0123, "1/s"),
    UpperBound("bowl", "bowl_stiffness", 0.0046, "1/s^2"),
    UpperBound("pair_force", "pair_strength", 0.00000082, "N m^2"),
    UpperBound("material_friction", "material_friction_ratio[metal]", 1.04, "1"),
    UpperBound("external_impulse", "impulse_x", 0.021, "m/s"),
    UpperBound("external_impulse", "impulse_y", 0.018, "m/s"),
    UpperBound("magnus_curl", "curl", None, "1"),
)
TRIED = (
    TriedCause("pair_force", 4.2, 3.1, 5.99, 0.21, 0.8, "it gains too little"),
    TriedCause("friction_patch", -1.3, 0.6, 5.99, 0.0003, 0.8, "it gains too little"),
)
NOTES = ("Two videos end before 1 s; their errors at 1 s are not counted.",)


def named() -> Finding:
    """Two causes, and one that is easily taken for the first."""
    return Finding(
        Verdict.NAMED,
        (TILT, RUBBING, WIND, LENS),
        CHECKS,
        CHECKS_AFTER,
        BOUNDS,
        BASE,
        BASE.with_effect(SurfaceTilt()).with_effect(ContactFriction()),
        VIDEOS,
        notes=NOTES,
        gain=gain(WORST, BEST, 318.6, seed=6),
    )


def nothing() -> Finding:
    """A model that explains its data."""
    tilt = UpperBound("surface_tilt", "tilt_x", 0.00031, "1"), UpperBound("surface_tilt", "tilt_y", 0.00028, "1")
    calm = tuple(replace(check, p_value=0.1 + check.p_value / 2, significant=False) for check in CHECKS)
    return Finding(Verdict.NONE, (LENS,), calm, calm, (*tilt, *BOUNDS), BASE, BASE, VIDEOS[:3])


def unknown() -> Finding:
    """Something that no cause of the catalogue explains."""
    description = Description(
        "a_x = 0.041 sin(6.2 t) - 0.11 v_y\na_y = 0.11 v_x",
        0.61,
        0.052,
        (
            "It swings with a period of 1.0 s and grows with speed.",
            "It points across the velocity and is the same for all bodies.",
        ),
        "J = 0.12 J_n s",
        0.34,
    )
    return Finding(
        Verdict.UNKNOWN,
        (replace(WIND, probability=0.22), LENS),
        CHECKS,
        CHECKS,
        BOUNDS,
        BASE,
        BASE,
        VIDEOS,
        description=description,
        tried=TRIED,
        predicted=WORST,
        noise=0.003,
        notes=("The formula was chosen among 24 terms by its error in held-out videos.",),
    )


def with_a_rest() -> Finding:
    """Two causes, and something beside them that no cause explains."""
    halved = tuple(replace(one, probability=one.probability / 2) for one in named().causes)
    return replace(named(), verdict=Verdict.UNKNOWN, causes=halved, description=unknown().description)


def with_many_videos(number: int = 62) -> Finding:
    """One cause in many videos, of which some are predicted worse with it."""
    videos = tuple(f"shot_{index:03d}" for index in range(number))
    found = replace(TILT, gain=gain(WORST, BETTER, 412.0, seed=5, videos=videos))
    return replace(named(), causes=(found,), extended=BASE.with_effect(SurfaceTilt()), videos=videos)


def at_its_limits() -> Finding:
    """Numbers that are not defined or not finite, and text that is no HTML."""
    nowhere = HeldOut(float("inf"), None, float("nan"), float("nan"), 0.0)
    hopeless = Gain(nowhere, WORST, 0.0, float("inf"), float("nan"), dict.fromkeys(VIDEOS, float("inf")))
    parameters = {
        "tilt_x": Estimate(float("nan"), float("inf"), -float("inf"), float("inf"), "1"),
        "tilt_y": Estimate(0.0, 0.0, 0.0, 0.0, "1"),
    }
    cause = replace(
        TILT, probability=1.0, gain=hopeless, parameters=parameters, sentence="Angles <b>&</b> signs stand here"
    )
    checks = (Check("a < b", float("nan"), float("nan"), significant=False, sentence="</script>"),)
    checks += (replace(CHECKS[1], p_value=0.0),)
    bounds = (UpperBound("own_effect", "own_parameter", float("inf"), "<m>"),)
    return replace(named(), causes=(cause,), checks=checks, checks_after=(), upper_bounds=bounds)


ANSWERS = (
    ComparedAnswer(
        "run_03",
        "What shape is the object that stops first?",
        (
            ComparedOption("cube", 0.64, 0.21, chosen_before=True, chosen_after=False, right=False),
            ComparedOption("sphere", 0.36, 0.79, chosen_before=False, chosen_after=True, right=True),
        ),
    ),
    ComparedAnswer(
        "run_05",
        "What will happen next?",
        (
            ComparedOption("The cube hits the sphere", 0.91, 0.62, chosen_before=True, chosen_after=True, right=True),
            ComparedOption("The discs collide", 0.05, 0.02, chosen_before=False, chosen_after=False, right=False),
        ),
    ),
    ComparedAnswer(
        "run_05",
        "How many collisions happen?",
        (
            ComparedOption("2", 0.98, 0.97, chosen_before=True, chosen_after=True, right=False),
            ComparedOption("3", 0.02, 0.03, chosen_before=False, chosen_after=False, right=True),
        ),
    ),
)


def with_answers() -> Finding:
    """Two causes, and what they change in the answers to three questions."""
    return replace(named(), answers=ANSWERS)


EVERY_KIND = {
    "named": named,
    "nothing": nothing,
    "unknown": unknown,
    "with_a_rest": with_a_rest,
    "with_many_videos": with_many_videos,
    "at_its_limits": at_its_limits,
    "with_answers": with_answers,
}
