import numpy as np
import pytest

from vrdp_prob.inference.draws.mode import Mode
from vrdp_prob.inference.identifiability.information import Information
from vrdp_prob.inference.identifiability.status import BodyStatus, Status, collision_groups, uninformed
from vrdp_prob.inference.identifiability.status import identifiability as identifiability_of
from vrdp_prob.models.coordinates import Coordinates
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.unknowns import Structure, unknowns
from vrdp_prob.scene import Body, Shape, Tracks, Wall

SHARP = 0.01
"""Standard deviation with which a contact tells a ratio or a product."""


def information(
    video: Tracks,
    pairs: list[tuple[int, int]],
    walls: list[tuple[int, int]],
    *,
    sharp: float = SHARP,
    more: list[dict[tuple[str, int], float]] | None = None,
) -> Information:
    """What contacts say in linear approximation: a mass ratio and a restitution product each, and what else is told."""
    everything = frozenset(range(len(video.bodies)))
    coordinates: Coordinates = unknowns(video, PhysicsModel.base(), Structure(everything, everything))
    told = [{("mass", i): 1.0, ("mass", j): -1.0} for i, j in pairs]
    told += [{("restitution", i): 1.0, ("restitution", j): 1.0} for i, j in pairs]
    told += [{("restitution", i): 1.0, ("wall_restitution", k): 1.0} for i, k in walls]
    rows = np.zeros((len(told + (more or [])), len(coordinates)))
    for row, weights in zip(rows, told + (more or []), strict=True):
        for key, weight in weights.items():
            if key in coordinates.places:
                row[coordinates.places[key]] = weight
    precision = np.diag(coordinates.prior_sd**-2.0) + rows.T @ rows / sharp**2
    return Information(coordinates, Mode(coordinates.prior_mean, precision, 0.0))


def identifiability(
    video: Tracks, pairs: list[tuple[int, int]], walls: list[tuple[int, int]], **more: object
) -> dict[str, BodyStatus]:
    return identifiability_of(video, pairs, walls, information(video, pairs, walls, **more))  # type: ignore[arg-type]


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


def test_a_law_by_which_masses_matter_links_those_of_bodies_that_never_meet() -> None:
    video = tracks(3)
    told: list[dict[tuple[str, int], float]] = [{("mass", i): 1.0, ("mass", j): -1.0} for i, j in ((0, 1), (1, 2))]
    known = information(video, [], [], more=told)
    status = identifiability_of(video, [], [], known, felt={0, 1, 2})
    for name, others in (("0", ("1", "2")), ("1", ("0", "2")), ("2", ("0", "1"))):
        assert status[name].mass.status is Status.RATIO_ONLY
        assert status[name].mass.partners == others
        assert status[name].restitution.status is Status.DEFAULT
    weighed = tracks(3, masses={2: 1.0})
    status = identifiability_of(weighed, [], [], information(weighed, [], [], more=told), felt={0, 1, 2})
    assert status["0"].mass.status is Status.IDENTIFIED


def test_a_contact_of_which_nothing_is_told_is_idle_though_the_mass_is_felt() -> None:
    video, pairs = tracks(2), [(0, 1)]
    blunt = information(video, pairs, [], sharp=1e3, more=[{("mass", 0): 1.0, ("mass", 1): -1.0}])
    assert uninformed(video, pairs, [], blunt, felt={0, 1}) == {0, 1}


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


GRAZES = {
    "a body beside the weighed one": ({2: 0.03}, [(0, 1), (2, 3)], (1, 2)),
    "a body that the weighed one has told": ({3: 0.03}, [(0, 1), (2, 3)], (1, 2)),
}


@pytest.mark.parametrize("layout", GRAZES)
def test_a_graze_identifies_nothing(layout: str) -> None:
    masses, clear, graze = GRAZES[layout]
    video = tracks(4, masses=masses)
    status = identifiability_of(video, [*clear, graze], [], information(video, clear, []))
    assert [str(status[name].mass.status) for name in "0123"] == ["ratio_only"] * 2 + ["identified"] * 2
    assert status["0"].mass.partners == ("1",)
    assert status["1"].mass.partners == ("0",)


def test_a_graze_carries_no_restitution_of_a_wall_over() -> None:
    wall = Wall(-5, -5, 5, -5, 0.8)
    video, clear, graze = tracks(3, walls=(wall,)), [(0, 1)], (1, 2)
    status = identifiability_of(video, [*clear, graze], [(2, 0)], information(video, clear, [(2, 0)]))
    assert status["2"].restitution.status is Status.IDENTIFIED
    assert {status[name].restitution.status for name in "01"} == {Status.PRODUCT_ONLY}


@pytest.mark.parametrize(
    ("clear", "graze"), [([(0, 1), (1, 2)], (0, 2)), ([(0, 1), (1, 2), (1, 3), (1, 4)], (0, 2))], ids=["chain", "star"]
)
def test_a_ring_that_is_closed_by_a_graze_alone_separates_no_restitutions(
    clear: list[tuple[int, int]], graze: tuple[int, int]
) -> None:
    video = tracks(5)
    status = identifiability_of(video, [*clear, graze], [], information(video, clear, []))
    assert {status[name].restitution.status for name in "012"} == {Status.PRODUCT_ONLY}


def test_a_body_that_a_known_one_only_grazed_keeps_the_defaults() -> None:
    video, clear, graze = tracks(3), [(0, 1)], (1, 2)
    status = identifiability_of(video, [*clear, graze], [], information(video, clear, []))
    assert status["2"].mass.status is status["2"].restitution.status is Status.DEFAULT
    assert status["1"].mass.partners == ("0",)


@pytest.mark.parametrize(("restitution", "expected"), [(0.8, Status.IDENTIFIED), (None, Status.PRODUCT_ONLY)])
def test_a_wall_of_known_restitution_fixes_that_of_its_bodies(restitution: float | None, expected: Status) -> None:
    wall = Wall(-5, -5, 5, -5, restitution)
    status = identifiability(tracks(2, walls=(wall,)), [(0, 1)], [(0, 0)])
    assert status["0"].restitution.status is expected
    assert status["1"].restitution.status is expected


def test_a_contact_that_came_too_late_to_tell_leaves_defaults() -> None:
    video, pairs = tracks(3), [(0, 1)]
    blunt = information(video, pairs, [], sharp=10.0)
    status = identifiability_of(video, pairs, [], blunt)
    assert status["0"].mass.status is Status.DEFAULT
    assert status["1"].restitution.status is Status.DEFAULT
    assert uninformed(video, pairs, [], blunt) == {0, 1, 2}
    assert uninformed(video, pairs, [], information(video, pairs, [])) == {2}


def test_a_law_that_depends_on_mass_fixes_the_scale() -> None:
    status = identifiability(tracks(3), [(0, 1), (1, 2)], [], more=[{("mass", 0): 1.0}])
    assert {status[name].mass.status for name in "012"} == {Status.IDENTIFIED}
    assert status["0"].mass.contraction > 0.99
    assert status["0"].restitution.status is Status.PRODUCT_ONLY


def test_groups_say_which_combinations_are_determined() -> None:
    video, pairs = tracks(5), [(0, 1), (1, 2)]
    (group,) = collision_groups(video, pairs, [], information(video, pairs, []))
    assert group.bodies == ("0", "1", "2")
    told = {one.name: one for one in group.combinations}
    ratio = told["mass ratio of objects 0 and 1"]
    assert ratio.relative_sd == pytest.approx(SHARP, rel=0.01)
    assert ratio.determined
    assert told["restitution product of objects 1 and 2"].determined
    assert not told["mass scale of objects 0, 1 and 2"].determined
    prior_sd = 0.7 / np.sqrt(3)
    assert told["mass scale of objects 0, 1 and 2"].relative_sd == pytest.approx(prior_sd, rel=0.01)


def test_a_contact_that_tells_nothing_between_groups_determines_nothing() -> None:
    video, clear, all_of_them = tracks(4), [(0, 1), (2, 3)], [(0, 1), (1, 2), (2, 3)]
    known = information(video, clear, [])
    (group,) = collision_groups(video, all_of_them, [], known)
    determined = {one.name: one.determined for one in group.combinations}
    assert determined["mass ratio of objects 0 and 1"]
    assert not determined["mass ratio of objects 1 and 2"]
    assert not determined["restitution product of objects 1 and 2"]


@pytest.mark.parametrize("told", [[(0, 1), (1, 2), (2, 3)], [(0, 1), (1, 2)]])
def test_what_a_chain_of_contacts_tells_is_told_of_its_ends(told: list[tuple[int, int]]) -> None:
    """A chain tells all ratios, and products of two that are an odd number of steps apart."""
    video, end = tracks(4), len(told)
    (group,) = collision_groups(video, [*told, (0, end)], [], information(video, told, []))
    determined = {one.name: one.determined for one in group.combinations}
    assert determined[f"mass ratio of objects 0 and {end}"]
    assert determined[f"restitution product of objects 0 and {end}"] is (end % 2 == 1)
