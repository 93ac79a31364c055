"""Several modes, and what samplers do where they fall short."""

from functools import partial

import numpy as np
import pytest

from tests.inference.densities import FAR, Hopeless, SmallNeighbour, TwoModes
from vrdp_prob.inference import laplace, nuts_sampler
from vrdp_prob.inference.draws.samples import PARETO_K_GOAL, assess
from vrdp_prob.inference.emcee_sampler import sample_emcee
from vrdp_prob.inference.laplace import sample_laplace
from vrdp_prob.inference.nuts_sampler import sample_nuts
from vrdp_prob.inference.samplers.mixture import Jumps, Mixture

SAMPLERS = {"emcee": sample_emcee, "nuts": sample_nuts, "laplace": sample_laplace}


NUTS_SLOWLY = [pytest.param(one, marks=pytest.mark.slow) if one == "nuts" else one for one in SAMPLERS]


@pytest.mark.parametrize("name", NUTS_SLOWLY)
def test_two_modes_get_the_weights_that_they_have(name: str) -> None:
    target = TwoModes()
    options = {"processes": 1, "warm_up": 20, "most_gradients": 1} if name == "nuts" else {}
    samples = SAMPLERS[name](target, target.start, draws=1000, generator=np.random.default_rng(4), **options)
    share = float((samples.points[..., 0] < FAR / 3).mean())
    assert share == pytest.approx(target.weight, abs=0.06)
    assert len(samples.modes) == 2
    # The clouds are in the order of the weights that the fit gave them, so the narrow one is first.
    assert samples.modes[0].weight == pytest.approx(target.weight, abs=max(4 * samples.modes[0].error, 0.01))
    assert 0 < samples.modes[0].error < 0.05
    convergence = assess(name, samples)
    assert convergence.modes == samples.modes
    assert convergence.converged or name == "nuts", convergence.sentence


@pytest.mark.slow
def test_a_small_mode_that_chains_of_nuts_leave_and_enter_keeps_its_share() -> None:
    target = SmallNeighbour()
    generator = np.random.default_rng(1)
    samples = sample_nuts(target, target.start, draws=1000, generator=generator, processes=1)
    share = float((samples.points[..., 0] > target.distance / 2).mean())
    # About 1000 effective draws and the error of the weight: 0.009 together.
    assert share == pytest.approx(target.share_beyond, abs=0.03)
    assert assess("nuts", samples).converged


def test_a_mode_that_hardly_a_draw_is_in_forbids_to_trust_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nuts_sampler, "FEWEST_IN_MODE", 10**6)
    target = SmallNeighbour()
    options = {"processes": 1, "warm_up": 5, "most_gradients": 10}
    samples = sample_nuts(target, target.start, draws=40, generator=np.random.default_rng(1), **options)
    convergence = assess("nuts", samples)
    assert not convergence.converged
    assert "Hardly a draw is in mode 2, which holds 0.0" in convergence.sentence


@pytest.mark.parametrize("name", NUTS_SLOWLY)
def test_jumps_reach_a_mode_that_the_fit_did_not_find(name: str) -> None:
    target = TwoModes()
    known = Mixture.of(target.start.components[0])
    # 400 places of which none is in the other mode: where chains set out from is not what weighs the modes.
    places = known.draws(400, np.random.default_rng(0))[0]
    options = {"processes": 1} if name == "nuts" else {}
    generator = np.random.default_rng(4)
    samples = SAMPLERS[name](
        target, known, draws=1000, generator=generator, jumps=Jumps(target.start, places), **options
    )
    share = float((samples.points[..., 0] < FAR / 3).mean())
    assert share == pytest.approx(target.weight, abs=0.06)
    assert assess(name, samples).converged


def test_the_fast_way_hands_on_where_it_cannot_be_trusted_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laplace, "sample_emcee", partial(sample_emcee, most_steps=8))
    target = Hopeless()
    refused = sample_laplace(target, target.start, draws=400, generator=np.random.default_rng(1), hand_on=False)
    assert refused.pareto_k is not None
    assert refused.known is not None
    assert refused.pareto_k > PARETO_K_GOAL or refused.known.ess_bulk < 400
    assert not assess("laplace", refused).converged
    samples = sample_laplace(target, target.start, draws=400, generator=np.random.default_rng(1))
    convergence = assess("laplace", samples)
    assert convergence.sampler == "emcee"
    assert convergence.pareto_k is None
    assert convergence.notes[0].startswith("The fast way could not be trusted")
    assert convergence.notes[0] in convergence.sentence


def test_a_sampler_that_stops_at_its_budget_says_so() -> None:
    target = TwoModes()
    few = sample_emcee(target, target.start, draws=400, generator=np.random.default_rng(1), most_steps=4)
    assert few.notes[0] == "It stopped after 4 steps."
    round_one = TwoModes(1.0, dimension=2)
    start = Mixture.of(round_one.start.components[0])
    options = {"processes": 1, "warm_up": 5, "most_gradients": 10}
    short = sample_nuts(round_one, start, draws=4000, generator=np.random.default_rng(1), **options)
    assert short.notes == ("It stopped at its budget of 10 gradients.",)
