"""Which causes are worth a refit, by their scores."""

from collections.abc import Sequence

from vrdp_prob.discovery.candidates.scores import CauseScore, happens_once

SHORTLIST_LEVEL = 0.01
"""Causes whose score chance makes as large more often are not refitted."""
CLOSE = 0.5
"""Share of the largest statistic (see `shortlist`) below which a cause is refitted only if those above it leave
something."""
HOPEFUL = 0.2
"""Share of the largest statistic (see `shortlist`) below which a cause cannot be the best one, nor a rival of it."""
TRIFLE = 0.05
"""Share of any statistic, also of what happens once in a video, below which nothing is refitted."""
MOST_REFITTED, ALIKE = 5, 0.95
"""Causes that are refitted at most, but for those whose statistic is this share of that of the last one at least."""


def shortlist(scores: Sequence[CauseScore], share: float = HOPEFUL) -> list[CauseScore]:
    """Causes whose statistic is more than a share of the largest one, that of lasting causes for those that last.

    What happens once mends the course of a lost video better than any law does from where the fit is; so it is no good
    measure of laws, as long as these are no mere trifle beside it.
    """
    largest = max((one.size for one in scores), default=0.0)
    likely = [one for one in scores if one.p_value < SHORTLIST_LEVEL and one.size > TRIFLE * largest]
    likely.sort(key=lambda one: -one.size)
    laws = lasting(likely)
    compared = [(one, laws if one in laws else likely) for one in likely]
    chosen = [one for one, others in compared if one.size > share * others[0].size]
    least = ALIKE * chosen[MOST_REFITTED - 1].size if len(chosen) > MOST_REFITTED else 0.0
    return [one for one in chosen if one.size >= least]


def lasting(scores: Sequence[CauseScore]) -> list[CauseScore]:
    """Those of causes that last."""
    return [one for one in scores if not happens_once(one.effect)]
