"""Teach a new word by questions and answers, save it, and ask with it.

The videos come from the few lines of mechanics below, not from the simulator: a red disc slides at a blue one, behind
which a green one lies. 'Zippier' multiplies the speed by 1.5, which nobody tells: the answers do.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import vrdp_prob
from vrdp_prob import Example
from vrdp_prob.scene import Body, Shape, Tracks

RADIUS, DECELERATION, RESTITUTION = 0.05, 0.8, 0.8
FACTOR = 1.5
FRAME_RATE, FRAMES, NOISE = 50.0, 75, 0.001
VIDEOS = ((1.0, 0.2, 0.8), (0.8, 0.6, 0.2), (0.8, 1.0, 0.2), (1.1, 0.3, 0.9))
"""Speed (m/s) of the red disc, and the gaps (m) before it and behind the blue disc."""
RED_BLUE, BLUE_GREEN = "The red cylinder hits the blue cylinder", "The blue cylinder hits the green cylinder"


def reach(speed: float) -> float:
    """How far (m) a disc slides."""
    return speed**2 / (2 * DECELERATION)


def speed_at(speed: float, distance: float) -> float:
    """Speed (m/s) that is left after a distance."""
    return float(np.sqrt(max(speed**2 - 2 * DECELERATION * distance, 0.0)))


def collisions(speed: float, gap: float, next_gap: float) -> dict[str, bool]:
    """Which discs collide: of two equal discs the one that is hit gets (1 + e)/2 of the speed."""
    passed_on = (1 + RESTITUTION) / 2 * speed_at(speed, gap)
    return {RED_BLUE: reach(speed) > gap, BLUE_GREEN: reach(passed_on) > next_gap}


def slid(speed: float, time: np.ndarray) -> np.ndarray:
    """Distance in m that a disc has slid after a time (s), which may be before its start."""
    moving = np.clip(time, 0.0, speed / DECELERATION)
    return speed * moving - DECELERATION * moving**2 / 2


def filmed(number: int, speed: float, gap: float, next_gap: float) -> Tracks:
    """A video in which the blue disc does not reach the green one."""
    times, hit = np.arange(FRAMES) / FRAME_RATE, speed_at(speed, gap)
    when = (speed - hit) / DECELERATION if reach(speed) > gap else np.inf
    red = np.where(times < when, slid(speed, times), gap + slid((1 - RESTITUTION) / 2 * hit, times - when))
    blue = gap + 2 * RADIUS + slid((1 + RESTITUTION) / 2 * hit, times - when)
    green = np.full(FRAMES, gap + next_gap + 4 * RADIUS)
    positions = np.stack([np.stack([x, np.zeros(FRAMES)], axis=1) for x in (red, blue, green)], axis=1)
    positions += np.random.default_rng(number).normal(0, NOISE, positions.shape)
    discs = [Body(color, Shape.CYLINDER, radius=RADIUS, color=color) for color in ("red", "blue", "green")]
    return Tracks.from_arrays(f"video{number}", discs, times, positions)


def main() -> None:
    posteriors = [
        vrdp_prob.infer(filmed(number, *video), sampler="laplace", hand_on=False, seed=0)
        for number, video in enumerate(VIDEOS)
    ]
    question = "If the red cylinder were zippier, what would happen?"
    examples = [
        Example.of(posterior, question, choices=collisions(FACTOR * speed, gap, next_gap))
        for posterior, (speed, gap, next_gap) in zip(posteriors, VIDEOS, strict=True)
    ]
    word = vrdp_prob.learn_concept("zippier", examples, draws=50, seed=0)
    print("\n".join(word.summary))
    for name, probability in word.probabilities.items():
        print(f"  {probability:6.1%}  {name}")

    with TemporaryDirectory() as folder:
        word.write(Path(folder) / "zippier.json")
        again = vrdp_prob.LearnedWord.read(Path(folder) / "zippier.json")
    answer = posteriors[0].ask(
        "Would the blue cylinder hit the green cylinder if the red cylinder were zippier?", words=[again]
    )
    print(f"{answer.question} {answer.answer} ({answer.probability:.0%})")


if __name__ == "__main__":
    main()
