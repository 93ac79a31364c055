"""Masses that a path tells though nothing collides, by a force between bodies; the motion is another integrator's."""

import numpy as np
import pytest

from tests.inference.repelling_discs import MASSES, inferred
from vrdp_prob.inference import assembly
from vrdp_prob.inference.identifiability.status import BodyStatus, ParameterStatus, Status
from vrdp_prob.inference.identified import Identified
from vrdp_prob.inference.posterior import Posterior


@pytest.fixture(scope="module")
def posterior() -> Posterior:
    return inferred()


@pytest.mark.slow
def test_masses_of_bodies_that_only_repel_each_other_are_found(posterior: Posterior) -> None:
    log_mass = np.log(posterior.data["posterior"]["mass"].values.reshape(-1, 3))
    sd = log_mass.std(axis=0)
    assert np.all(sd[:2] < 0.1)
    assert np.all(np.abs(log_mass.mean(axis=0) - np.log(MASSES))[:2] < 4 * sd[:2])
    assert [one.mass.status for one in posterior.status.values()] == [Status.IDENTIFIED] * 3


@pytest.mark.slow
def test_only_the_restitution_of_bodies_that_never_collide_is_called_a_default(posterior: Posterior) -> None:
    assert [one.restitution.status for one in posterior.status.values()] == [Status.DEFAULT] * 3
    told = [sentence for sentence in posterior.warnings if "default" in sentence]
    assert told == ["Objects a, b, c never collide in view: restitution is a default value, not measured."]


@pytest.mark.slow
def test_a_mass_that_is_drawn_though_nothing_tells_it_is_not_called_a_default(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = ParameterStatus(Status.DEFAULT)
    told = dict(zip("abc", [BodyStatus(nothing, nothing)] * 3, strict=True))
    monkeypatch.setattr(assembly, "identified", lambda _fit: Identified(told, ()))
    assert inferred().warnings[-2:] == (
        "Objects a, b never collide in view: mass is drawn from the prior and restitution is a default value, not "
        "measured.",
        "Object c never collides in view: mass and restitution are default values, not measured.",
    )
