"""How much a quantity tells about an answer, against information that is known."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from vrdp_prob.reasoning.entropy import entropy
from vrdp_prob.reasoning.explanation.hinges import hinges
from vrdp_prob.reasoning.explanation.information import alike_weights, information, smooth_weights
from vrdp_prob.reasoning.explanation.quantities import Kind, Measurement, Quantity

DRAWS = 600


def binary(share: float) -> float:
    return entropy(np.array([share, 1 - share]))


def noisy_threshold(noise: float, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray, float]:
    """A quantity, whether it exceeds zero after noise, and their mutual information in nats."""
    values = generator.standard_normal(DRAWS)
    yes = (values + noise * generator.standard_normal(DRAWS) > 0).astype(int)
    left, _ = quad(lambda x: norm.pdf(x) * binary(float(norm.cdf(x / noise))), -6, 6)
    return values, yes, binary(0.5) - left


@pytest.mark.parametrize("noise", [0.3, 1.0, 3.0])
def test_information_of_a_smooth_quantity(noise: float) -> None:
    found, errors = [], []
    for seed in range(6):
        values, yes, truth = noisy_threshold(noise, np.random.default_rng(seed))
        told = information(smooth_weights(values[:, None]), yes)
        found.append(told.nats)
        errors.append(told.error)
    # a lower bound, and a close one
    assert truth - 0.025 - 0.1 * truth < np.mean(found) < truth + 3 * np.mean(errors) / np.sqrt(6)
    # the stated error is that of single runs, up to what six of them tell
    assert np.std(found) < 2 * np.mean(errors)


def test_information_of_an_event() -> None:
    generator = np.random.default_rng(1)
    event = generator.random(4 * DRAWS) < 0.3
    yes = (generator.random(4 * DRAWS) < np.where(event, 0.9, 0.2)).astype(int)
    truth = binary(0.3 * 0.9 + 0.7 * 0.2) - 0.3 * binary(0.9) - 0.7 * binary(0.2)
    told = information(alike_weights(event.astype(int)), yes)
    assert told.nats == pytest.approx(truth, abs=3 * told.error)


def test_information_of_an_answer_of_several_values() -> None:
    generator = np.random.default_rng(2)
    values = generator.random(DRAWS)
    told = information(smooth_weights(values[:, None]), (4 * values).astype(int))
    assert np.log(4) - 0.15 < told.nats < np.log(4)


def test_draws_taken_twice_are_no_neighbours() -> None:
    generator = np.random.default_rng(3)
    values = np.repeat(generator.standard_normal(100), 6)
    codes = np.repeat(generator.integers(0, 2, 100), 6)
    assert information(smooth_weights(values[:, None]), codes).nats < 0.05


def candidates(count: int, generator: np.random.Generator) -> list[Quantity]:
    return [Quantity(Kind.MOTION, f"number {place}", generator.standard_normal(300)) for place in range(count)]


def test_chance_alone_is_no_hinge() -> None:
    told = 0
    for seed in range(20):
        generator = np.random.default_rng(seed)
        codes = generator.integers(0, 2, 300)
        told += bool(hinges(candidates(20, generator), codes, 1, generator))
    assert told <= 4  # 5 % of 20, and what chance adds


def test_a_hinge_is_found_among_others_and_split_where_it_turns() -> None:
    generator = np.random.default_rng(5)
    mass = np.exp(0.3 * generator.standard_normal(300))
    yes = generator.random(300) < np.where(mass > 1.3, 0.9, 0.2)
    quantity = Quantity(Kind.PARAMETER, "mass of the blue cube", mass, "kg", relative=True)
    (hinge, *_) = hinges([*candidates(20, generator), quantity], yes.astype(int), 1, generator)
    assert hinge.name == "mass of the blue cube"
    assert hinge.threshold == pytest.approx(1.3, rel=0.05)
    assert (hinge.inside, hinge.outside) == (pytest.approx(0.9, abs=0.08), pytest.approx(0.2, abs=0.08))
    assert hinge.sentence.startswith("the mass of the blue cube: 0.")
    assert f"if above {hinge.threshold:.3g} kg, else 0." in hinge.sentence


def test_a_simulated_event_that_is_the_answer_is_no_hinge_and_an_observed_one_is() -> None:
    generator = np.random.default_rng(6)
    event = generator.random(300) < 0.5
    labels = ("it does not", "it does")
    simulated = Quantity(Kind.EVENT, "whether a touches b", event.astype(float), labels=labels)
    observed = Quantity(
        Kind.EVENT, "whether c touches d", event.astype(float), labels=labels, measurement=Measurement("seeing it")
    )
    (hinge,) = hinges([simulated, observed], event.astype(int), 1, generator)
    assert hinge.sentence == "whether c touches d: 1.00 if it does, else 0.00"


def test_a_quantity_that_most_draws_share_is_split_below_its_largest_value() -> None:
    generator = np.random.default_rng(7)
    friction = np.where(generator.random(300) < 0.85, 0.5, 0.3 + 0.01 * generator.standard_normal(300))
    quantity = Quantity(Kind.PARAMETER, "friction", friction)
    (hinge,) = hinges([quantity], (friction > 0.4).astype(int), 1, generator)
    assert (hinge.inside, hinge.outside) == (pytest.approx(1.0, abs=0.03), pytest.approx(0.0, abs=0.03))
    assert 0.29 < (hinge.threshold or 0.0) < 0.5
    top = Quantity(Kind.PARAMETER, "friction", np.where(np.arange(300) < 5, 0.3, 0.5))
    assert hinges([top], (np.arange(300) >= 5).astype(int), 1, generator) == ()
