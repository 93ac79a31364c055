"""Where two bodies may have met, long enough ago to see what followed, and whether that may be explained otherwise."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float

from vrdp_prob.inference.search.alternatives import Encounter
from vrdp_prob.inference.search.clues import Clues
from vrdp_prob.inference.search.free_flight import Approach
from vrdp_prob.inference.search.hypothesis import Hypothesis, yaw_places
from vrdp_prob.models.likelihood import Likelihood
from vrdp_prob.models.simulator.events import RolloutEventKind

SETTLED = 0.4
"""Time (s) after a contact at which other explanations of it are tried."""
SUSPICIOUS = 2.0
"""The motion of a body needs another explanation if its squared residuals exceed their number by so many sd."""
LOOK = 2 * SETTLED
"""Time (s) over which they are added up."""
LATEST = 3 * SETTLED
"""Time (s) after which a motion that is not explained is no longer put down to an approach."""
CROWDED = 4
"""So many contacts of one body in the time after which explanations are tried make any explanation doubtful..."""
MANY_PARTNERS = 3
"""...and so do so many partners of one body, since an error at the first contact spoils what is found at the others."""
UNSEEN = 2
"""Frames before an approach from which on the velocities before it are known."""
MOST_TRIED = 2
"""Times that an approach is looked at."""

Contact = tuple[float, int, int]
"""Time (s) and the two bodies."""


class EncounterFinder:
    """Remembers which approaches of a video were looked at.

    Parameters
    ----------
    likelihood
        The density that is fitted.
    clues
        What shows in the tracks.
    """

    def __init__(self, likelihood: Likelihood, clues: Clues) -> None:
        self._likelihood, self._clues = likelihood, clues
        self._approaches = list(clues.approaches)
        self._tried: dict[Approach, int] = {}
        self._turned: set[int] = set()

    def due(self, hypothesis: Hypothesis, frame_count: int) -> list[Encounter]:
        """Encounters that are old enough to be looked at: where a yaw is open, or what followed is not explained."""
        times = self._likelihood.tracks.times
        now = float(times[frame_count - 1])
        latest = now - SETTLED if frame_count < len(times) else now
        contacts = contacts_in(self._likelihood, hypothesis, frame_count)
        self._note(contacts)
        ready = [one for one in self._approaches if one.time <= latest and self._tried.get(one, 0) < MOST_TRIED]
        if not ready:
            return []
        suspects = _suspects(self._likelihood, hypothesis, frame_count)
        met = {(i, j) for _, i, j in contacts} | {(seen.first, seen.second) for seen in self._clues.contacts}
        chosen, puzzling = [], set()
        for one in ready:
            pair, fresh = (one.first, one.second), one not in self._tried
            open_yaw = pair in met and any(place not in self._turned for place in yaw_places(self._likelihood, pair))
            odd = bool(suspects & set(pair)) and now - one.time < LATEST
            if fresh or odd:
                chosen.append(one)
            if (fresh and open_yaw) or odd:
                puzzling.add(one)
        for one in chosen:
            self._tried[one] = self._tried.get(one, 0) + 1
        for one in puzzling:
            self._turned.update(yaw_places(self._likelihood, (one.first, one.second)))
        groups = _groups(chosen)
        return [self._encounter(group, contacts, puzzling=bool(puzzling & set(group))) for group in groups]

    def _note(self, contacts: Sequence[Contact]) -> None:
        """Remember contacts at which tracks show no approach: past a corner of a cube a body may come nearer still."""
        for time, *pair in contacts:
            first, second = sorted(pair)
            known = (one for one in self._approaches if (one.first, one.second) == (first, second))
            if all(abs(one.time - time) > SETTLED for one in known):
                self._approaches.append(Approach(first, second, time))

    def _encounter(self, group: Sequence[Approach], contacts: Sequence[Contact], *, puzzling: bool) -> Encounter:
        bodies = frozenset(body for one in group for body in (one.first, one.second))
        pairs = {(one.first, one.second) for one in group}
        begin = min(one.time for one in group)
        seen = tuple(
            contact
            for contact in self._clues.contacts
            if (contact.first, contact.second) in pairs and contact.time >= begin - SETTLED / 2
        )
        first: dict[int, float] = {}
        for time, i, j in contacts:
            for body in {i, j} & bodies:
                if time < begin - SETTLED / 2:
                    first.setdefault(body, time)
        return Encounter(bodies, tuple(group), seen, first, puzzling, self._at_release(pairs, begin))

    def _at_release(self, pairs: set[tuple[int, int]], begin: float) -> tuple[tuple[int, int], ...]:
        """Pairs that meet so soon that hardly a frame shows how they came; the nearest frame may come after that."""
        tracks = self._clues.clean
        seen = [int((tracks.seen[:, [*pair]].all(axis=1) & (tracks.times < begin)).sum()) for pair in sorted(pairs)]
        return tuple(pair for pair, frames in zip(sorted(pairs), seen, strict=True) if frames <= UNSEEN)


def hard_to_explain(contacts: Sequence[Contact], first_seen: Float[np.ndarray, "body"]) -> bool:
    """Whether contacts are of a kind whose explanation easily goes astray.

    A body has many contacts in quick succession, or many partners, or meets another one so soon after it was first seen
    that its velocity before the contact is hardly known.

    Parameters
    ----------
    contacts
        All contacts, in order.
    first_seen
        Time (s) at which each body is first seen.
    """
    for body in {one for contact in contacts for one in contact[1:]}:
        own = [contact for contact in contacts if body in contact[1:]]
        times = np.array([time for time, *_ in own])
        crowded = (times[CROWDED - 1 :] - times[: len(times) - CROWDED + 1] < SETTLED).any()
        many = len({contact[1:] for contact in own}) >= MANY_PARTNERS
        if crowded or many or times[0] - first_seen[body] < SETTLED:
            return True
    return False


def contacts_in(likelihood: Likelihood, hypothesis: Hypothesis, frame_count: int) -> list[Contact]:
    """Contacts of bodies in an explanation, in order."""
    with torch.no_grad():
        rollout = likelihood.rollout(torch.from_numpy(hypothesis.point[None]), frame_count)
    events = rollout.events.of_kind(RolloutEventKind.COLLISION)
    return sorted(zip(events.time.tolist(), events.first.tolist(), events.second.tolist(), strict=True))


def _suspects(likelihood: Likelihood, hypothesis: Hypothesis, frame_count: int) -> set[int]:
    """Bodies whose latest motion is not explained."""
    residuals = likelihood.residuals(hypothesis.point[None], frame_count)[0]
    observations, times = likelihood.observations.until(frame_count), likelihood.tracks.times
    squares = (residuals[: 2 * len(observations.frame)].reshape(-1, 2) ** 2).sum(axis=1)
    late = times[observations.frame] > times[frame_count - 1] - LOOK
    suspects = set()
    for body in range(len(likelihood.tracks.bodies)):
        chosen = squares[late & (observations.body == body)]
        freedom = 2 * len(chosen)
        if freedom and not chosen.sum() < freedom + SUSPICIOUS * np.sqrt(2 * freedom):
            suspects.add(body)
    return suspects


def _groups(approaches: Sequence[Approach]) -> list[list[Approach]]:
    """Approaches that share bodies together."""
    groups: list[list[Approach]] = []
    for one in approaches:
        touching = [group for group in groups if any({one.first, one.second} & {o.first, o.second} for o in group)]
        merged = [one, *(other for group in touching for other in group)]
        groups = [*(group for group in groups if group not in touching), merged]
    return groups
