"""Causes that explain the worst explained videos, each video searched by itself with every cause in turn.

Scores and refits begin at the fit without the cause. Where that has taken the wrong course of events there is nothing
near it to be found, and a search from the beginning is the only way.
"""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations
from typing import NamedTuple

from vrdp_prob.discovery.candidates.scores import happens_once
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.inference.search.plan import IN_DOUBT
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.parts import fit_alone
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.parameters import Scope

VIDEOS, WITH_ALL, SECOND_LOOKS = 4, 2, 4
"""Lost videos that are looked at, those of them that are searched with every cause, and causes, the best first, with
which the others are."""
NEARLY, MOST_TOLD = 0.6, 2
"""Share of the gain of the first from which another cause is told of, too, and number of causes that are."""
FAR_BEHIND = 0.3
"""Share of the gain of the first, which explains most, below which a cause is not tried in a further video."""
EXPLAINS = 1.1
"""Residuals in units of the noise up to which a cause explains a video; no further ones are tried then."""
CONTACT_HOOKS = (
    "tangential_impulse",
    "vertical_impulse",
    "contact_radius",
    "slip_friction",
    "restitution",
    "pair_force",
)
"""What an effect overrides that acts in contacts or on what follows from them."""
AT_ONCE = 4
"""Causes that are tried side by side."""

Causes = tuple[Effect, ...]
"""Causes that act together."""


def causes_of_lost_videos(
    fit: SharedFit,
    lost: Sequence[int],
    catalogue: Sequence[Effect],
    likely: Collection[str],
    needed: float,
    *,
    seed: int,
    must_explain: bool = False,
) -> list[tuple[Causes, float]]:
    """Causes with which lost videos are explained much better, the best first, and what is gained (nats).

    Those that explain most videos come first, and where any does, none is told of that explains no video: what gains
    much and explains nothing mends a wrong course of events. Where no single one explains any of the videos, two of
    those that act in contacts may do so together: neither need bring anything by itself then. Such a pair is told of
    alone.

    Parameters
    ----------
    fit
        Fit of the model without any of them.
    lost
        The videos, the worst first; the first few are looked at.
    catalogue
        The causes. Those that happen once, vanish nowhere or belong to materials are left out: one video says too
        little of them.
    likely
        Names of causes that the fit calls for; others are searched with only if they act in contacts, which make a
        search lose its way.
    needed
        Gain (nats) from which a cause is told of.
    seed
        Seed of the searches.
    must_explain
        Whether none is told of where none explains a video, as where no cause is looked for beyond these; then one that
        brings too little in some videos is not tried in a further one.
    """
    telling = [effect for effect in catalogue if _tells(effect)]
    in_contacts = [effect for effect in telling if _acts_in_contacts(effect)]
    effects = in_contacts + [effect for effect in telling if effect.name in likely and effect not in in_contacts]
    if not effects or not lost:
        return []

    searches = _Searches(fit, seed)
    gains: dict[str, float] = {}
    explained: Counter[str] = Counter()
    best_of_all = 0.0
    for rank, video in enumerate(lost[:VIDEOS]):
        found = searches.with_causes(video, [(effect,) for effect in effects])
        gains = {effect.name: one.gain + gains.get(effect.name, 0.0) for (effect,), one in found}
        explaining = [effect.name for (effect,), one in found if one.explains]
        explained.update(explaining)
        best_of_all = max(gains.values()) if rank < WITH_ALL else best_of_all
        tried = [effect for (effect,), _ in found]
        effects = sorted(tried, key=lambda effect: (-explained[effect.name], -gains[effect.name]))
        if explaining or rank + 1 >= WITH_ALL:
            least = FAR_BEHIND * gains[effects[0].name] if explained else 0.0
            effects = [effect for effect in effects[:SECOND_LOOKS] if gains[effect.name] >= least]
        if must_explain:
            effects = [effect for effect in effects if gains[effect.name] > needed]
        if len(effects) <= 1:
            break
    if must_explain and not explained:
        return []
    if not explained:
        pair = _together(searches, lost[:WITH_ALL], in_contacts)
        if pair is not None and pair[1] > best_of_all + needed:
            return [pair]
    told = [effect for effect in effects if explained[effect.name] or not explained]
    ranked: list[tuple[Causes, float]] = [((effect,), gains[effect.name]) for effect in told]
    return [pair for pair in ranked if pair[1] > max(needed, NEARLY * ranked[0][1])][:MOST_TOLD]


def _together(searches: "_Searches", lost: Sequence[int], effects: Sequence[Effect]) -> tuple[Causes, float] | None:
    """Two causes that together explain one of some videos, and what they gain (nats) in all; None where no two do.

    In the worst video a search may lose its way even with both.
    """
    cheap = [effect for effect in effects if not effect.overrides("pair_force")]
    pairs = list(combinations(cheap, 2))
    for video in lost:
        explaining = [(causes, one.gain) for causes, one in searches.with_causes(video, pairs) if one.explains]
        if explaining:
            best, gained = max(explaining, key=lambda pair: pair[1])
            others = [other for other in lost if other != video]
            return best, gained + sum(one.gain for other in others for _, one in searches.with_causes(other, [best]))
    return None


class _Found(NamedTuple):
    """What a search with further causes gains (nats) in a video, and whether it explains it."""

    gain: float
    explains: bool


@dataclass(frozen=True)
class _Searches:
    """Single videos of a fit searched from the beginning, with further causes in the model."""

    fit: SharedFit
    seed: int
    _before: dict[int, float] = field(default_factory=dict)

    def with_causes(self, video: int, candidates: Sequence[Causes]) -> list[tuple[Causes, _Found]]:
        """What searches with each of some causes find, until one of them explains the video.

        Models are nested: a search that makes a video less probable has lost its own way, and gains nothing.
        """
        search = partial(fit_alone, self.fit.fits[video].clues.tracks, seed=self.seed, plan=IN_DOUBT)
        found: list[tuple[Causes, _Found]] = []
        for first in range(0, len(candidates), AT_ONCE):
            some = candidates[first : first + AT_ONCE]
            plain = [] if video in self._before else [self.fit.model]
            fits = in_processes(search, [*plain, *(self.fit.extended(*causes) for causes in some)])
            if plain:
                self._before[video] = fits.pop(0).modes[0].log_density
            before = self._before[video]
            told = [_Found(max(one.modes[0].log_density - before, 0.0), one.misfit.ratio < EXPLAINS) for one in fits]
            found += zip(some, told, strict=True)
            if any(one.explains for one in told):
                break
        return found


def _tells(effect: Effect) -> bool:
    """Whether one video can say much about an effect, and about the course of its events."""
    of_materials = any(parameter.scope is Scope.MATERIAL for parameter in effect.parameters)
    vanishes = bool(effect.vanishes_at or effect.vanishes_like)
    return vanishes and not happens_once(effect) and not of_materials and not effect.overrides("frame_jitter")


def _acts_in_contacts(effect: Effect) -> bool:
    return any(effect.overrides(hook) for hook in CONTACT_HOOKS)
