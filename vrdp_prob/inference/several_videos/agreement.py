"""What videos that were fitted by themselves agree on, and their own numbers where the shared ones are that."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from vrdp_prob.inference.draws.samples import Gaussian
from vrdp_prob.inference.runs.parallel import in_parallel
from vrdp_prob.inference.search.yaw_search import tells_yaws_by_contacts
from vrdp_prob.inference.several_videos.arrow import Expansion, Expansions
from vrdp_prob.inference.several_videos.joint_fit import expand, expand_prior, follow_or_settle
from vrdp_prob.inference.several_videos.linking import LinkedVideo, SharedNumbers
from vrdp_prob.models.parameters import ANGULAR_DRAG


def first_guess(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    starts: Sequence[Float[np.ndarray, "_ _"]],
    trusted: Sequence[bool],
    *,
    islands: bool = False,
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
    islands
        See `consensus`.
    """
    agreed = consensus(numbers, videos, [points[0] for points in starts], trusted, islands=islands).mean
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
            found.append(follow_or_settle(video, _shared_part(numbers, video, point), own, agreed))
        values = video.log_density(np.tile(agreed, (len(found), 1)), np.array(found))
        return found[int(np.argmax(values))]

    return in_parallel(followed, range(len(videos)))


def consensus(
    numbers: SharedNumbers,
    videos: Sequence[LinkedVideo],
    points: Sequence[Float[np.ndarray, "_"]],
    trusted: Sequence[bool],
    *,
    islands: bool = False,
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
    islands
        Whether yaws of cubes that only contacts tell may be on wrong islands of the posterior. Each island has a decay
        of the spins of its own, which it knows very well; such a video then says no more of it than the prior does.
    """
    places = [_shared_part(numbers, video, point) for video, point in zip(videos, points, strict=True)]

    def expanded(index: int) -> Expansion:
        own = videos[index].split(points[index])[1]
        found = expand(videos[index], places[index], own)
        # A video's fit is taken at its word, that it is a maximum: the data pull against the prior.
        prior = expand_prior(numbers, places[index])
        believed = replace(found, shared_gradient=-prior.gradient, local_gradient=np.zeros_like(own))
        doubted = islands and tells_yaws_by_contacts(videos[index].likelihood, points[index])
        return _on_an_island(numbers, believed) if doubted else believed

    chosen = np.flatnonzero(trusted).tolist()
    expansions = Expansions(expand_prior(numbers, numbers.prior_mean), tuple(in_parallel(expanded, chosen)))
    asked = [places[index] for index in chosen]
    agreed = expansions.consensus(numbers.prior_mean, asked)
    return Gaussian(np.clip(agreed, np.min(asked, axis=0), np.max(asked, axis=0)), expansions.root)


def _on_an_island(numbers: SharedNumbers, found: Expansion) -> Expansion:
    """What a video says, of the decay of spins no more than the prior does."""
    factors = np.ones(len(numbers))
    for place, entry in enumerate(numbers.entries):
        if entry.field == ANGULAR_DRAG.name and (told := found.reduced[place, place]) > 0:
            factors[place] = min(1.0, 1 / (entry.prior.sd * np.sqrt(told)))
    return replace(found, shared=found.shared * factors)


def _shared_part(
    numbers: SharedNumbers, video: LinkedVideo, point: Float[np.ndarray, "dimension"]
) -> Float[np.ndarray, "shared"]:
    """Shared numbers of a video's vector; those without a place in it at their prior's mean."""
    shared = numbers.prior_mean.copy()
    shared[video.shared_columns] = video.split(point)[0]
    return shared
