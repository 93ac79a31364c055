"""Causes that explain the worst explained videos, each video searched by itself with every cause in turn.

Scores and refits begin at the fit without the cause. Where that has taken the wrong course of events there is nothing
near it to be found, and a search from the beginning is the only way.
"""

from collections.abc import Callable, Collection, Sequence
from functools import partial

from vrdp_prob.discovery.candidates.scores import happens_once
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.runs.parallel import in_processes
from vrdp_prob.inference.search.plan import IN_DOUBT
from vrdp_prob.inference.several_videos.fitting import SharedFit
from vrdp_prob.inference.several_videos.parts import fit_alone
from vrdp_prob.inference.several_videos.second_look import may_take_another_course
from vrdp_prob.models.effects.effect import Effect
from vrdp_prob.models.parameters import Scope
from vrdp_prob.models.physics import PhysicsModel

LOST = 1.2
"""Residuals in units of the noise from which a video may be lost."""
VIDEOS, WITH_ALL, SECOND_LOOKS = 4, 2, 4
"""Lost videos that are looked at, those of them that are searched with every cause, and causes, the best first, with
which the others are."""
NEARLY, MOST_TOLD = 0.6, 2
"""Share of the largest gain from which another cause is told of, too, and number of causes that are."""
FAR_BEHIND = 0.3
"""Share of the largest gain below which a cause is not tried in a further video."""
EXPLAINED = 1.1
"""Residuals in units of the noise from which a cause explains a video; no further ones are tried then."""
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


def lost_videos(fit: SharedFit) -> list[int]:
    """Videos that may have taken the wrong course of events, the worst first."""
    ratios = [part.misfit.ratio for part in fit.fits]
    order = sorted(range(len(ratios)), key=lambda index: -ratios[index])
    return [index for index in order if ratios[index] > LOST and may_take_another_course(fit.fits[index])]


def causes_of_lost_videos(
    fit: SharedFit,
    lost: Sequence[int],
    catalogue: Sequence[Effect],
    likely: Collection[str],
    needed: float,
    *,
    seed: int,
) -> list[tuple[Effect, float]]:
    """Causes with which lost videos are explained much better, the best first, and what is gained (nats).

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
    """
    telling = [effect for effect in catalogue if _tells(effect)]
    in_contacts = [effect for effect in telling if _acts_in_contacts(effect)]
    effects = in_contacts + [effect for effect in telling if effect.name in likely and effect not in in_contacts]
    if not effects:
        return []

    def searched(video: int) -> Callable[[PhysicsModel], MapFit]:
        return partial(fit_alone, fit.fits[video].clues.tracks, seed=seed, plan=IN_DOUBT)

    def tried(video: int, effects: Sequence[Effect]) -> list[tuple[Effect, MapFit]]:
        """Searches with causes, until one of them explains the video."""
        found: list[tuple[Effect, MapFit]] = []
        for first in range(0, len(effects), AT_ONCE):
            some = effects[first : first + AT_ONCE]
            models = [fit.extended(effect) for effect in some]
            fits = in_processes(searched(video), models)
            found += zip(some, fits, strict=True)
            if min(one.misfit.ratio for one in fits) < EXPLAINED:
                break
        return found

    gains: dict[str, float] = {}
    for rank, video in enumerate(lost[:VIDEOS]):
        before = searched(video)(fit.model).modes[0].log_density
        found = tried(video, effects)
        # Models are nested: a search that makes a video less probable has lost its own way.
        gained = {effect.name: max(one.modes[0].log_density - before, 0.0) for effect, one in found}
        gains = {name: gain + gains.get(name, 0.0) for name, gain in gained.items()}
        explained = len(found) < len(effects)
        effects = sorted((effect for effect, _ in found), key=lambda effect: -gains[effect.name])
        if explained or rank + 1 >= WITH_ALL:
            least = FAR_BEHIND * gains[effects[0].name]
            effects = [effect for effect in effects[:SECOND_LOOKS] if gains[effect.name] >= least]
        if len(effects) == 1:
            break
    ranked = [(effect, gains[effect.name]) for effect in effects if effect.name in gains]
    return [pair for pair in ranked if pair[1] > max(needed, NEARLY * ranked[0][1])][:MOST_TOLD]


def _tells(effect: Effect) -> bool:
    """Whether one video can say much about an effect, and about the course of its events."""
    of_materials = any(parameter.scope is Scope.MATERIAL for parameter in effect.parameters)
    vanishes = bool(effect.vanishes_at or effect.vanishes_like)
    return vanishes and not happens_once(effect) and not of_materials and not effect.overrides("frame_jitter")


def _acts_in_contacts(effect: Effect) -> bool:
    return any(effect.overrides(hook) for hook in CONTACT_HOOKS)
