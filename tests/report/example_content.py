"""A report's content made by hand: five objects and rollouts of a little disc world of its own."""

from dataclasses import dataclass, replace

import numpy as np

from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.draws.summaries import ObjectSummary, PairSummary, ParameterSummary, Summary
from vrdp_prob.reasoning.answer import Answer, ChoiceAnswer, monte_carlo_error
from vrdp_prob.report.content import (
    FACTUAL,
    FUTURE,
    REMOVED,
    AnswerContent,
    Collisions,
    Footage,
    PairShare,
    ReportContent,
    WorldContent,
)
from vrdp_prob.scene import Body, Camera, QuestionType, Shape, Tracks

FRAME = 0.04
RADIUS = 0.2
DRAWS = 30
IDS = ("0", "1", "2", "3", "4")
PAIRS = np.array([(a, b) for a in range(len(IDS)) for b in range(a + 1, len(IDS))])
BODIES = (
    Body("0", Shape.CUBE, RADIUS, color="cyan", material="metal"),
    Body("1", Shape.CUBE, RADIUS, color="purple", material="rubber"),
    Body("2", Shape.CYLINDER, RADIUS, color="gray", material="metal"),
    Body("3", Shape.SPHERE, RADIUS, color="cyan", material="rubber"),
    Body("4", Shape.SPHERE, RADIUS, color="yellow", material="metal"),
)
RELEASE = np.array([3.0, 0.0, 0.0, 1.08, 3.96])
POSITION = np.array([[-3.13, -2.03], [-1.085, -0.475], [-0.15, -0.30], [2.94, -1.02], [0.385, -3.31]])
VELOCITY = np.array([[0.86, 0.70], [0.0, 0.0], [0.0, 0.0], [-2.09, 0.54], [-1.06, 1.965]])
SPIN = np.array([0.7, 0.0, 0.0, 0.0, 0.0])
BRAKE = np.array([0.55, 1.0, 0.59, 0.12, 0.1])
MASS = np.array([1.0, 1.9, 1.0, 1.1, 0.9])


@dataclass(frozen=True)
class Draws:
    """Unknowns of the disc world, one row per draw."""

    position: np.ndarray
    velocity: np.ndarray
    mass: np.ndarray
    bounce: np.ndarray


@dataclass(frozen=True)
class Moment:
    """State of all draws at one time; its arrays are changed in place."""

    time: float
    position: np.ndarray
    velocity: np.ndarray
    mass: np.ndarray
    spin: np.ndarray
    out: np.ndarray


def make_draws(count: int = DRAWS, seed: int = 0) -> Draws:
    random = np.random.default_rng(seed)
    spread = np.array([0.03, 0.015, 0.015, 0.03, 0.05])[:, None]
    shape = (count, len(IDS), 2)
    return Draws(
        POSITION + 0.004 * random.standard_normal(shape),
        VELOCITY * (1 + spread * random.standard_normal(shape)),
        MASS * np.exp(np.array([0.4, 0.12, 0.1, 0.1, 0.4]) * random.standard_normal((count, len(IDS)))),
        0.8 * np.exp(0.08 * random.standard_normal((count, len(IDS)))),
    )


def roll(draws: Draws, frames: int, kind: str, body: str | None = None) -> WorldContent:
    """Roll all draws out in fixed steps: discs that brake steadily and bounce."""
    count = len(draws.mass)
    position, velocity, mass = draws.position.copy(), draws.velocity.copy(), draws.mass.copy()
    release = np.tile(RELEASE, (count, 1))
    if body is not None:
        index = IDS.index(body)
        if kind == REMOVED:
            release[:, index] = np.inf
        mass[:, index] *= {"heavier": 5.0, "lighter": 0.2}.get(kind, 1.0)
    angle = np.zeros((count, len(IDS)))
    spin = np.tile(SPIN, (count, 1))
    trajectory, exists, events = [], [], {}
    steps = 4
    for frame in range(frames):
        trajectory.append(np.concatenate([position, angle[..., None]], axis=-1))
        exists.append(release <= frame * FRAME + 1e-9)
        for step in range(steps):
            time = frame * FRAME + step * FRAME / steps
            out = release <= time
            speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
            slower = np.maximum(speed - BRAKE[:, None] * FRAME / steps, 0)
            velocity = np.where(out[..., None], velocity * slower / np.maximum(speed, 1e-9), velocity)
            position = position + np.where(out[..., None], velocity, 0.0) * FRAME / steps
            angle = angle + np.where(out, spin, 0.0) * FRAME / steps
            spin = np.where(out, 0.995 * spin, spin)
            _bounce(draws, Moment(time, position, velocity, mass, spin, out), events)
    return WorldContent(
        kind,
        body,
        FRAME * np.arange(frames),
        np.stack(trajectory, axis=1),
        np.stack(exists, axis=1),
        _table(events),
        _shares(_table(events), count),
    )


def from_frame(world: WorldContent, frame: int) -> WorldContent:
    """What happens in a world from a frame on."""
    late = world.collisions.time > world.times[frame]
    table = world.collisions
    late_ones = Collisions(table.draw[late], table.time[late], table.bodies[late], table.point[late])
    return replace(
        world,
        times=world.times[frame:],
        trajectory=world.trajectory[:, frame:],
        exists=world.exists[:, frame:],
        collisions=late_ones,
        pairs=_shares(late_ones, world.draws),
    )


def _bounce(draws: Draws, now: Moment, events: dict) -> None:
    position, velocity, mass, spin, out = now.position, now.velocity, now.mass, now.spin, now.out
    for a, b in PAIRS[_touching(position)]:
        apart = position[:, b] - position[:, a]
        distance = np.linalg.norm(apart, axis=-1, keepdims=True)
        normal = apart / np.maximum(distance, 1e-9)
        closing = ((velocity[:, a] - velocity[:, b]) * normal).sum(axis=-1)
        hit = (distance[:, 0] < 2 * RADIUS) & (closing > 0) & out[:, a] & out[:, b]
        factor = 1 + draws.bounce[:, a] * draws.bounce[:, b]
        impulse = np.where(hit, factor * closing / (1 / mass[:, a] + 1 / mass[:, b]), 0.0)[:, None] * normal
        velocity[:, a] -= impulse / mass[:, a, None]
        velocity[:, b] += impulse / mass[:, b, None]
        for draw in np.flatnonzero(hit):
            spin[draw, [a, b]] += [0.8, -0.8]
            point = (position[draw, a] + position[draw, b]) / 2
            events.setdefault((int(draw), int(a), int(b)), (now.time, point))


def _touching(position: np.ndarray) -> np.ndarray:
    apart = position[:, PAIRS[:, 0]] - position[:, PAIRS[:, 1]]
    return ((apart**2).sum(axis=-1) < (2 * RADIUS) ** 2).any(axis=0)


def _table(events) -> Collisions:
    keys = list(events)
    return Collisions(
        np.array([key[0] for key in keys], dtype=int).reshape(-1),
        np.array([events[key][0] for key in keys], dtype=float).reshape(-1),
        np.array([key[1:] for key in keys], dtype=int).reshape(-1, 2),
        np.array([events[key][1] for key in keys], dtype=float).reshape(-1, 2),
    )


def _shares(table: Collisions, draws: int) -> tuple[PairShare, ...]:
    found = []
    for pair in np.unique(table.bodies, axis=0):
        times = table.time[(table.bodies == pair).all(axis=1)]
        share = len(times) / draws
        bodies = (int(pair[0]), int(pair[1]))
        found.append(PairShare(bodies, share, float(np.median(times)), monte_carlo_error(share, draws)))
    return tuple(sorted(found, key=lambda met: met.time))


def make_tracks(camera: Camera | None, seed: int = 1) -> Tracks:
    truth = roll(Draws(POSITION[None], VELOCITY[None], MASS[None], np.full((1, 5), 0.8)), 128, FACTUAL)
    random = np.random.default_rng(seed)
    positions = truth.trajectory[0, :, :, :2] + 0.01 * random.standard_normal((128, 5, 2))
    view = camera.in_view(positions) if camera is not None else np.ones((128, 5), dtype=bool)
    positions[~(view & truth.exists[0])] = np.nan
    return Tracks.from_arrays("video_00000", BODIES, truth.times, positions, camera=camera)


def make_footage(camera: Camera) -> Footage:
    """A grey floor that gets lighter towards the viewer, and a film in which it gets lighter still."""
    shade = np.linspace(90, 190, camera.height)[:, None, None]
    floor = np.broadcast_to(shade, (camera.height, camera.width, 3)).astype(np.uint8)
    film = np.stack([floor + np.uint8(brighter) for brighter in range(0, 60, 4)])
    return Footage(floor, 4.4, floor, film, np.linspace(0, 5, len(film)))


def _parameter(draws, status, *partners):
    return ParameterSummary(Summary.of(draws), status, partners)


def make_objects(draws: Draws) -> tuple[ObjectSummary, ...]:
    ratio = {"1": ("2", "3"), "2": ("3", "1"), "3": ("2", "1")}
    product = {"1": ("2",), "2": ("3", "1"), "3": ("2",)}
    return tuple(
        ObjectSummary(
            body.id,
            _parameter(draws.mass[:, index], "ratio_only" if body.id in ratio else "default", *ratio.get(body.id, ())),
            _parameter(
                draws.bounce[:, index], "product_only" if body.id in product else "default", *product.get(body.id, ())
            ),
        )
        for index, body in enumerate(BODIES)
    )


def _entropy(probabilities) -> float:
    p = np.array([value for value in probabilities if value > 0])
    return float(-(p * np.log(p)).sum())


def _open(number, question, distribution, world="factual", **more) -> AnswerContent:
    answer, probability = max(distribution.items(), key=lambda item: item[1])
    error = float(np.sqrt(probability * (1 - probability) / 500))
    answer = Answer(
        number,
        question,
        QuestionType.DESCRIPTIVE,
        answer,
        probability,
        error,
        _entropy(distribution.values()),
        distribution,
        **more,
    )
    return AnswerContent(answer, world)


def _choices(number, question, kind, choices, world, **more) -> AnswerContent:
    items = tuple(
        ChoiceAnswer(index, text, p, float(np.sqrt(p * (1 - p) / 500))) for index, (text, p) in enumerate(choices)
    )
    chosen = tuple(item.choice_id for item in items if item.probability > 0.5)
    joint = float(np.prod([max(p, 1 - p) for _, p in choices]))
    entropy = sum(_entropy([p, 1 - p]) for _, p in choices)
    error = float(np.sqrt(joint * (1 - joint) / 500))
    answer = Answer(number, question, kind, chosen, joint, error, entropy, {}, choices=items, **more)
    return AnswerContent(answer, world)


def make_answers() -> tuple[AnswerContent, ...]:
    explanatory, predictive, counterfactual = (
        QuestionType.EXPLANATORY,
        QuestionType.PREDICTIVE,
        QuestionType.COUNTERFACTUAL,
    )
    return (
        _open(
            0, "What is the material of the object to collide with the cyan sphere?", {"metal": 0.996, "rubber": 0.004}
        ),
        _open(1, "How many collisions happen?", {"2": 0.962, "3": 0.03, "1": 0.008}),
        _open(2, "Are there any stationary cyan objects when the video begins?", {"no": 1.0}),
        _choices(
            3,
            "Which of the following is responsible for the collision between the gray object and the purple cube?",
            explanatory,
            [
                ("the collision between the cyan rubber object and the metal cylinder", 1.0),
                ("the presence of the cyan cube", 0.0),
            ],
            "factual",
        ),
        _choices(
            4,
            "Which of the following will happen next?",
            predictive,
            [
                ("The rubber cube and the yellow object collide", 0.93),
                ("The cylinder collides with the cyan cube", 0.02),
            ],
            "future",
            relies_on_default=("4",),
        ),
        _choices(
            5,
            "Which of the following will happen without the purple object?",
            counterfactual,
            [
                ("The cyan rubber object and the metal cube collide", 0.36),
                ("The gray object collides with the cyan rubber object", 1.0),
            ],
            "removed:1",
            relies_on_default=("0", "4"),
        ),
        _choices(
            6,
            "Which of the following would happen if the cylinder were much heavier?",
            counterfactual,
            [
                ("The purple object and the gray metal cylinder collide", 0.42),
                ("The rubber sphere collides with the cylinder", 1.0),
                ("The cyan sphere and the purple object collide", 0.12),
                ("The cylinder and the cyan cube collide", 0.0),
            ],
            "heavier:2",
            notes=("The order of the collisions changes between draws.",),
        ),
        _choices(
            7,
            "What would not happen if the cyan rubber object were lighter?",
            counterfactual,
            [
                ("The cyan metal object and the cyan rubber sphere collide", 0.99),
                ("The cylinder and the cyan sphere collide", 0.0),
                ("The gray object and the purple object collide", 0.81),
            ],
            "lighter:3",
        ),
        _open(8, "What shape is the object that enters last?", {"sphere": 0.97, "cube": 0.02, "cylinder": 0.01}),
        _open(9, "How many objects are moving when the video ends?", {"2": 0.55, "3": 0.38, "1": 0.05, "4": 0.02}),
    )


def make_content(*, camera: Camera | None = None, draws: int = DRAWS) -> ReportContent:
    """Content with all worlds; without a camera there is no still."""
    unknown = make_draws(draws)
    kinds = (REMOVED, "heavier", "lighter")
    worlds = [roll(unknown, 128, FACTUAL), from_frame(roll(unknown, 186, FUTURE), 127)]
    worlds += [roll(unknown, 128, kind, body) for kind in kinds for body in IDS]
    mass, bounce = unknown.mass, unknown.bounce
    return ReportContent(
        tracks=make_tracks(camera),
        objects=make_objects(unknown),
        mass_ratios=(
            PairSummary(("3", "2"), Summary.of(mass[:, 3] / mass[:, 2])),
            PairSummary(("1", "2"), Summary.of(mass[:, 1] / mass[:, 2])),
        ),
        restitution_pairs=(
            PairSummary(("2", "3"), Summary.of(bounce[:, 2] * bounce[:, 3])),
            PairSummary(("1", "2"), Summary.of(bounce[:, 1] * bounce[:, 2])),
        ),
        convergence=Convergence("emcee", True, 1.006, 612.0, None, None, 0.08),
        warnings=(
            "The cyan sphere leaves its predicted path by 2.4 times the noise after 3.1 s: "
            "the model misses part of its motion.",
            "In 8 % of the draws the collisions come in another order.",
        ),
        answers=make_answers(),
        worlds=tuple(worlds),
        model="base",
        effects=("sliding_friction", "rolling_resistance", "air_drag"),
        seed=0,
        version="0.1.0",
        footage=make_footage(camera) if camera is not None else None,
    )


def with_question(content: ReportContent, text: str) -> ReportContent:
    """The same content with one question's text replaced."""
    return replace(content, answers=(_asked(content.answers[0], text), *content.answers[1:]))


def with_unsure_material(content: ReportContent) -> ReportContent:
    """The same content with an object that is rubber with a probability of 55 %."""
    bodies = list(content.tracks.bodies)
    bodies[1] = replace(bodies[1], attribute_probabilities={"material": {"rubber": 0.55, "metal": 0.45}})
    return replace(content, tracks=replace(content.tracks, bodies=tuple(bodies)))


def _asked(item: AnswerContent, text: str) -> AnswerContent:
    return replace(item, answer=replace(item.answer, question=text))
