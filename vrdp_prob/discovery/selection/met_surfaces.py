"""Fits from the beginning with walls and discs that tracks show, all of them at once."""

from collections.abc import Sequence
from dataclasses import replace

from vrdp_prob.discovery.candidates.surfaces import Placed, as_stated
from vrdp_prob.discovery.selection.trials import FIRST, Trial
from vrdp_prob.errors import InputError
from vrdp_prob.inference.several_videos.climb_state import ImpossibleStartError
from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.inference.several_videos.learned import with_learned_walls
from vrdp_prob.inference.several_videos.second_look import FAR_WORSE, explained


def fit_with_surfaces(trial: Trial, placed: Sequence[Placed], stated: Sequence[Placed], *, seed: int) -> SharedFit:
    """Fit the base model with walls and discs where tracks show them.

    Those that are not stated are unknown from the beginning, near where they are shown. Those that are count as known
    until a fit is found, with positions less certain by how far off these walls may be: twelve numbers more for four
    walls make every search longer, and walls that are a little off explain no track. Where the fit nearly explains
    most videos, the lost ones are searched anew before anything is learned of bodies, of which they teach wrong things.

    Parameters
    ----------
    trial
        The model without them.
    placed
        Walls and discs.
    stated
        Walls among them that count as stated at first.
    seed
        Of the searches.

    Raises
    ------
    ImpossibleStartError
        If videos have no world in common, or a stated wall overlaps what is seen.
    """
    tracks = [part.clues.tracks for part in trial.fit.fits]
    try:
        told = [as_stated(one, stated) for one in tracks] if stated else tracks
    except InputError as error:
        raise ImpossibleStartError(str(error)) from error
    first = model = trial.with_stated_population(trial.fit.model)
    for one in placed:
        model = model.with_effect(one.effect, tracks)
        if one not in stated:
            first = first.with_effect(one.effect, tracks)
            first = replace(first, beliefs={**first.beliefs, **one.near})
    fit = fit_together(told, model=first, shared=trial.fit.shared, seed=seed, model_error=False)
    start: dict[str, float] = {}
    learned = with_learned_walls(fit, told[0]).walls[len(tracks[0].walls) :]
    for one, wall in zip(stated, learned, strict=True):
        start |= one.start
        start |= {} if wall.restitution is None else {one.effect.parameters[-1].name: wall.restitution}
    freed = fit.of_tracks(tracks).under(model, start=start, effort=FIRST, model_error=False)
    return freed.with_lost_courses(seed=seed) if explained(freed.fits, FAR_WORSE) else freed
