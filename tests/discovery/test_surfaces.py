"""Walls and discs that tracks themselves show, by where bodies turn."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float

from tests.discovery.hidden import hide
from tests.discovery.laws import Laws
from tests.discovery.measurement import Measurement, measure
from tests.discovery.scenes import Setting
from tests.discovery.videos import Disc, Video
from vrdp_prob import discover
from vrdp_prob.datasets import load_all
from vrdp_prob.discovery.candidates.surfaces import (
    Circle,
    Line,
    Placed,
    Seen,
    as_stated,
    placed_surfaces,
    seen_surfaces,
)
from vrdp_prob.discovery.candidates.turns import sudden_turns
from vrdp_prob.discovery.finding import Verdict
from vrdp_prob.errors import InputError
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.effects.external_impulse import ExternalImpulse
from vrdp_prob.models.effects.hidden_obstacle import HiddenObstacle
from vrdp_prob.models.effects.linear_drag import LinearDrag
from vrdp_prob.models.effects.surface_tilt import SurfaceTilt
from vrdp_prob.models.effects.wall import FourthWall, SecondWall, ThirdWall, Wall
from vrdp_prob.scene import Shape, Tracks
from vrdp_prob.scene import Wall as SceneWall

HALF = 0.9
"""Half side in m of the square of walls."""
PILLAR = Disc(0.15, -0.1, 0.2, 0.8)
SLOPE = 0.06
WALLS: tuple[Effect, ...] = (Wall(), SecondWall(), ThirdWall(), FourthWall())
CATALOGUE = (*WALLS, HiddenObstacle(), ExternalImpulse(), SurfaceTilt(), LinearDrag())


def table(*, hidden: bool = True, discs: tuple[Disc, ...] = (), seed: int = 0, count: int = 8) -> list[Tracks]:
    """Videos of a disc that bounces about a square of walls, which nobody states if they are hidden."""
    generator = np.random.default_rng(seed)
    corners = ((-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF))
    walls = tuple(SceneWall(*corners[k - 1], *corners[k], restitution=0.8) for k in range(4))
    tracks = []
    for number in range(count):
        side, aim = generator.uniform(-0.6, 0.6, 2)
        start = np.array([-0.6, side])
        turn = (number + 0.5) * math.pi / 2 + aim
        ahead = np.array([PILLAR.x, PILLAR.y + PILLAR.radius * aim]) - start if discs else _direction(turn)
        video = replace(
            lone_disc(start, 1.5 * ahead / np.linalg.norm(ahead)),
            hidden_walls=walls if hidden else (),
            walls=() if hidden else walls,
            hidden_discs=discs,
        )
        tracks.append(measure(video, f"v{number + 1}", Measurement(noise=0.002), generator)[0])
    return tracks


def floor(count: int = 5) -> list[Tracks]:
    """Videos of a disc that falls down a slope on a floor that nobody states, again and again."""
    generator = np.random.default_rng(1)
    under = (SceneWall(-20.0, -0.8, 20.0, -0.8, restitution=0.9),)
    tracks = []
    for number in range(count):
        start = generator.uniform((-0.8, 0.2), (0.8, 0.8))
        velocity = generator.uniform((-0.5, -0.3), (0.5, 0.3))
        laws = Laws(drag=0.02, tilt_y=-SLOPE)
        video = replace(lone_disc(start, velocity), frames=100, laws=laws, hidden_walls=under)
        tracks.append(measure(video, f"v{number + 1}", Measurement(noise=0.003), generator)[0])
    return tracks


def lone_disc(place: Float[np.ndarray, "2"], velocity: Float[np.ndarray, "2"]) -> Video:
    """A disc that slides with little friction."""
    return Video(
        shapes=(Shape.CYLINDER,),
        materials=("metal",),
        position=place[None],
        velocity=velocity[None],
        angle=np.zeros(1),
        spin=np.zeros(1),
        release=np.zeros(1),
        mass=np.ones(1),
        radius=np.array([0.1]),
        restitution=np.array([0.9]),
        friction=np.array([0.01]),
        frames=75,
        laws=Laws(drag=0.03),
    )


def _direction(turn: float) -> Float[np.ndarray, "2"]:
    return np.array([math.cos(turn), math.sin(turn)])


def sides(lines: list[Line]) -> list[tuple[float, float]]:
    """Distances in m, and directions in quarter turns, of lines, in order of these."""
    return sorted(
        ((one.distance, one.direction / (math.pi / 2) % 4) for one in lines), key=lambda one: round(one[1]) % 4
    )


def test_four_walls_are_seen_where_they_are() -> None:
    found = [one.surface for one in seen_surfaces(table(discs=()))]
    assert len(found) == 4
    assert all(isinstance(one, Line) for one in found)
    placed = sides([one for one in found if isinstance(one, Line)])
    assert [distance for distance, _ in placed] == pytest.approx([HALF] * 4, abs=0.01)
    assert [round(turn) % 4 for _, turn in placed] == [0, 1, 2, 3]
    assert [turn - round(turn) for _, turn in placed] == pytest.approx([0.0] * 4, abs=0.02)


def test_a_pillar_is_seen_as_a_circle_and_not_as_walls() -> None:
    found = [one.surface for one in seen_surfaces(table(hidden=False, discs=(PILLAR,), count=6))]
    assert len(found) == 1
    assert isinstance(found[0], Circle)
    assert (found[0].x, found[0].y, found[0].radius) == pytest.approx((PILLAR.x, PILLAR.y, PILLAR.radius), abs=0.02)


def test_a_pillar_that_is_met_twice_is_seen() -> None:
    once = [one for one in table(hidden=False, discs=(PILLAR,), count=6) if len(sudden_turns([one])) == 1]
    (found,) = seen_surfaces(once[:2])
    assert found.turns == 2
    assert isinstance(found.surface, Circle)
    assert found.surface.values == pytest.approx((PILLAR.x, PILLAR.y, PILLAR.radius), abs=0.03)
    assert seen_surfaces(once[:1]) == []


def test_a_floor_is_seen_where_bodies_fall_on_it() -> None:
    (found,) = seen_surfaces(floor())
    line = found.surface
    assert isinstance(line, Line)
    assert sides([line]) == [pytest.approx((0.8, 3.0), abs=0.02)]


def test_stated_walls_are_nothing_unseen() -> None:
    assert sudden_turns(table(hidden=False)) == []


@pytest.mark.parametrize("way", [None, "external_impulse"])
def test_nothing_is_seen_where_no_surface_is(way: str | None) -> None:
    data = hide([] if way is None else [way], seed=1, effect_size=5.0, setting=Setting(videos=6, bodies=3))
    assert seen_surfaces(data.tracks) == []


def test_cushions_of_a_billiard_table_are_seen_within_a_centimetre(shared_data: Path) -> None:
    """Rolling balls, friction at cushions that give way, and an engine of another kind."""
    shots = load_all(shared_data / "billiards_three_cushion")[:12]
    assert seen_surfaces(shots) == []
    lines = [one.surface for one in seen_surfaces([replace(one, walls=()) for one in shots])]
    assert all(isinstance(one, Line) for one in lines)
    placed = sides([one for one in lines if isinstance(one, Line)])
    assert [distance for distance, _ in placed] == pytest.approx([1.42, 0.71, 1.42, 0.71], abs=0.01)
    assert [turn - round(turn) for _, turn in placed] == pytest.approx([0.0] * 4, abs=0.02)


def test_a_line_that_bodies_cross_is_none() -> None:
    """Two kicks alike at a line that another path goes through."""
    times, generator = np.arange(50) / 25, np.random.default_rng(0)

    def video(name: str, y: float, *, turns: bool) -> Tracks:
        x = np.where(times < 1, times - 1, (1 - times) * 0.8) if turns else times - 1
        body = table(count=1)[0].bodies[0]
        places = np.stack([x, np.full(len(times), y)], axis=-1)[:, None]
        return Tracks.from_arrays(name, (body,), times, places + 0.002 * generator.standard_normal(places.shape))

    turning = [video(f"v{k}", 0.3 * k, turns=True) for k in range(3)]
    assert len(seen_surfaces(turning)) == 1
    assert seen_surfaces([*turning, video("straight", -0.5, turns=False)]) == []


def test_walls_and_discs_take_the_places_that_the_catalogue_has() -> None:
    tracks = table()
    assert placed_surfaces(tracks, [SurfaceTilt(), HiddenObstacle()]) == []
    found = placed_surfaces(tracks, [SurfaceTilt(), *WALLS[:2]])
    assert [one.effect.name for one in found] == ["wall", "second_wall"]
    for one in found:
        distance, direction = one.start.values()
        assert abs(distance) == pytest.approx(HALF, abs=0.01)
        assert math.sin(2 * direction) == pytest.approx(0.0, abs=0.05)
        assert one.wall is not None
        assert one.wall.distance(np.zeros(2)) == pytest.approx(HALF, abs=0.01)
    assert placed_surfaces(tracks, [SecondWall(), ThirdWall()]) == []  # there is no second one without a first
    assert placed_surfaces(tracks, [Wall()]) == []  # one of four explains too few turns


def test_tracks_that_state_walls_are_as_uncertain_as_these() -> None:
    tracks = table()[0]
    placed = Placed(Wall(), Seen(Line(HALF, 0.0), slack=0.02, turns=3, share=1.0, span=HALF))
    stated = as_stated(tracks, [placed])
    assert len(stated.walls) == 1
    assert stated.walls[0].x1 == pytest.approx(HALF)
    sd = np.sqrt(stated.position_variance)
    np.testing.assert_allclose(sd, np.hypot(0.002, 0.02 / 4), rtol=0.1)
    with pytest.raises(InputError, match="overlaps the wall"):
        as_stated(tracks, [replace(placed, seen=replace(placed.seen, surface=Line(-0.6, 0.0)))])


def test_a_search_begins_with_a_wall_as_near_to_where_it_is_seen_as_its_turns_tell() -> None:
    placed = Placed(Wall(), Seen(Line(HALF, 0.5), slack=0.02, turns=3, share=1.0, span=0.4))
    distance, direction = placed.near.values()
    assert (distance.default, distance.prior.sd) == pytest.approx((HALF, 0.02))
    assert (direction.default, direction.prior.sd) == pytest.approx((0.5, 0.05))
    in_one_place = replace(placed, seen=replace(placed.seen, span=0.0))
    assert list(in_one_place.near.values())[1].prior.sd == pytest.approx(0.2)
    pillar = table(hidden=False, discs=(PILLAR,), count=6)
    for one in (*placed_surfaces(table(), WALLS), *placed_surfaces(pillar, [HiddenObstacle()])):
        assert list(one.near) == list(one.start)
        assert [belief.default for belief in one.near.values()] == pytest.approx(list(one.start.values()))


def test_bodies_whose_radius_nobody_states_are_thrown_back_where_their_middle_is() -> None:
    tracks = [replace(one, bodies=tuple(replace(body, radius=None) for body in one.bodies)) for one in table()]
    lines = [one.surface for one in seen_surfaces(tracks)]
    assert all(isinstance(one, Line) for one in lines)
    placed = sides([one for one in lines if isinstance(one, Line)])
    assert [distance for distance, _ in placed] == pytest.approx([HALF - 0.1] * 4, abs=0.01)


def test_what_turns_smoothly_turns_at_nothing() -> None:
    """A body that circles seven times a second times a radian: two quadratic pieces cannot follow it."""
    times, generator = np.arange(75) / 25, np.random.default_rng(0)
    body = table(count=1)[0].bodies[0]

    def video(name: str, radius: float) -> Tracks:
        turn = 7.0 * times + radius
        places = radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)[:, None]
        return Tracks.from_arrays(name, (body,), times, places + 0.002 * generator.standard_normal(places.shape))

    assert seen_surfaces([video(f"v{k}", 0.3 + 0.1 * k) for k in range(4)]) == []


@pytest.mark.slow
def test_a_table_whose_walls_nobody_states_is_enclosed() -> None:
    finding = discover(table(count=6, seed=1), seed=0, catalogue=CATALOGUE)
    named = {cause.effect for cause in finding.causes if cause.named}
    assert named == {"wall", "second_wall", "third_wall", "fourth_wall"}
    assert finding.verdict is Verdict.NAMED
    assert not any(check.significant for check in finding.checks_after)
    distances = [
        abs(value.mean)
        for cause in finding.causes
        for name, value in cause.parameters.items()
        if name.endswith("hidden_wall_distance")
    ]
    assert distances == pytest.approx([HALF] * 4, abs=0.01)


@pytest.mark.slow
def test_a_floor_and_the_slope_down_to_it_are_both_found() -> None:
    finding = discover(floor(), seed=0, catalogue=CATALOGUE)
    named = {cause.name: cause.parameters for cause in finding.causes if cause.named}
    assert finding.verdict is Verdict.NAMED
    assert set(named) == {"wall", "surface_tilt"}
    distance = next(value for name, value in named["wall"].items() if name.endswith("hidden_wall_distance"))
    assert abs(distance.mean) == pytest.approx(0.8, abs=0.01)
    assert named["surface_tilt"]["tilt_y"].mean == pytest.approx(-SLOPE, rel=0.05)
