"""What a fit says of the parameters of a cause, in their units, and how large a cause may be that was not named."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr
from scipy.stats import chi2

from vrdp_prob.discovery.candidates.scores import CauseScore, Largest, telling_rows
from vrdp_prob.discovery.finding import Estimate, UpperBound
from vrdp_prob.discovery.normal import WITHIN_95
from vrdp_prob.discovery.residuals.unexplained import Unexplained
from vrdp_prob.discovery.selection.reach import Reach, reaches
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.population import shared_sd
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.parameters import Transform, group_words
from vrdp_prob.scene import Tracks

CERTAIN = 0.95
"""Probability of the intervals."""
OF_BELIEVED_MASSES = "for masses of the scale that was believed"
"""What is said of a bound that goes with the scale of the masses, where none is stated."""


def estimates(
    fit: SharedFit,
    effect: Effect,
    *,
    unexplained: Unexplained | None = None,
    overdispersion: Float[np.ndarray, "video"] | None = None,
) -> dict[str, Estimate]:
    """Parameters of an effect by name, with the material, or the body and video, that each belongs to.

    Parameters
    ----------
    fit
        Fit of a model with the effect.
    effect
        The effect.
    unexplained
        What the fit leaves to chance, which widens what is known; nothing where None.
    overdispersion
        Further factor of each video by which variances are larger than what the likelihood says, shared numbers by
        their mean; 1 where None.
    """
    factors = np.ones(len(fit.videos)) if overdispersion is None else overdispersion
    wide = widened(shared_sd(fit), factors, unexplained)
    units = {parameter.name: parameter for parameter in effect.parameters}
    found: dict[str, Estimate] = {}
    joint, farther = fit.joint, reaches(fit, units, wide)
    for place, key in enumerate(joint.numbers.keys):
        if key[0] in units:
            words = group_words(key[1])
            name = f"{key[0]}[{words}]" if words else key[0]
            mean, sd = float(joint.gaussian.mean[place]), float(wide[place])
            transform, unit = units[key[0]].transform, units[key[0]].unit
            far = farther.get(place)
            gaussian = _estimate(transform, mean, sd, unit)
            found[name] = gaussian if far is None else _reaching(transform, gaussian, far)
    for index, video in enumerate(joint.videos):
        coordinates, point = video.likelihood.coordinates, joint.point(index)
        sd = np.sqrt(factors[index] * np.diag(np.linalg.inv(joint.precision(index))))
        if unexplained is not None:
            sd[list(unexplained.plain.videos[index].own_places)] *= unexplained.own_widening[index]
        for place in video.local_places:
            entry = coordinates.entries[place]
            if entry.field in units:
                body = "" if entry.owner is None else f"{video.likelihood.tracks.bodies[entry.owner].id} in "
                found[f"{entry.field}[{body}{video.name}]"] = _estimate(
                    entry.transform, float(point[place]), float(sd[place]), units[entry.field].unit
                )
        for (name, _), value in fit.structures[index].held.items():
            if name in effect.stepwise and value is not None:
                found[f"{name}[{video.name}]"] = _between_frames(value, video.likelihood.tracks, units[name].unit)
    return found


def widened(
    sd: Float[np.ndarray, "shared"], overdispersion: Float[np.ndarray, "video"], unexplained: Unexplained | None
) -> Float[np.ndarray, "shared"]:
    """Standard deviations of what videos share, with what a fit leaves to chance and the overdispersion of videos."""
    wider: np.ndarray = sd * np.sqrt(overdispersion.mean())
    return wider if unexplained is None else wider * unexplained.shared_widening


def may_vanish(
    fit: SharedFit, effect: Effect, *, unexplained: Unexplained, overdispersion: Float[np.ndarray, "video"]
) -> bool:
    """Whether what all videos share of an effect is no further from where it vanishes than chance would have it.

    It is not where that is infinitely far away, where only single videos tell, or where a strength reaches farther than
    its Gaussian, which then says nothing of where the strength is not. Of numbers that are told by their differences
    only these count: a friction that is less for every material alike is a friction of all.

    Parameters
    ----------
    fit
        Fit of a model with the effect.
    effect
        The effect.
    unexplained, overdispersion
        See `estimates`.
    """
    joint, vanishing = fit.joint, fit.vanishing([effect])
    strengths = [
        (place, entry.transform, vanishing[name])
        for place, ((name, _), entry) in enumerate(zip(joint.numbers.keys, joint.numbers.entries, strict=True))
        if name in vanishing
    ]
    if not strengths or any(transform is Transform.LOG and not value for _, transform, value in strengths):
        return False
    sd = widened(shared_sd(fit), overdispersion, unexplained)
    places = [place for place, *_ in strengths]
    telling = telling_rows([joint.numbers.keys[place][0] for place in places], effect)
    if not len(telling):
        return True
    away = telling @ (
        joint.gaussian.mean[places] - [transform.to_coordinate(value) for _, transform, value in strengths]
    )
    root = telling @ ((sd / joint.gaussian.sd)[places, None] * joint.gaussian.root[places])
    is_near = away @ np.linalg.solve(root @ root.T, away) < chi2.ppf(CERTAIN, len(away))
    return bool(is_near) and not reaches(fit, vanishing, sd)


def mass_scale_notes(effects: Iterable[Effect], videos: Iterable[Tracks]) -> Iterator[str]:
    """What limits what is told of parameters that show only as their ratio to the masses, where no mass is stated.

    Parameters
    ----------
    effects
        Effects whose parameters are told.
    videos
        What was seen.
    """
    if _weighed(videos):
        return
    for name in (one.name for effect in effects for one in effect.parameters if one.goes_with_masses):
        yield (
            f"No mass is stated, and only the ratio of {name.replace('_', ' ')} to the masses shows: what is told "
            "of it is for masses of the scale that was believed, and changes in proportion with it."
        )


def _estimate(transform: Transform, mean: float, sd: float, unit: str) -> Estimate:
    low, high = mean - WITHIN_95 * sd, mean + WITHIN_95 * sd
    if transform is Transform.IDENTITY:
        return Estimate(mean, sd, low, high, unit)
    middle = math.exp(mean + sd**2 / 2)
    return Estimate(middle, middle * math.sqrt(math.expm1(sd**2)), math.exp(low), math.exp(high), unit)


def _reaching(transform: Transform, gaussian: Estimate, far: Reach) -> Estimate:
    """An estimate of what reaches farther than a Gaussian says."""
    value = np.exp if transform is Transform.LOG else np.asarray
    low, high = (float(value(far.quantile(share))) for share in ((1 - CERTAIN) / 2, (1 + CERTAIN) / 2))
    mean, sd = far.moments(value)
    return Estimate(mean, max(sd, gaussian.sd), min(low, gaussian.q025), max(high, gaussian.q975), gaussian.unit)


def _between_frames(middle: float, tracks: Tracks, unit: str) -> Estimate:
    """A time of which only the two frames around it are known."""
    interval = float(np.median(np.diff(tracks.times)))
    half = CERTAIN * interval / 2
    return Estimate(middle, interval / math.sqrt(12), middle - half, middle + half, unit)


def surprise(fit: SharedFit, effect: Effect) -> float:
    """Probability that the shared parameters of an effect lie so far from what was expected of them, strengths aside.

    What the model has without the effect, as the drag that a wind acts by, does not count.
    A cause that holds another one as its limit takes its place with parameters far off: a bowl whose middle is far away
    is a slope. How strong a cause is may surprise. Source: prior-data conflict (Evans and Moshonov, Checking for
    prior-data conflict, Bayesian Analysis 1, 2006), with the most probable values in the place of the data.

    Parameters
    ----------
    fit
        Fit of a model with the effect.
    effect
        The effect.
    """
    joint = fit.joint
    others = {one.name for one in fit.model.without_effect(effect).parameters}
    left_out = {*effect.vanishes_at, *effect.vanishes_like, *others}
    priors = {one.name: fit.model.believed(one).prior for one in effect.parameters if one.name not in left_out}
    found = [
        (priors[key[0]], joint.gaussian.mean[place]) for place, key in enumerate(joint.numbers.keys) if key[0] in priors
    ]
    squares = sum(((float(mean) - prior.mean) / prior.sd) ** 2 for prior, mean in found)
    return float(chi2.sf(squares, len(found))) if found else 1.0


def has_sign_of_law(fit: SharedFit, effect: Effect, unexplained: Unexplained | None = None) -> float:
    """Probability that the strength of an effect has the sign of its law; 1 where it may have either or none.

    Parameters
    ----------
    fit
        Fit of a model with the effect.
    effect
        The effect.
    unexplained
        What the fit leaves to chance, which widens what is known.
    """
    if effect.sign_of_law is None:
        return 1.0
    strength = _strength(effect, estimates(fit, effect, unexplained=unexplained))
    return 1.0 if strength is None else float(ndtr(effect.sign_of_law * strength.mean / strength.sd))


def cause_sentence(effect: Effect, found: Mapping[str, Estimate]) -> str:
    """What a cause is, which way it acts where the data tell, and how strong it is."""
    sentence = _signed_sentence(effect, found).rstrip(".")
    shown = [name for name in found if name.split("[")[0] in {*effect.vanishes_at, *effect.vanishes_like}]
    parts = [f"{name} = {found[name].mean:.3g} ± {found[name].sd:.2g} {_unit(found[name].unit)}" for name in shown]
    return f"{sentence} ({'; '.join(part.strip() for part in parts)})." if parts else f"{sentence}."


def _signed_sentence(effect: Effect, found: Mapping[str, Estimate]) -> str:
    """The sentence for the sign of the strength, where its 95 % interval has but one."""
    strength = _strength(effect, found)
    if effect.signed_sentences is None or strength is None or strength.q025 <= 0 <= strength.q975:
        return effect.sentence
    positive, negative = effect.signed_sentences
    return positive if strength.mean > 0 else negative


def _strength(effect: Effect, found: Mapping[str, Estimate]) -> Estimate | None:
    """The strength of an effect that all videos share, if there is one."""
    return next((found[name] for name in effect.vanishes_at if name in found), None)


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def upper_bounds(
    effect: Effect, score: CauseScore | None, *, widening: float = 1.0, videos: Sequence[Tracks] = ()
) -> list[UpperBound]:
    """How large the strengths of a cause may be (95 %), at the place where most could have hidden.

    What stands in the way has no strength: of that it is said how large it may be without that any body has met it.

    Parameters
    ----------
    effect
        The cause.
    score
        What the residuals say of it; None where they say nothing, or it has no strength (a wall has none).
    widening
        Factor by which standard deviations are larger than the residuals say.
    videos
        What was seen; nothing is said of what stands in the way where there are none.
    """
    if videos and effect.overrides("unmet"):
        return [
            UpperBound(effect.cause_name(), name, one.size, "m", way=effect.way(), measure=one.words)
            for name, one in effect.unmet(videos).items()
        ]
    names = dict.fromkeys([*effect.vanishes_at, *effect.vanishes_like])
    if not names and effect.stepwise:
        return []  # tracks show it plainly, or not at all; its cause's other ways have bounds
    names = names or {effect.parameters[0].name: None}
    units = {parameter.name: parameter.unit for parameter in effect.parameters}
    unscaled = set() if _weighed(videos) else {one.name for one in effect.parameters if one.goes_with_masses}
    largest = {name: (score.largest if score else {}).get(name, Largest(None, 1, 0)) for name in names}
    return [
        UpperBound(
            effect.cause_name(),
            name,
            one.widened(widening),
            units[name],
            _nothing(effect, name),
            places=one.places,
            told=one.told,
            way=effect.way(),
            remark=OF_BELIEVED_MASSES if name in unscaled else effect.also_vanishes.get(name),
        )
        for name, one in largest.items()
    ]


def _weighed(videos: Iterable[Tracks]) -> bool:
    """Whether any mass is stated."""
    return any(body.mass is not None for tracks in videos for body in tracks.bodies)


def _nothing(effect: Effect, strength: str) -> float | str:
    """Where a strength does nothing: a value, or the parameter that it is then like."""
    return effect.vanishes_like.get(strength, effect.vanishes_at.get(strength, 0.0))
