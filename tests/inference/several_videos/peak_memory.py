"""Print the peak memory in MB of this process after it has drawn from the posterior of so many short videos."""

import resource
import sys

import numpy as np

from tests.inference.several_videos.videos import sliding
from vrdp_prob.inference.several_videos import fit_together
from vrdp_prob.inference.several_videos.gibbs import sample_gibbs
from vrdp_prob.models.physics import PhysicsModel

if __name__ == "__main__":
    fit = fit_together([sliding(seed, frames=20) for seed in range(int(sys.argv[1]))], model=PhysicsModel.base())
    sample_gibbs(fit.joint, generator=np.random.default_rng(0), rounds=1)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
