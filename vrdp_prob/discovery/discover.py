"""The search for what a model lacks."""

from collections.abc import Sequence

from vrdp_prob.discovery.checking import check_video_count
from vrdp_prob.discovery.finding import Finding
from vrdp_prob.models.physics import PhysicsModel
from vrdp_prob.progress import ProgressDisplay
from vrdp_prob.scene import Tracks


def discover(
    videos: Sequence[Tracks],
    *,
    model: PhysicsModel | None = None,
    seed: int = 0,
    progress: ProgressDisplay | None = None,
) -> Finding:
    """Say whether a model explains some videos, and if not, which causes it lacks.

    Parameters
    ----------
    videos
        What was seen, at least three videos of one table.
    model
        The physics that is put to the test.
    seed
        Seed of all randomness: the same seed gives the same finding.
    progress
        Told how far the work is.

    Raises
    ------
    InputError
        If there are fewer than three videos.
    """
    del model, seed, progress
    check_video_count(videos)
    raise NotImplementedError("the search is not written yet.")
