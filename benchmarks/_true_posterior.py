"""A posterior that knows the true masses and restitutions: the ceiling of what better inference could reach."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.identifiability.status import BodyStatus, ParameterStatus, Status
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.models.simulator.worlds import Worlds
from vrdp_prob.scene import Shape, Tracks


@dataclass(frozen=True)
class TruePosterior:
    """True masses and restitutions, shared friction near the true mean; states at release as seen.

    Parameters
    ----------
    tracks
        What was seen.
    truth
        Folder of the truth files.
    """

    tracks: Tracks
    truth: Path
    seed: int = 0

    @property
    def model(self) -> PhysicsModel:
        """The base model."""
        return PhysicsModel.base()

    @property
    def convergence(self) -> Convergence:
        """Nothing was sampled."""
        return Convergence(
            sampler="laplace", converged=True, r_hat=None, ess_bulk=None, divergences=None, pareto_k=None
        )

    @property
    def status(self) -> dict[str, BodyStatus]:
        """Everything is known."""
        known = ParameterStatus(Status.IDENTIFIED, ())
        return {body.id: BodyStatus(known, known) for body in self.tracks.bodies}

    def worlds(self, count: int | None = None, *, generator: np.random.Generator | None = None) -> Worlds:
        """Copies of the true world with random yaw of cubes."""
        number, bodies = count or 100, self.tracks.bodies
        random = generator or np.random.default_rng(self.seed)
        name = f"truth_{int(self.tracks.video[-5:]):05d}.json"
        entries = {str(o["object_id"]): o for o in json.loads((self.truth / name).read_text())["objects"]}
        known = [entries[body.id] for body in bodies]

        def repeated(values: list[object]) -> torch.Tensor:
            array = np.array(values, dtype=float)
            return torch.from_numpy(np.broadcast_to(array, (number, *array.shape)).copy())

        shared = {"sliding_friction": 0.09, "rolling_resistance": 0.03, "air_drag": 0.04, "angular_drag": 0.3}
        spread = {
            key: torch.from_numpy(value * np.exp(0.1 * random.standard_normal(number))) for key, value in shared.items()
        }
        spread["sliding_friction"] = repeated([np.mean([o["floor_friction"] for o in known])])[:, 0]
        return Worlds(
            shapes=tuple(Shape(body.shape) for body in bodies),
            position=repeated([o["release_position"][:2] for o in known]),
            velocity=repeated([o["release_velocity"][:2] for o in known]),
            angle=repeated([o["release_yaw"] for o in known]),
            spin=repeated([o["release_spin"] for o in known]),
            release_time=repeated([o["release_frame"] / 25 for o in known]),
            mass=repeated([o["mass"] for o in known]),
            restitution=repeated([o["restitution"] for o in known]),
            radius=repeated([0.2] * len(bodies)),
            present=torch.ones(number, len(bodies), dtype=torch.bool),
            parameters=spread,
        )
