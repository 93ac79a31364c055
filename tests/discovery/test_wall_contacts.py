"""What the checks say of contacts with stated walls."""

from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest
from scipy.stats import kstest

from tests.discovery.fitted import moved
from tests.discovery.laws import Laws
from tests.discovery.measurement import Measurement, measure
from tests.discovery.test_checks import by_name, noise_in_place
from tests.discovery.videos import Video
from vrdp_prob.discovery.checks.contacts import DURATION, REBOUND_AT_WALLS, RUBBING_AT_WALLS, contact_checks
from vrdp_prob.discovery.checks.kicks import KICK
from vrdp_prob.discovery.finding import Check
from vrdp_prob.discovery.residuals.contact_patterns import AT_WALLS
from vrdp_prob.discovery.residuals.fitted_contacts import FittedContacts
from vrdp_prob.discovery.residuals.free_flight import FreeFlight
from vrdp_prob.discovery.residuals.residual_model import ResidualModel
from vrdp_prob.inference.several_videos.fitting import fit_together
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.events import RolloutEventKind
from vrdp_prob.scene import Shape, Wall

HALF = 0.7
"""Half side in m of the square of walls."""
SPEEDS = (1.2, 1.7, 2.2)
"""Speeds in m/s at which the disc of each video sets out."""
FAINT = 1e-3
"""Share of an effect of which the change of the motion is taken."""
LAWS = Laws(drag=0.03, spin_decay=0.5)
TURNING_AT_WALLS = "spin change at walls"
CORNERS = ((-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF))


@cache
def bouncing() -> tuple[tuple[Video, ...], ResidualModel]:
    """Videos in which one disc bounces off four walls, and what the fit of the base model leaves of them."""
    generator = np.random.default_rng(1)
    walls = tuple(Wall(*CORNERS[k - 1], *CORNERS[k], restitution=0.8) for k in range(4))
    videos = []
    for speed in SPEEDS:
        angle = generator.uniform(0, 2 * np.pi)
        videos.append(
            Video(
                shapes=(Shape.CYLINDER,),
                materials=("metal",),
                position=generator.uniform(-0.3, 0.3, (1, 2)),
                velocity=speed * np.array([[np.cos(angle), np.sin(angle)]]),
                angle=np.zeros(1),
                spin=generator.uniform(-5, 5, 1),
                release=np.zeros(1),
                mass=np.ones(1),
                radius=np.array([0.2]),
                restitution=np.array([0.88]),
                friction=np.array([0.03]),
                frames=60,
                laws=LAWS,
                walls=walls,
            )
        )
    tracks = [measure(one, f"v{k}", Measurement(angles=True), generator)[0] for k, one in enumerate(videos)]
    fit = fit_together(tracks, model=PhysicsModel.base(), model_error=False)
    return tuple(videos), ResidualModel.of(fit)


def with_effect(**numbers: float) -> ResidualModel:
    """The same with what other numbers in the laws change in the motion, to first order: no contact comes earlier."""
    videos, model = bouncing()
    faint = [video.governed_by(**{name: FAINT * value for name, value in numbers.items()}) for video in videos]
    changes = [(one.motion.states - video.motion.states) / FAINT for one, video in zip(faint, videos, strict=True)]
    return moved(model, [one[..., [0, 1, 4]] for one in changes])


FITTED = (RUBBING_AT_WALLS, REBOUND_AT_WALLS, TURNING_AT_WALLS)
"""Checks whose p-values are uniform where nothing is wrong; how long touches last is asked on one side only."""


def checked(model: ResidualModel, generator: np.random.Generator | None = None) -> Mapping[str, Check]:
    """The checks of contacts, by name."""
    flight = FreeFlight.of(model)
    replicas = flight.beside.replicas(20, generator or np.random.default_rng(0))
    return by_name(tuple(contact_checks(model, flight, replicas)))


@pytest.mark.slow
def test_what_discs_leave_at_walls_is_noise_where_nothing_is_wrong() -> None:
    _, model = bouncing()
    assert sum(len(FittedContacts.of(video.motion, RolloutEventKind.WALL)) for video in model.videos) >= 6
    generator = np.random.default_rng(0)
    found = []
    for _ in range(40):
        checks = checked(noise_in_place(model, generator), generator)
        assert checks.keys() - {KICK} == {*FITTED, DURATION[AT_WALLS]}
        found.append([checks[name].p_value for name in FITTED])
    assert all(kstest(column, "uniform").pvalue > 1e-3 for column in np.array(found).T)


def test_rubbing_on_walls_is_seen_in_the_motion_and_in_the_spin() -> None:
    found = checked(with_effect(contact_friction=0.003))
    for name in (RUBBING_AT_WALLS, TURNING_AT_WALLS):
        assert found[name].p_value < 1e-6
        assert found[name].statistic == pytest.approx(0.003, rel=0.2)
    assert found[RUBBING_AT_WALLS].sentence.startswith("At walls a tangential impulse acts against the slip")
    assert found[REBOUND_AT_WALLS].p_value > 1e-3


def test_a_rebound_from_walls_that_falls_with_the_speed_is_seen() -> None:
    found = checked(with_effect(restitution_power=0.4))
    check = found[REBOUND_AT_WALLS]
    assert check.p_value < 1e-6
    assert -0.5 < check.statistic < -0.2
    assert "At walls restitution falls with the approach speed" in check.sentence
    assert found[RUBBING_AT_WALLS].p_value > 1e-3
