"""Formulas of what is missing at contacts, where impulses of a known law are added to what a right model leaves."""

from collections.abc import Callable

import numpy as np
import pytest

from tests.discovery.fitted import fitted, moved
from tests.discovery.scenes import Setting
from vrdp_prob.discovery.describe import description_of
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.missing_impulse import MissingImpulse
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.scene import Shape

ROUND = Setting(videos=6, bodies=3, frames=70, shapes=(Shape.SPHERE, Shape.CYLINDER), late=0.0)
Impulse = Callable[[FittedContacts], np.ndarray]


@pytest.fixture(scope="module")
def null() -> ResidualModel:
    """What a right model leaves."""
    _, fit = fitted(seed=3, setting=ROUND)
    return ResidualModel.of(fit)


def with_impulses(model: ResidualModel, impulse: Impulse) -> ResidualModel:
    """What it would leave if such impulses (kg m/s) acted on the second body of each contact, and back on the first."""
    changes = []
    for video in model.videos:
        contacts = FittedContacts.of(video.motion)
        changes.append(contacts.pushed_apart(impulse(contacts)[..., None])[..., 0])
    return moved(model, [one[..., :2] for one in changes])


def against_slip(contacts: FittedContacts) -> np.ndarray:
    """Friction: a share of the normal impulse, against the slip."""
    return (-0.2 * np.sign(contacts.slip) * contacts.events.impulse)[:, None] * contacts.tangent


def test_nothing_is_missing_at_contacts_of_a_right_model(null: ResidualModel) -> None:
    found = description_of(null, ())
    assert (found.contact_formula, found.contact_explained) == ("", 0.0)


def test_friction_at_contacts_is_described_by_its_law(null: ResidualModel) -> None:
    found = description_of(with_impulses(null, against_slip), ())
    assert found.contact_formula.endswith("J_n s")
    assert float(found.contact_formula.split()[2]) == pytest.approx(0.2, abs=0.05)
    assert found.contact_explained > 0.5
    assert any(found.contact_formula in one and "left out" in one for one in found.sentences)
    assert not found.has_formula


def test_an_impulse_to_one_side_is_not_taken_for_friction(null: ResidualModel) -> None:
    found = description_of(with_impulses(null, lambda one: 0.2 * one.events.impulse[:, None] * one.tangent), ())
    assert found.contact_formula.endswith("J_n l")
    assert "J_n s" not in found.contact_formula


def test_terms_are_impulses_of_their_size(null: ResidualModel) -> None:
    rows = MissingImpulse.of(null, FreeFlight.of(null).scales)
    assert {one.kind for one in rows.patterns} == {RolloutEventKind.COLLISION}
    contacts = FittedContacts.of(null.videos[0].motion)
    for pattern in rows.patterns:
        impulse = pattern.impulse(contacts)
        along, across = (np.abs((impulse * unit).sum(axis=1)) for unit in (contacts.events.normal, contacts.tangent))
        small = np.minimum(along, across)
        np.testing.assert_allclose(small, 0.0, atol=1e-12)
    assert all(one.shape == (v.linear.data, len(rows.patterns)) for one, v in zip(rows.rows, null.videos, strict=True))


def test_the_impulse_that_ends_an_approach_is_what_no_restitution_leaves(null: ResidualModel) -> None:
    contacts = FittedContacts.of(null.videos[0].motion)
    np.testing.assert_allclose(contacts.stopping + contacts.bounce, contacts.events.impulse, rtol=1e-6)


def test_contacts_of_which_nobody_knows_the_direction_say_nothing() -> None:
    _, fit = fitted(seed=1)
    model = ResidualModel.of(fit)
    rows = MissingImpulse.of(model, FreeFlight.of(model).scales)
    for video, some, vague in zip(model.videos, rows.rows, rows.anything, strict=True):
        contacts = FittedContacts.of(video.motion)
        assert vague.shape[1] == 4 * int((~contacts.known_normal).sum())
        assert contacts.known_normal.any() or not np.any(some)
