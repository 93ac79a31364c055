import numpy as np
import pytest

from vrdp_prob.inference.identifiability import Status, identifiability
from vrdp_prob.scene import Body, Shape, Tracks, Wall


def tracks(count: int, *, masses: dict[int, float] | None = None, walls: tuple[Wall, ...] = ()) -> Tracks:
    bodies = tuple(Body(str(k), Shape.CYLINDER, 0.2, mass=(masses or {}).get(k)) for k in range(count))
    positions = np.zeros((3, count, 2))
    positions[..., 0] = np.arange(count)
    return Tracks.from_arrays("v", bodies, np.arange(3.0), positions, walls=walls)


def test_without_contact_everything_is_default() -> None:
    status = identifiability(tracks(2), [], [])
    assert status["0"].mass.status is Status.DEFAULT
    assert status["1"].restitution.status is Status.DEFAULT
    assert status["0"].is_default


def test_a_chain_of_contacts_gives_ratios_and_products_with_the_partners() -> None:
    status = identifiability(tracks(4), [(0, 1), (1, 2)], [])
    assert status["1"].mass.status is Status.RATIO_ONLY
    assert status["1"].mass.partners == ("0", "2")
    assert status["1"].restitution.status is Status.PRODUCT_ONLY
    assert status["3"].mass.status is Status.DEFAULT


def test_an_odd_cycle_separates_restitutions_but_not_masses() -> None:
    status = identifiability(tracks(4), [(0, 1), (1, 2), (0, 2), (2, 3)], [])
    assert {status[name].restitution.status for name in "0123"} == {Status.IDENTIFIED}
    assert {status[name].mass.status for name in "0123"} == {Status.RATIO_ONLY}


def test_an_even_cycle_does_not() -> None:
    status = identifiability(tracks(4), [(0, 1), (1, 2), (2, 3), (0, 3)], [])
    assert status["0"].restitution.status is Status.PRODUCT_ONLY


def test_a_weighed_body_fixes_the_scale_of_its_group_only() -> None:
    status = identifiability(tracks(5, masses={0: 2.0}), [(0, 1), (1, 2), (3, 4)], [])
    assert [str(status[name].mass.status) for name in "01234"] == ["identified"] * 3 + ["ratio_only"] * 2


@pytest.mark.parametrize(("restitution", "expected"), [(0.8, Status.IDENTIFIED), (None, Status.PRODUCT_ONLY)])
def test_a_wall_of_known_restitution_fixes_that_of_its_bodies(restitution: float | None, expected: Status) -> None:
    wall = Wall(-5, -5, 5, -5, restitution)
    status = identifiability(tracks(2, walls=(wall,)), [(0, 1)], [(0, 0)])
    assert status["0"].restitution.status is expected
    assert status["1"].restitution.status is expected
