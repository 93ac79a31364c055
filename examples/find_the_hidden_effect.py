"""Let discovery find what a simulation lacks: discs slide on a table that, unknown to the model, is not level.

The tracks come from the few lines of mechanics below, not from the simulator. The table falls by 2 cm per metre.
"""

import numpy as np

from vrdp_prob.discovery.discover import discover
from vrdp_prob.scene import Body, Shape, Tracks

GRAVITY = 9.81
FRICTION = 0.05
TILT = np.array([0.016, -0.012])
NOISE = 0.002
FRAME_RATE, FRAMES = 25.0, 50
STEP = 1e-3


def slide(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Positions in m of discs that friction slows while the slope pulls, one row per frame."""
    seen = []
    for step in range(round(FRAMES / FRAME_RATE / STEP)):
        if step % round(1 / FRAME_RATE / STEP) == 0:
            seen.append(position.copy())
        velocity = velocity + GRAVITY * TILT * STEP
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        velocity = velocity * np.maximum(0.0, 1 - FRICTION * GRAVITY * STEP / np.maximum(speed, 1e-12))
        position = position + velocity * STEP
    return np.array(seen)


def measured(name: str, generator: np.random.Generator) -> Tracks:
    """A video of two discs that pass each other on ways of their own, in some direction across the table."""
    angle = generator.uniform(0, 2 * np.pi)
    ahead, aside = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    way = np.array([[1.0], [-1.0]])
    positions = slide(way * (0.4 * aside - 0.8 * ahead), way * generator.uniform(0.8, 1.6, (2, 1)) * ahead)
    positions += generator.normal(0, NOISE, positions.shape)
    discs = [Body(label, Shape.CYLINDER, radius=0.1) for label in "ab"]
    return Tracks.from_arrays(name, discs, np.arange(FRAMES) / FRAME_RATE, positions)


def main() -> None:
    generator = np.random.default_rng(0)
    finding = discover([measured(f"run{k + 1}", generator) for k in range(4)], seed=0)
    print(f"verdict: {finding.verdict}")
    for cause in finding.named:
        gain = cause.gain
        print(f"{cause.name}, probability {cause.probability:.2f}: {cause.sentence}")
        before, after = (f"{1e3 * prediction.rmse:.1f} mm" for prediction in (gain.before, gain.after))
        print(f"error of predicted positions: {before} without it, {after} with it, noise {1e3 * gain.noise:.1f} mm")
        for name, estimate in cause.parameters.items():
            print(f"  {name}: {estimate.q025:.5f} to {estimate.q975:.5f}")
    print(f"hidden was: surface_tilt, tilt_x {TILT[0]}, tilt_y {TILT[1]}")


if __name__ == "__main__":
    main()
