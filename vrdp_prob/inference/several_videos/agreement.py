"""What videos that were fitted by themselves agree on, and their own numbers where the shared ones are that."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.parallel import in_parallel
from vrdp_prob.inference.samples import Gaussian
from vrdp_prob.inference.several_videos.arrow import Expansion, Expansions
from vrdp_prob.inference.several_videos.following import follow
from vrdp_prob.inference.several_videos.joint_fit import expand, expand_prior, settle
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers


def first_guess(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    starts: Sequence[Float[np.ndarray, "_ _"]],
    trusted: Sequence[bool],
) -> tuple[Float[np.ndarray, "shared"], list[Float[np.ndarray, "_"]]]:
    """Shared numbers that the videos' own fits agree on best, and each video's own numbers for them.

    Parameters
    ----------
    numbers, videos
        What is fitted.
    starts
        Vectors of each video at the modes of its own fit, the best first.
    trusted
        Whose fits are asked.
    """
    agreed = consensus(numbers, videos, [points[0] for points in starts], trusted).mean
    return agreed, following_ones(numbers, videos, starts, agreed)


def following_ones(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    starts: Sequence[Float[np.ndarray, "_ _"]],
    agreed: Float[np.ndarray, "shared"],
) -> list[Float[np.ndarray, "_"]]:
    """Each video's own numbers at some shared ones.

    Parameters
    ----------
    numbers, videos
        What is fitted.
    starts
        Vectors of each video, whose own numbers follow the shared ones from there; the best outcome is taken.
    agreed
        The shared numbers.
    """

    def followed(index: int) -> Float[np.ndarray, "_"]:
        video, found = videos[index], []
        for point in starts[index]:
            own = video.split(point)[1]
            one = follow(video, _shared_part(numbers, video, point), own, agreed)
            found.append(one.local if one.arrived else settle(video, agreed, [own, one.local]))
        values = video.log_density(np.tile(agreed, (len(found), 1)), np.array(found))
        return found[int(np.argmax(values))]

    return in_parallel(followed, range(len(videos)))


def consensus(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    points: Sequence[Float[np.ndarray, "_"]],
    trusted: Sequence[bool],
) -> Gaussian:
    """What the fits of some videos by themselves say together of the shared numbers.

    Parameters
    ----------
    numbers, videos
        What is fitted.
    points
        Vectors of each video at its own fit.
    trusted
        Whose fits are asked.
    """
    places = [_shared_part(numbers, video, point) for video, point in zip(videos, points, strict=True)]

    def expanded(index: int) -> Expansion:
        own = videos[index].split(points[index])[1]
        found = expand(videos[index], places[index], own, central=True)
        # A video's fit is taken at its word, that it is a maximum: the data pull against the prior.
        prior = expand_prior(numbers, places[index])
        return replace(found, shared_gradient=-prior.gradient, local_gradient=np.zeros_like(own))

    chosen = np.flatnonzero(trusted).tolist()
    expansions = Expansions(expand_prior(numbers, numbers.prior_mean), tuple(in_parallel(expanded, chosen)))
    asked = [places[index] for index in chosen]
    agreed = expansions.consensus(numbers.prior_mean, asked)
    return Gaussian(np.clip(agreed, np.min(asked, axis=0), np.max(asked, axis=0)), expansions.root)


def _shared_part(
    numbers: SharedNumbers, video: LinkedVideo, point: Float[np.ndarray, "dimension"]
) -> Float[np.ndarray, "shared"]:
    """Shared numbers of a video's vector; those without a place in it at their prior's mean."""
    shared = numbers.prior_mean.copy()
    shared[video.shared_columns] = video.split(point)[0]
    return shared
