"""What discovery refuses before any work."""

from collections.abc import Collection
from pathlib import Path

from vrdp_prob.errors import InputError, check_whole_number

FEWEST_VIDEOS = 3
"""Videos without which a gain has no uncertainty: each is predicted from the others, and the spread is over videos."""


def check_video_count(videos: Collection[object], *, source: Path | str = "discovery") -> None:
    """Refuse too few videos.

    Parameters
    ----------
    videos
        The videos, or their names.
    source
        Where they come from, for the message.

    Raises
    ------
    InputError
        If there are fewer than three.
    """
    count = len(videos)
    if count < FEWEST_VIDEOS:
        there_are = "is 1 video" if count == 1 else f"are {count} videos"
        raise InputError(
            f"{source}: there {there_are}; what a cause is worth is measured by leaving out whole videos, so give at "
            f"least {FEWEST_VIDEOS} of the same table."
        )


def check_searched(searched: int | None, *, source: str = "searched") -> None:
    """Refuse to look for causes in too few videos.

    Parameters
    ----------
    searched
        The number of videos; all where None.
    source
        What it was given as, for the message.

    Raises
    ------
    InputError
        If it is no whole number, or less than three.
    """
    if searched is not None:
        check_whole_number(source, searched, least=FEWEST_VIDEOS)
