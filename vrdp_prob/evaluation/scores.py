"""Scores of many judgements: accuracy, proper scores, and whether probabilities mean what they say.

Sources: Brier, Verification of forecasts expressed in terms of probability, Monthly Weather Review 78 (1950); Naeini,
Cooper and Hauskrecht, Obtaining well calibrated probabilities using Bayesian binning, AAAI (2015); Broecker and Smith,
Increasing the reliability of reliability diagrams, Weather and Forecasting 22 (2007).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from vrdp_prob.evaluation.judgement import Judgement

BINS = 10
"""Bins of equal width for the expected calibration error."""
SMALLEST_PROBABILITY = 0.001
"""Probabilities are held above this in the log score: a finite number of draws cannot tell a smaller one from 0."""
REPLICATIONS = 2000
"""Replications of calibrated outcomes, and of scenes in the bootstrap."""
COVERAGES = np.linspace(0.1, 1.0, 10)
"""Shares of the questions that are answered, the surest first."""


OfScenes = Sequence[tuple[str, Sequence[float]]]
"""Values of judgements, each with the scene that it is about."""


@dataclass(frozen=True)
class Interval:
    """The middle 95 % of a score when scenes are drawn anew."""

    low: float
    high: float


@dataclass(frozen=True)
class Bin:
    """Forecasts of similar probability, and how often what they say was so.

    Parameters
    ----------
    count
        Number of forecasts.
    forecast
        Their mean probability.
    observed
        Share in which it was so.
    low, high
        The middle 90 % of that share if the forecasts are calibrated.
    """

    count: int
    forecast: float
    observed: float
    low: float
    high: float


@dataclass(frozen=True)
class Scores:
    """Scores of the questions of one kind; None where nothing was asked.

    Parameters
    ----------
    questions, options
        Their numbers; open questions have no options.
    accuracy_per_option
        Share of options judged right.
    accuracy_per_question
        Share of questions answered right as a whole.
    brier
        Mean squared error of the probability of each option; of open questions half the squared error summed over all
        answers. 0 is perfect, and a probability of one half of an option costs 0.25.
    log_score
        Mean logarithm (nats) of the probability given to what is true, held above 0.001; 0 is perfect.
    ece
        Expected calibration error: mean distance between probability and share, in ten bins. Forecasts are the options'
        probabilities, and of open questions the probability of the answer given.
    ece_if_calibrated_q95
        Its 95 % quantile for outcomes drawn independently with these very probabilities.
    intervals
        Bootstrap intervals over scenes of accuracies and the Brier score, by their names; none of a single scene.
    reliability
        The bins of the expected calibration error that hold anything.
    abstention
        Accuracy per question of the surest 10, 20, ... 100 % of the questions.
    refused
        Number of questions that got no answer; they count as wrong.
    """

    questions: int
    options: int
    accuracy_per_option: float | None
    accuracy_per_question: float | None
    brier: float | None
    log_score: float | None
    ece: float | None
    ece_if_calibrated_q95: float | None
    intervals: dict[str, Interval]
    reliability: tuple[Bin, ...]
    abstention: tuple[float, ...]
    refused: int

    @classmethod
    def of(cls, judgements: Sequence[Judgement], *, seed: int = 0) -> "Scores":
        """Score judgements.

        Parameters
        ----------
        judgements
            What was judged.
        seed
            Seed of the bootstrap and of calibrated outcomes.
        """
        if not judgements:
            return cls(0, 0, None, None, None, None, None, None, {}, (), (), 0)
        generator = np.random.default_rng(seed)
        forecast, outcome = _forecasts(judgements)
        q95, bands = _if_calibrated(forecast, generator)
        measures = {"accuracy_per_option": _per_option, "accuracy_per_question": _per_question, "brier": _brier}
        values = {name: [(one.scene, measure(one)) for one in judgements] for name, measure in measures.items()}
        return cls(
            questions=len(judgements),
            options=sum(len(judgement.choices) for judgement in judgements),
            accuracy_per_option=_mean(values["accuracy_per_option"]),
            accuracy_per_question=_mean(values["accuracy_per_question"]),
            brier=_mean(values["brier"]),
            log_score=_mean([(one.scene, _log_score(one)) for one in judgements]),
            ece=calibration_error(forecast, outcome),
            ece_if_calibrated_q95=q95,
            intervals={name: found for name, given in values.items() if (found := bootstrap(given, generator))},
            reliability=_reliability(forecast, outcome, bands),
            abstention=_abstention(judgements),
            refused=sum(judgement.refused is not None for judgement in judgements),
        )


def brier_gain(
    ours: Sequence[Judgement], other: Sequence[Judgement], *, seed: int = 0
) -> tuple[float, Interval | None]:
    """How much lower the Brier score of one set of judgements is than that of another on the same questions.

    The interval is None where all questions are about a single scene.

    Parameters
    ----------
    ours, other
        Judgements of the same questions in the same order.
    seed
        Seed of the bootstrap over scenes.
    """
    gains = [
        (mine.scene, [b - a for a, b in zip(_brier(mine), _brier(its), strict=True)])
        for mine, its in zip(ours, other, strict=True)
    ]
    mean = _mean(gains)
    return np.nan if mean is None else mean, bootstrap(gains, np.random.default_rng(seed))


def calibration_error(forecast: Float[np.ndarray, "forecast"], outcome: Bool[np.ndarray, "forecast"]) -> float:
    """Mean distance between probability and share of what was so, in bins of equal width, weighted by their counts."""
    place = _bin_of(forecast)
    difference = np.bincount(place, weights=forecast - outcome, minlength=BINS)
    return float(np.abs(difference).sum() / len(forecast))


def bootstrap(values: OfScenes, generator: np.random.Generator) -> Interval | None:
    """Interval of the mean of values of scenes when scenes are drawn anew; None without values of two scenes at least.

    Questions about one scene share its posterior, so scenes are what is independent: one alone tells no spread.
    """
    by_scene: dict[str, list[float]] = {}
    for scene, given in values:
        by_scene.setdefault(scene, []).extend(given)
    sums = np.array([sum(given) for given in by_scene.values()])
    counts = np.array([len(given) for given in by_scene.values()])
    if (counts > 0).sum() < 2:
        return None
    chosen = generator.integers(len(sums), size=(REPLICATIONS, len(sums)))
    total = counts[chosen].sum(axis=1)
    means = sums[chosen].sum(axis=1)[total > 0] / total[total > 0]
    low, high = np.quantile(means, (0.025, 0.975))
    return Interval(float(low), float(high))


def _forecasts(
    judgements: Sequence[Judgement],
) -> tuple[Float[np.ndarray, "forecast"], Bool[np.ndarray, "forecast"]]:
    """What the answers say as probabilities of yes, and whether it was so."""
    forecasts: list[tuple[float, bool]] = []
    for judgement in judgements:
        forecasts += judgement.choices or [(judgement.confidence, judgement.right)]
    return np.array([float(p) for p, _ in forecasts]), np.array([bool(right) for _, right in forecasts])


def _per_question(one: Judgement) -> list[float]:
    return [float(one.right)]


def _per_option(one: Judgement) -> list[float]:
    return [float(one.refused is None and (probability > 0.5) == right) for probability, right in one.choices]


def _brier(one: Judgement) -> list[float]:
    return [(probability - right) ** 2 for probability, right in one.choices] or [one.squared_error]


def _log_score(one: Judgement) -> list[float]:
    given = [p if right else 1 - p for p, right in one.choices] or [one.probability]
    return [float(value) for value in np.log(np.maximum(given, SMALLEST_PROBABILITY))]


def _mean(values: OfScenes) -> float | None:
    every = [value for _, given in values for value in given]
    return float(np.mean(every)) if every else None


def _bin_of(forecast: Float[np.ndarray, "*forecast"]) -> np.ndarray:
    return np.asarray(np.minimum((forecast * BINS).astype(int), BINS - 1))


def _if_calibrated(
    forecast: Float[np.ndarray, "forecast"], generator: np.random.Generator
) -> tuple[float, Float[np.ndarray, "2 bin"]]:
    """95 % quantile of the calibration error of calibrated forecasts, and the middle 90 % of each bin's share."""
    outcomes = generator.random((REPLICATIONS, len(forecast))) < forecast
    place = _bin_of(forecast)
    member = (place[:, None] == np.arange(BINS)).astype(float)
    shares = outcomes @ member
    errors = np.abs(forecast @ member - shares).sum(axis=1) / len(forecast)
    bands = np.quantile(shares / np.maximum(member.sum(axis=0), 1), (0.05, 0.95), axis=0)
    return float(np.quantile(errors, 0.95)), bands


def _reliability(
    forecast: Float[np.ndarray, "forecast"], outcome: Bool[np.ndarray, "forecast"], bands: Float[np.ndarray, "2 bin"]
) -> tuple[Bin, ...]:
    place = _bin_of(forecast)
    return tuple(
        Bin(
            int((place == number).sum()),
            float(forecast[place == number].mean()),
            float(outcome[place == number].mean()),
            float(bands[0, number]),
            float(bands[1, number]),
        )
        for number in range(BINS)
        if (place == number).any()
    )


def _abstention(judgements: Sequence[Judgement]) -> tuple[float, ...]:
    """Accuracy of the surest questions; equally sure ones count with their mean."""
    confidence = np.array([judgement.confidence for judgement in judgements])
    right = np.array([float(judgement.right) for judgement in judgements])
    for value in np.unique(confidence):
        right[confidence == value] = right[confidence == value].mean()
    ordered = right[np.argsort(-confidence, kind="stable")]
    counts = np.maximum(np.rint(COVERAGES * len(ordered)).astype(int), 1)
    return tuple(float(ordered[:count].mean()) for count in counts)
