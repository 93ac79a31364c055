"""More draws where an answer needs them, and no more precision than the posterior has."""

import numpy as np
import pytest
from ambiguity import DISCS, OPEN, QUESTION, SURE, posterior
from hand_made import STORY, video
from sliding_discs import KnownPosterior

from vrdp_prob.errors import InputError
from vrdp_prob.inference import Status
from vrdp_prob.reasoning import PosteriorWorlds, ask
from vrdp_prob.reasoning.batch import Batch
from vrdp_prob.reasoning.changes import Change

BATCH = 50


def widest(worlds: PosteriorWorlds) -> int:
    """How many draws were taken of the worlds so far."""
    while "more" in vars(worlds) and worlds.more is not None:
        worlds = worlds.more
    return worlds.draws


def asked(known: KnownPosterior | PosteriorWorlds, choice: str, mc_error: float | None = None) -> float:
    return ask(known, QUESTION, choices=[choice], mc_error=mc_error).choices[0].probability


def test_an_answer_near_one_half_takes_more_draws_than_a_sure_one() -> None:
    used = {}
    for choice in (SURE, OPEN):
        worlds = PosteriorWorlds(posterior(total=2000), draws=BATCH)
        answer = ask(worlds, QUESTION, choices=[choice], mc_error=0.02)
        assert answer.choices[0].mc_error <= 0.02
        assert answer.notes == ()
        used[choice] = widest(worlds)
    assert used[SURE] == BATCH
    # a probability of one half needs 625 independent draws for an error of 0.02
    assert 550 <= used[OPEN] <= 650


@pytest.mark.slow
def test_repeated_runs_scatter_by_the_stated_error() -> None:
    goal = 0.05
    found = np.array(
        [asked(PosteriorWorlds(posterior(total=2000, seed=seed), draws=BATCH), OPEN, goal) for seed in range(24)]
    )
    truth = asked(PosteriorWorlds(posterior(total=2000, seed=100), draws=2000), OPEN)
    scatter = np.sqrt(np.mean((found - truth) ** 2))
    # 24 runs tell a standard deviation to 15 %
    assert 0.5 * goal < scatter < 1.4 * goal


def test_the_note_says_which_limit_bound_the_error() -> None:
    few = ask(posterior(total=120), QUESTION, choices=[OPEN], draws=BATCH, mc_error=0.01)
    assert few.notes[-1].endswith("above the 0.01 asked for: all 120 draws of the posterior are used.")
    assert few.choices[0].mc_error == pytest.approx(np.sqrt(0.25 / 120), rel=0.1)
    worth_less = ask(posterior(total=2000, effective=80.0), QUESTION, choices=[OPEN], draws=BATCH, mc_error=0.01)
    assert "the posterior's draws are worth no more than 80 independent ones" in worth_less.notes[-1]
    assert worth_less.choices[0].mc_error == pytest.approx(np.sqrt(0.25 / 80), rel=0.1)


def test_no_draw_is_taken_twice() -> None:
    worlds = PosteriorWorlds(posterior(total=130), draws=BATCH)
    while worlds.more is not None:
        worlds = worlds.more
    masses = [mass for batch in worlds.batches for mass in batch.drawn.mass[:, 0].tolist()]
    assert len(masses) == len(set(masses)) == 130
    first, second = (batch.seen.drawn[0].state(np.array([0.0]))[0] for batch in worlds.batches[:2])
    assert not np.isin(first, second).any()


def test_each_world_is_simulated_once_per_draw(monkeypatch: pytest.MonkeyPatch) -> None:
    simulated: list[int] = []
    original = vars(Batch)["future"].func
    monkeypatch.setattr(vars(Batch)["future"], "func", lambda batch: (simulated.append(len(batch)), original(batch))[1])
    worlds = PosteriorWorlds(posterior(total=1000), draws=BATCH)
    first = asked(worlds, OPEN, 0.04)
    count = len(simulated)
    assert asked(worlds, OPEN, 0.04) == first
    assert asked(worlds, SURE, 0.04) > 0.95
    assert len(simulated) == count == widest(worlds) // BATCH
    # a question about another world does not need as many draws of this one
    worlds.counterfactual(Change.REMOVED, 2)
    assert len(simulated) == count


def test_defaults_from_the_prior_are_drawn_anew_in_each_batch() -> None:
    known = posterior(total=100, mass_spread=0.0, statuses=(Status.DEFAULT,) * len(DISCS))
    worlds = PosteriorWorlds(known, draws=BATCH, defaults="prior").more
    assert worlds is not None
    first, second = (batch.drawn.mass for batch in worlds.batches)
    assert not np.isin(first.numpy(), second.numpy()).any()


def test_an_error_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(InputError, match="mc_error is 0; ask for a number between 0 and 1"):
        ask(posterior(), QUESTION, choices=[OPEN], mc_error=0.0)
    with pytest.raises(InputError, match="mc_error needs a posterior"):
        ask(video(STORY), "How many collisions happen?", mc_error=0.02)
