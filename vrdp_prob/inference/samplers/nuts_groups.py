"""Groups of NUTS chains, whose gradients are computed in one batch, and how they are run side by side."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.draws.samples import DIVERGENT_GOAL, LogDensity
from vrdp_prob.inference.runs.checkpoint import Checkpoint
from vrdp_prob.inference.samplers.curved_gaussian import CurvedGaussian
from vrdp_prob.inference.samplers.mixture import Mixture
from vrdp_prob.inference.samplers.nuts_chain import Courses, Piece, Task
from vrdp_prob.inference.samplers.nuts_worker import Workers
from vrdp_prob.inference.samplers.rate_steps import RateSteps
from vrdp_prob.progress import Advance

AT_ONCE = 2
"""Groups of which pieces are made side by side."""
SHORTENINGS = 2
"""How often steps are halved and chains begin anew where more than..."""
TRIAL_GOAL = DIVERGENT_GOAL / 2
"""...this share of the transitions diverges, since few transitions tell it badly..."""
TRIAL_CHUNKS = 2
"""...in up to so many chunks."""


@dataclass
class Group:
    """Chains in one mode, in the coordinates of its cloud."""

    cloud: CurvedGaussian
    mode: int
    number: int
    places: Float[np.ndarray, "chain dimension"]
    seed: int
    jumps: Mixture | None = None
    rate_steps: RateSteps | None = None
    courses: Courses | None = None
    pieces: list[Piece] = field(default_factory=list)
    step_size: float | None = None
    warm_up_pieces: int = 0

    @property
    def name(self) -> str:
        """Name of the piece that comes next."""
        return f"mode_{self.mode}_group_{self.number}_piece_{len(self.pieces)}"

    def task(self, density: LogDensity, transitions: int) -> Task:
        """The piece that comes next; the first one finds the length of a step."""
        places = self.pieces[-1].whitened[:, -1] if self.pieces else self.cloud.whitened(self.places)
        own = np.random.SeedSequence([self.seed, self.mode, self.number, len(self.pieces)])
        seeds = tuple(int(one) for one in own.generate_state(len(places)))
        sizes = None if self.step_size is None else np.full(len(places), self.step_size)
        return Task(density, self.cloud, places, sizes, transitions, seeds, self.jumps, self.rate_steps, self.courses)

    def add(self, piece: Piece) -> None:
        """Take a piece that was made; chains share a step length, since one alone finds it in few transitions badly."""
        self.pieces.append(piece)
        if self.step_size is None:
            self.step_size, self.warm_up_pieces = float(np.median(piece.step_sizes)), 1

    def shorten_steps(self) -> None:
        """Halve the length of a step; what there is counts as warm-up."""
        assert self.step_size is not None
        self.step_size, self.warm_up_pieces = self.step_size / 2, len(self.pieces)

    @property
    def counted(self) -> list[Piece]:
        """The pieces after the warm-up."""
        return self.pieces[self.warm_up_pieces :]

    @property
    def points(self) -> Float[np.ndarray, "chain draw dimension"]:
        """All draws after the warm-up."""
        return self.cloud.points(np.concatenate([piece.whitened for piece in self.counted], axis=1))


@dataclass
class GroupRun:
    """All groups of chains, and what they have cost."""

    density: LogDensity
    groups: list[Group]
    checkpoint: Checkpoint | None
    pool: Workers
    advance: Advance
    shortened: int = 0

    def further(self, transitions: int) -> None:
        """One more piece of every group: those that were kept, and the others made now, a few at a time."""
        wanting = []
        for group in self.groups:
            found = self.checkpoint.arrays(group.name) if self.checkpoint is not None else None
            if found is None:
                wanting.append(group)
            else:
                group.add(Piece.of_arrays(found))
        for begin in range(0, len(wanting), AT_ONCE):
            several = wanting[begin : begin + AT_ONCE]
            made = self.pool.make([group.task(self.density, transitions) for group in several])
            for group, piece in zip(several, made, strict=True):
                if self.checkpoint is not None:
                    self.checkpoint.keep(group.name, piece.arrays())
                group.add(piece)
                self.advance(piece.gradients)

    def with_shorter_steps(self) -> bool:
        """Whether so many transitions diverged at first that all chains begin anew with shorter steps."""
        many = self.divergences > TRIAL_GOAL * self.transitions
        if not many or self.shortened == SHORTENINGS or len(self.groups[0].counted) > TRIAL_CHUNKS:
            return False
        for group in self.groups:
            group.shorten_steps()
        self.shortened += 1
        return True

    def points(self, mode: int) -> Float[np.ndarray, "chain draw dimension"]:
        """All draws of the chains of a mode."""
        return np.concatenate([group.points for group in self.groups if group.mode == mode])

    @property
    def gradients(self) -> int:
        """Gradients of all chains."""
        return sum(piece.gradients for group in self.groups for piece in group.pieces)

    @property
    def work(self) -> int:
        """Work of all chains."""
        return sum(piece.work for group in self.groups for piece in group.pieces)

    @property
    def transitions(self) -> int:
        """Transitions of all chains after the warm-up."""
        return sum(piece.whitened[..., 0].size for piece in self._counted)

    @property
    def divergences(self) -> int:
        """Transitions after the warm-up that diverged within a course of events."""
        return sum(piece.divergences for piece in self._counted)

    @property
    def cliffs(self) -> int:
        """Transitions after the warm-up that ended where a contact comes or goes."""
        return sum(piece.cliffs for piece in self._counted)

    @property
    def _counted(self) -> list[Piece]:
        return [piece for group in self.groups for piece in group.counted]
