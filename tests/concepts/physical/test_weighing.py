"""From agreements to a posterior: against sums by hand, and calibrated where the truth is drawn from the prior."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import beta, norm

from vrdp_prob.concepts.physical.agreement import GROUPS, Agreement
from vrdp_prob.concepts.physical.belief import Belief
from vrdp_prob.concepts.physical.hypotheses import HYPOTHESES, MEANINGS, meaning_prior, places_of, prior_of
from vrdp_prob.concepts.physical.learn import word_of
from vrdp_prob.concepts.physical.learned_word import LearnedWord
from vrdp_prob.concepts.physical.weighing import LAPSE_PRIOR, jackknife_error, weigh
from vrdp_prob.reasoning.changes import PhysicalParameter, Rule

DRAWS = 10 * GROUPS


def agreement_of(wrong: np.ndarray, answers: int) -> Agreement:
    """An agreement from the number of wrong answers of every meaning in every draw."""
    group = np.arange(wrong.shape[1]) * GROUPS // wrong.shape[1]
    counts = np.zeros((len(MEANINGS), GROUPS, answers + 1), dtype=np.int64)
    for meaning, row in enumerate(wrong):
        np.add.at(counts[meaning], (group, row), 1)
    return Agreement(counts)


def word(agreements: list[Agreement]) -> LearnedWord:
    return word_of("floppier", agreements, examples=len(agreements), draws=DRAWS, seed=0)


def test_the_prior_treats_parameters_alike() -> None:
    assert meaning_prior().sum() == pytest.approx(1)
    assert prior_of(None) == pytest.approx(0.2)
    for parameter in PhysicalParameter:
        assert sum(prior_of(one) for one in HYPOTHESES if one.parameter is parameter) == pytest.approx(0.2)
    for one in HYPOTHESES:
        assert one.scale[one.points // 2] == pytest.approx(0)
        shifts = [MEANINGS[place] for place in range(*places_of(one).indices(len(MEANINGS)))]
        assert {(shift.parameter, shift.rule) for shift in shifts if shift} == {(one.parameter, one.rule)}


def test_without_examples_the_posterior_is_the_prior() -> None:
    found = weigh([])
    assert found.probability == pytest.approx(meaning_prior())
    assert found.log_gain == pytest.approx(0)
    assert found.lapse @ found.lapse_probability == pytest.approx(beta(*LAPSE_PRIOR).mean())


def test_a_meaning_under_which_a_question_makes_no_sense_is_neither_favoured_nor_excluded_by_it() -> None:
    """Its answers can only have been guessed, so its evidence stays that of guessing."""
    told = agreement_of(np.zeros((len(MEANINGS), DRAWS), dtype=int), 2)
    told.draws[1] = 0
    found = weigh([told])
    assert np.isfinite(found.log_evidence).all()
    assert found.log_evidence[1] == pytest.approx(0)
    assert found.log_evidence[0] > 0


def test_evidence_by_hand() -> None:
    """Two examples: one answer that 30 % of the draws get wrong, and three answers of which all draws get one wrong."""
    single = np.zeros((len(MEANINGS), DRAWS), dtype=int)
    single[:, : DRAWS * 3 // 10] = 1
    triple = np.ones((len(MEANINGS), DRAWS), dtype=int)
    found = weigh([agreement_of(single, 1), agreement_of(triple, 3)])

    def likelihood(lapse: float) -> float:
        flip = lapse / 2
        return (0.7 * (1 - flip) + 0.3 * flip) * (1 - flip) ** 2 * flip * beta(*LAPSE_PRIOR).pdf(lapse)

    by_hand = np.log(quad(likelihood, 0, 1)[0]) - 4 * np.log(0.5)
    assert found.log_evidence == pytest.approx(np.full(len(MEANINGS), by_hand), abs=1e-9)
    assert found.probability == pytest.approx(meaning_prior())


def test_a_question_that_makes_sense_in_one_group_of_draws() -> None:
    counts = np.zeros((len(MEANINGS), GROUPS, 2), dtype=np.int64)
    counts[:, 3, 0] = 2
    learned = word([Agreement(counts)])
    assert learned.beliefs[0].mc_error == pytest.approx(0)
    assert np.isfinite(learned.log_gain)


def test_the_order_of_examples_does_not_matter() -> None:
    generator = np.random.default_rng(0)
    several = [agreement_of(generator.integers(0, 3, (len(MEANINGS), DRAWS)), 2) for _ in range(4)]
    assert weigh(several).probability == pytest.approx(weigh(several[::-1]).probability)


def test_answers_that_contradict_each_other_are_told() -> None:
    generator = np.random.default_rng(1)
    says = generator.random((10, len(MEANINGS), 1)) < 0.5
    sure = np.broadcast_to(says, (10, len(MEANINGS), DRAWS)).astype(int)
    contradicting = word([*(agreement_of(one, 1) for one in sure), *(agreement_of(1 - one, 1) for one in sure)])
    assert contradicting.contradicts_itself
    assert contradicting.lapse.mean > 0.5
    assert contradicting.summary[0].startswith("The answers about 'floppier' contradict each other")
    agreeing = word([agreement_of(np.zeros_like(one), 1) for one in sure])
    assert not agreeing.contradicts_itself
    assert agreeing.lapse.mean < 0.15


def test_the_jackknife_knows_the_error_of_a_mean() -> None:
    values = np.random.default_rng(2).normal(size=10)
    left_out = [np.delete(values, place).mean() for place in range(10)]
    assert jackknife_error(left_out) == pytest.approx(values.std(ddof=1) / np.sqrt(10))


def test_the_monte_carlo_error_is_the_spread_over_other_draws() -> None:
    """The stated error of a probability, against the spread of that probability over independent draws."""
    generator = np.random.default_rng(3)
    share = generator.uniform(0.2, 0.8, (6, len(MEANINGS), 1))
    found, stated = [], []
    for _ in range(60):
        wrong = (generator.random((6, len(MEANINGS), DRAWS)) < share).astype(int)
        learned = word([agreement_of(one, 1) for one in wrong])
        found.append(learned.beliefs[1].probability)
        stated.append(learned.beliefs[1].mc_error)
    # the spread of 60 numbers is known to 9 %
    assert np.std(found) == pytest.approx(np.sqrt(np.mean(np.square(stated))), rel=0.35)


def test_quantiles_of_a_normal_posterior() -> None:
    amounts = np.exp(np.linspace(-2.4, 2.4, 13))
    weights = norm(0.5, 0.4).pdf(np.log(amounts))
    belief = Belief(PhysicalParameter.MASS, Rule.FACTOR, 1.0, 0.0, 0.0, tuple(amounts), tuple(weights / weights.sum()))
    low, high = belief.interval()
    assert np.log(belief.quantile(0.5)) == pytest.approx(0.5, abs=0.02)
    assert np.log([low, high]) == pytest.approx(norm(0.5, 0.4).ppf([0.05, 0.95]), abs=0.05)


@pytest.fixture(scope="module")
def recovered() -> list[tuple[int, LearnedWord]]:
    """Words whose meaning, lapse and draws come from the prior, with answers simulated in one of the draws.

    The simulated answers are made up: which of them is yes depends on the amount along the grid and on the draw.
    """
    generator, found = np.random.default_rng(4), []
    for _ in range(150):
        truth = int(generator.choice(len(MEANINGS), p=meaning_prior()))
        lapse = generator.beta(*LAPSE_PRIOR)
        agreements = []
        for _ in range(12):
            says = _made_up_answers(generator)
            given = says[truth, generator.integers(DRAWS)]
            given = np.where(generator.random(len(given)) < lapse, generator.random(len(given)) < 0.5, given)
            agreements.append(agreement_of((says != given).sum(axis=2), len(given)))
        found.append((truth, word(agreements)))
    return found


def _made_up_answers(generator: np.random.Generator) -> np.ndarray:
    """Yes or no for every meaning, draw and of three choices: a threshold in the amount, other for every draw."""
    place = np.concatenate([[0.0], *(one.scale / one.limit for one in HYPOTHESES)])
    kind = np.concatenate([[0], *(np.full(one.points, number + 1) for number, one in enumerate(HYPOTHESES))])
    slope = generator.normal(0, 1.5, (len(HYPOTHESES) + 1, 3))[kind]
    threshold = generator.normal(0, 0.5, 3) + 0.3 * generator.normal(size=(DRAWS, 1))
    return np.asarray(place[:, None, None] * slope[:, None, :] > threshold[None])


def test_intervals_hold_the_truth_as_often_as_they_say(recovered: list[tuple[int, LearnedWord]]) -> None:
    inside = []
    for truth, learned in recovered:
        for one, belief in zip(HYPOTHESES, learned.beliefs[1:], strict=True):
            place = truth - places_of(one).start
            if 0 <= place < one.points:
                low, high = belief.interval()
                inside.append(low <= one.amounts[place] <= high)
    # 0.9 within three standard errors
    assert np.mean(inside) == pytest.approx(0.9, abs=3 * np.sqrt(0.09 / len(inside)))


def test_probabilities_of_parameters_are_calibrated(recovered: list[tuple[int, LearnedWord]]) -> None:
    stated, true = [], []
    for truth, learned in recovered:
        shift = MEANINGS[truth]
        for name, probability in learned.probabilities.items():
            stated.append(probability)
            true.append(name == ("nothing" if shift is None else str(shift.parameter)))
    stated, true = np.array(stated), np.array(true)
    for chosen in (stated > 0.5, stated > 0.2, stated < 0.05):
        expected, spread = stated[chosen].sum(), np.sqrt((stated * (1 - stated))[chosen].sum())
        assert true[chosen].sum() == pytest.approx(expected, abs=3 * spread)
