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
CONTACT_TIME = 0.5
MASS_OF_A, MASS_OF_B = 0.030, 0.036
NOISE = 2e-4


def travelled(speed: float, time: np.ndarray) -> np.ndarray:
    """Distance in m that a disc slides in a time (s) while friction slows it."""
    return speed * time - DECELERATION * time**2 / 2


def write_tables(folder: Path) -> None:
    """Write one video of 1.2 s; A loses at the contact the momentum that B gains."""
    noise = np.random.default_rng(0)
    times = np.arange(120) / FRAME_RATE
    before, after = np.minimum(times, CONTACT_TIME), np.maximum(times - CONTACT_TIME, 0)
    speed, speed_of_a = 0.55, 0.10
    speed_of_b = MASS_OF_A / MASS_OF_B * (speed - speed_of_a)
    a = travelled(speed + DECELERATION * CONTACT_TIME, before) + travelled(speed_of_a, after)
    b = a[times <= CONTACT_TIME][-1] + 2 * RADIUS + travelled(speed_of_b, after)
    rows = ["video,object,time,x,y"]
    for name, x in (("A", a), ("B", b)):
        measured = np.stack([x, np.zeros_like(x)], axis=1) + noise.normal(0, NOISE, (len(x), 2))
        rows += [f"run1,{name},{time:.2f},{x:.6f},{y:.6f}" for time, (x, y) in zip(times, measured, strict=True)]
    (folder / "tracks.csv").write_text("\n".join(rows) + "\n")
    objects = f"run1,A,cylinder,{RADIUS},{MASS_OF_A}\nrun1,B,cylinder,{RADIUS},\n"
    (folder / "objects.csv").write_text("video,object,shape,radius,mass\n" + objects)


def main() -> None:
    with TemporaryDirectory() as directory:
        folder = Path(directory)
        write_tables(folder)
        posterior = vrdp_prob.infer(vrdp_prob.load(folder), sampler="laplace", seed=0)
    mass = posterior.object_summary("B").mass
    interval = f"{mass.summary.q05:.4f} to {mass.summary.q95:.4f} kg"
    print(
        f"mass of B: {mass.summary.mean:.4f} kg, 90 % interval {interval} ({mass.status}); the truth is {MASS_OF_B} kg"
    )


if __name__ == "__main__":
    main()
