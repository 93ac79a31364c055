"""What discovery found: the verdict, the causes with their probabilities and gains, the evidence and the bounds."""

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.models.physics import PhysicsModel


class Verdict(StrEnum):
    """How the search ended."""

    NONE = "none"
    """The model explains the data."""
    NAMED = "named"
    """Causes of the catalogue explain what the model does not."""
    UNKNOWN = "unknown"
    """Something is wrong that no cause of the catalogue explains."""


@dataclass(frozen=True)
class Estimate:
    """What the data say of one parameter, in its unit.

    Parameters
    ----------
    mean, sd
        Of the posterior.
    q025, q975
        Ends of its middle 95 %.
    unit
        Unit of all four.
    """

    mean: float
    sd: float
    q025: float
    q975: float
    unit: str


@dataclass(frozen=True)
class VideoErrors:
    """Root mean square error (m, per axis) of what is predicted of one video; None where nothing is.

    Parameters
    ----------
    rmse, rmse_one_second, rmse_end
        Over all frames that are predicted, one second after the last that is fitted, and in the last ones.
    """

    rmse: float | None
    rmse_one_second: float | None
    rmse_end: float | None


@dataclass(frozen=True)
class HeldOut:
    """How well a model predicts videos that it was not fitted to.

    Parameters
    ----------
    rmse, rmse_one_second, rmse_end
        Root mean square error (m, per axis) of predicted positions in the video in the middle, half of the others being
        better: over all frames that are predicted, one second after the last that is fitted, and in the last ones; None
        where
        no video is so long. A single video in which two bodies just miss each other says nothing here, and much in the
        log predictive density.
    coverage_50, coverage_90
        Share of the observations in the middle 50 % and 90 % of their predictive distributions.
    pit
        Shares of the observations (per axis) in the tenths of their predictive distributions, the lowest first: the
        histogram of the probability integral transform, flat where the model is right; empty where nothing is
        predicted.
    by_video
        The errors of the single videos.
    """

    rmse: float
    rmse_one_second: float | None
    rmse_end: float | None
    coverage_50: float
    coverage_90: float
    pit: tuple[float, ...] = ()
    by_video: tuple[VideoErrors, ...] = ()


@dataclass(frozen=True)
class ErrorRatio:
    """An error with a cause as a share of that without it.

    Parameters
    ----------
    ratio
        Of the video in the middle, half of the others being better.
    q025, q975
        Ends of its 95 % interval over videos; NaN where too few videos tell of it.
    """

    ratio: float
    q025: float
    q975: float


@dataclass(frozen=True)
class Gain:
    """How much better a model predicts whole videos that it was not fitted to, with a cause or with several.

    Parameters
    ----------
    before, after
        Prediction without and with what it is the gain of.
    noise
        Standard deviation (m) of the measurement noise, below which no error can fall.
    elpd_difference, elpd_se
        Difference of the expected log predictive density (nats, summed over the videos), and its standard error over
        videos.
    by_video
        The differences of the single videos.
    error_ratios
        By the name of an error (of `HeldOut`): what it is in units of that before; without those of which too few
        videos tell.
    """

    before: HeldOut
    after: HeldOut
    noise: float
    elpd_difference: float
    elpd_se: float
    by_video: Mapping[str, float]
    error_ratios: Mapping[str, ErrorRatio] = field(default_factory=dict)


@dataclass(frozen=True)
class FoundCause:
    """A cause of the catalogue that was looked at closely.

    Parameters
    ----------
    name
        Its name in the catalogue.
    probability
        That it is part of what the model lacks.
    sentence
        What it is and how strong, for a reader.
    parameters
        What the data say of its parameters.
    gain
        What it adds to the prediction of held-out videos.
    named
        Whether it is part of the extended model.
    way
        Name of the effect, where that is a further way in which the cause acts; None where it is the cause itself.
    """

    name: str
    probability: float
    sentence: str
    parameters: Mapping[str, Estimate]
    gain: Gain
    named: bool
    way: str | None = None

    @property
    def effect(self) -> str:
        """Name of the effect as which it is part of a model."""
        return self.way or self.name


@dataclass(frozen=True)
class TriedCause:
    """A cause that was tried and not established, so that it is told of nowhere else.

    Parameters
    ----------
    name
        Its name in the catalogue.
    gain, gain_se
        Difference of the log predictive density of left-out videos (nats) that it brings, and its standard error.
    gain_needed
        What it would have to bring.
    probability, probability_needed
        Against the model without it, and what that would have to be.
    why
        What speaks against it, as a clause for a reader.
    way
        As for a cause that was found.
    """

    name: str
    gain: float
    gain_se: float
    gain_needed: float
    probability: float
    probability_needed: float
    why: str
    way: str | None = None


@dataclass(frozen=True)
class Check:
    """A test of what a model leaves unexplained.

    Parameters
    ----------
    name
        What was tested, for example `acceleration along the velocity against speed`.
    statistic
        The test statistic, in the units that `sentence` explains.
    p_value
        Probability of a statistic at least as extreme if the model is right.
    significant
        Whether it counts after false discovery rate control over all checks.
    sentence
        What was seen, for a reader.
    rival
        What else would leave the same, in a sentence; empty where nothing is known that would, or the videos tell.
    log_p_value
        Natural logarithm of the p-value of a test in units of the noise, which may be smaller than any number of the
        machine; else None.
    """

    name: str
    statistic: float
    p_value: float
    significant: bool
    sentence: str
    rival: str = ""
    log_p_value: float | None = None

    @property
    def nats(self) -> float:
        """What it tells against the model, by its p-value."""
        return -(math.log(max(self.p_value, sys.float_info.min)) if self.log_p_value is None else self.log_p_value)

    def nats_with_noise(self, share: float) -> float:
        """What it would tell if the model believed in a share of its noise; as much of a test that asks for none."""
        return self.nats if self.log_p_value is None else self.nats / share**2


@dataclass(frozen=True)
class UpperBound:
    """The largest strength of a cause that could have hidden (95 %).

    That of a cause that happens once is for the time at which it fits best: just before the end anything could hide.

    Parameters
    ----------
    name, parameter
        The cause and its parameter.
    bound, unit
        How far the parameter may be from where the cause does nothing, at the place where it may be farthest of those
        that tell anything; None where the data put no bound on it, or where something is left that may be hiding any.
    vanishes_at
        Where that is: a value, or the name of the parameter that it is then equal to.
    places, told
        Number of places (points of a search, bodies or videos) at which it was looked for, and of those that tell
        anything: nobody was at the others.
    way
        Name of the effect that has the parameter, where that is a further way in which the cause acts.
    remark
        What goes with it, in words that follow it: where else nothing would have been seen of the cause, or for which
        masses it holds.
    measure
        What is bounded where that is not how far the parameter is from where the cause does nothing: of something in
        the way, how large it may be without that any body has met it.
    """

    name: str
    parameter: str
    bound: float | None
    unit: str
    vanishes_at: float | str = 0.0
    places: int = 1
    told: int = 1
    way: str | None = None
    remark: str | None = None
    measure: str | None = None


@dataclass(frozen=True)
class Description:
    """What is known of an effect that no cause of the catalogue explains: a description, not a cause.

    Parameters
    ----------
    formula
        Sparse formula of the missing acceleration.
    explained
        Share of the missing acceleration's variance in held-out videos that the formula explains.
    size
        Root mean square of the missing acceleration (m/s^2); None where none shows.
    sentences
        Where, when and how it shows.
    contact_formula, contact_explained
        Sparse formula of the impulse that is missing at contacts, beside the formula of free flight; and the share
        that it explains, in held-out videos, of all that this leaves beyond noise. Empty and 0 where none does.
    """

    formula: str
    explained: float
    size: float | None
    sentences: tuple[str, ...]
    contact_formula: str = ""
    contact_explained: float = 0.0

    @property
    def has_formula(self) -> bool:
        """Whether the formula explains anything."""
        return self.explained > 0


@dataclass(frozen=True)
class ComparedOption:
    """What may be answered to a question: a value, or one of its choices.

    Parameters
    ----------
    words
        The value or the choice.
    before, after
        Its probability under the model that was given and under the extended one; of a choice, that it is correct.
    chosen_before, chosen_after
        Whether it is (part of) the answer.
    right
        Whether it should be; None where that is not known.
    """

    words: str
    before: float
    after: float
    chosen_before: bool
    chosen_after: bool
    right: bool | None = None


@dataclass(frozen=True)
class ComparedAnswer:
    """The answer to a question about one of the videos, by the model that was given and by the extended one.

    Parameters
    ----------
    video, question
        The video, and the question in English.
    options
        What may be answered.
    """

    video: str
    question: str
    options: tuple[ComparedOption, ...]

    @property
    def differs(self) -> bool:
        """Whether the models give different answers."""
        return any(option.chosen_before != option.chosen_after for option in self.options)

    @property
    def change(self) -> float:
        """The largest change of a probability."""
        return max((abs(option.after - option.before) for option in self.options), default=0.0)

    @property
    def right(self) -> tuple[bool, bool] | None:
        """Whether either answer is right; None where that is not known."""
        if any(option.right is None for option in self.options):
            return None
        before = all(option.chosen_before == option.right for option in self.options)
        return before, all(option.chosen_after == option.right for option in self.options)


@dataclass(frozen=True)
class Finding:
    """What the simulation gets wrong in some videos.

    Parameters
    ----------
    verdict
        How the search ended.
    causes
        Causes that were looked at closely, the most probable first; those that are part of the extended model lead.
    checks
        Tests of the model that was given, and `checks_after` of the extended one.
    upper_bounds
        Of every cause that `causes` does not tell of; strengths have none where something is left that no cause
        explains, which may be hiding any of them.
    model, extended
        The model that was given, and the same with the named causes for further videos of the same table: it believes
        what the videos say of what they share, and of single bodies (masses, restitutions, frictions) what they say of
        all of them, where these are enough. What happened once in a video, a kick or lost frames, is no part of it.
    description
        Of what is left unexplained; None where nothing is.
    videos
        Names of the videos.
    notes
        Limits of the result, in sentences.
    figures
        What the model misses, and the extended one: an SVG element as text by its title. One whose root has the class
        `themed` uses the page's colours (`var(--ink)`, `var(--accent)`, ...); any other stands on white.
    tried
        Further causes that were tried on the extended model and not established.
    gain
        What all named causes together add to the prediction of held-out videos, over the model that was given; None
        where nothing is named.
    predicted, noise
        How well the model that was given predicts held-out videos, and the noise (m) that is part of its errors; None
        for a finding that was put together by hand.
    answers
        Answers to questions about the videos under both models; None where nothing was asked or nothing is named.
    fit
        The joint fit of the model with all named causes, for what videos say together
        (`vrdp_prob.inference.several_videos`); None for a finding that was put together by hand.
    left_out
        By the name of a video: both models, believing what the other videos say, for that video itself.
    """

    verdict: Verdict
    causes: tuple[FoundCause, ...]
    checks: tuple[Check, ...]
    checks_after: tuple[Check, ...]
    upper_bounds: tuple[UpperBound, ...]
    model: PhysicsModel
    extended: PhysicsModel
    videos: tuple[str, ...]
    description: Description | None = None
    notes: tuple[str, ...] = ()
    figures: Mapping[str, str] = field(default_factory=dict)
    answers: tuple[ComparedAnswer, ...] | None = None
    fit: SharedFit | None = None
    left_out: Mapping[str, tuple[PhysicsModel, PhysicsModel]] = field(default_factory=dict)
    tried: tuple[TriedCause, ...] = ()
    gain: Gain | None = None
    predicted: HeldOut | None = None
    noise: float | None = None

    @property
    def named(self) -> tuple[FoundCause, ...]:
        """The causes that are part of the extended model."""
        return tuple(cause for cause in self.causes if cause.named)
