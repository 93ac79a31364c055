"""Use positions that you measured yourself: two discs on a table, one of them weighed.

Any tracker will do; what is needed are two small tables (`tracks.csv`, `objects.csv`). Here they are written by this
script: disc A slides at disc B and hits it squarely.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import vrdp_prob

FRAME_RATE = 100.0
RADIUS = 0.025
DECELERATION = 0.1
SPEED_BEFORE, SPEED_A_AFTER, SPEED_B_AFTER = 0.60, 0.10, 0.4375
CONTACT_TIME = 0.5


def position_after(start: float, speed: float, time: np.ndarray) -> np.ndarray:
    """Positions of a disc that slides and slows down."""
    return start + speed * time - DECELERATION * time**2 / 2


def write_tables(folder: Path) -> None:
    """Write one video of 1.2 s; momentum conservation makes B 1.2 times as heavy as A."""
    noise = np.random.default_rng(0)
    times = np.arange(120) / FRAME_RATE
    before, after = np.minimum(times, CONTACT_TIME), np.maximum(times - CONTACT_TIME, 0)
    speed_at_contact = SPEED_BEFORE - DECELERATION * CONTACT_TIME
    impulse_ratio = 1.2
    speed_b = (speed_at_contact - SPEED_A_AFTER) / impulse_ratio
    a = position_after(0.0, SPEED_BEFORE, before) + position_after(0.0, SPEED_A_AFTER, after)
    contact_b = position_after(0.0, SPEED_BEFORE, np.array(CONTACT_TIME)) + 2 * RADIUS
    b = contact_b + position_after(0.0, speed_b, after)
    rows = ["video,object,time,x,y"]
    for name, x in (("A", a), ("B", b)):
        for time, position in zip(times, x + noise.normal(0, 2e-4, len(times)), strict=True):
            rows.append(f"run1,{name},{time:.2f},{position:.6f},{noise.normal(0, 2e-4):.6f}")
    (folder / "tracks.csv").write_text("\n".join(rows) + "\n")
    (folder / "objects.csv").write_text(
        f"video,object,shape,radius,mass\nrun1,A,cylinder,{RADIUS},0.030\nrun1,B,cylinder,{RADIUS},\n"
    )


def main() -> None:
    with TemporaryDirectory() as directory:
        folder = Path(directory)
        write_tables(folder)
        posterior = vrdp_prob.infer(vrdp_prob.load(folder), sampler="laplace", seed=0)
    mass = posterior.object_summary("B").mass
    print(f"mass of B: {mass.mean:.4f} kg, 90 % interval {mass.q05:.4f} to {mass.q95:.4f} kg ({mass.status})")


if __name__ == "__main__":
    main()
