"""A posterior out of a fit and its draws: what can be told from the data, what limits it, and every draw by name."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import torch
import xarray as xr
from jaxtyping import Float

from vrdp_prob.inference.draws.samples import Convergence, Samples
from vrdp_prob.inference.identifiability.status import BodyStatus, Status
from vrdp_prob.inference.identified import identified
from vrdp_prob.inference.map_fit import MapFit
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.inference.search.events import collision_sequences
from vrdp_prob.inference.search.free_flight import SPAN
from vrdp_prob.inference.tree import posterior_tree
from vrdp_prob.models.parameters import MASS, RESTITUTION
from vrdp_prob.models.roughness import untold_noise
from vrdp_prob.models.unknowns import mass_prior, prior_restitutions
from vrdp_prob.scene import Tracks
from vrdp_prob.scene.tracks import ORIGIN

FEWEST_FRAMES = 5
"""Frames below which a video hardly shows a motion."""
FRAMES_IN_SPAN = 3
"""Frames in the span by which contacts are told, below which that is said."""
FASTEST = 100.0
"""Speed in m/s that nothing on a table has: positions are in other units."""
BATCH = 500
"""Worlds simulated at once when the draws are looked at again."""
ALONE = ("never collides in view", "never collide in view")
LATE = ("collides too late or too weakly to tell", "collide too late or too weakly to tell")
BOUNCED = ("tells something only where it meets walls", "tell something only where they meet walls")
"""Why the tracks do not tell, of one object and of several."""


def posterior_from(
    fit: MapFit,
    samples: Samples,
    convergence: Convergence,
    *,
    seed: int,
    generator: np.random.Generator,
    draw_defaults: bool = False,
) -> Posterior:
    """The posterior that draws of a fit make.

    Parameters
    ----------
    fit
        The most probable values and the density around them.
    samples
        The draws to keep.
    convergence
        Whether all draws can be trusted.
    seed
        Seed that is noted in the posterior.
    generator
        Draws the prior and the noise of predicted measurements.
    draw_defaults
        Whether masses and restitutions that the data say nothing about are drawn from their prior, in place of
        keeping default values.
    """
    tracks = fit.likelihood.tracks
    told = identified(fit)
    status = told.status
    changed = _changed_order(fit, samples.points)
    convergence = replace(convergence, collision_order_changes=float(changed.mean()))
    names = [body.id for body in tracks.bodies]
    tree = posterior_tree(fit, samples, changed, generator)
    if draw_defaults:
        tree["posterior"] = xr.DataTree(_with_drawn_defaults(tree["posterior"].to_dataset(), fit, status, generator))
    return Posterior(
        tracks=tracks,
        model=fit.likelihood.model,
        seed=seed,
        data=tree,
        status=status,
        convergence=convergence,
        warnings=tuple(_warnings(fit, convergence, status, drawn=draw_defaults)),
        pairs=tuple((names[i], names[j]) for i, j in fit.contacts),
        groups=told.groups,
        misfit=fit.misfit,
    )


def _with_drawn_defaults(
    draws: xr.Dataset, fit: MapFit, status: dict[str, BodyStatus], generator: np.random.Generator
) -> xr.Dataset:
    """Draws in which what the data say nothing about follows its prior."""
    tracks, model = fit.likelihood.tracks, fit.likelihood.model
    drawn, shape = draws.copy(deep=True), (draws.sizes["chain"], draws.sizes["draw"])
    for index, body in enumerate(tracks.bodies):
        if status[body.id].mass.status is Status.DEFAULT:
            drawn[MASS.name].values[..., index] = np.exp(mass_prior(tracks, model).sample(generator, shape))
        if status[body.id].restitution.status is Status.DEFAULT:
            drawn[RESTITUTION.name].values[..., index] = prior_restitutions(model, shape, generator)
    return drawn


def _changed_order(fit: MapFit, points: Float[np.ndarray, "chain draw dimension"]) -> Float[np.ndarray, "chain draw"]:
    """1 for a draw in which other pairs collide, or in another order, than in the MAP; else 0."""
    flat = torch.from_numpy(np.ascontiguousarray(points.reshape(-1, points.shape[-1])))
    changed: list[bool] = []
    with torch.no_grad():
        for begin in range(0, len(flat), BATCH):
            rollout = fit.likelihood.rollout(flat[begin : begin + BATCH])
            changed += [sequence != fit.contacts for sequence in collision_sequences(rollout)]
    return np.array(changed, dtype=float).reshape(points.shape[:2])


def _warnings(fit: MapFit, convergence: Convergence, status: dict[str, BodyStatus], *, drawn: bool) -> list[str]:
    """What limits the result, the model's misfit first."""
    names = [body.id for body in fit.likelihood.tracks.bodies]
    sentences = list(fit.misfit.sentences)
    if not fit.converged:
        sentences.append("The search for the most probable values ended before it had converged.")
    if fit.search.sentence:
        sentences.append(fit.search.sentence)
    sentences += limits_of_tracks(fit.likelihood.tracks).values()
    found = {frozenset(pair) for pair in fit.contacts}
    seen = {(contact.first, contact.second) for contact in fit.clues.contacts}
    missed = {pair for pair in seen if frozenset(pair) not in found}
    for first, second in sorted(missed):
        sentences.append(
            f"The tracks look as if objects {names[first]} and {names[second]} collided, but the best fit does without."
        )
    if at_rest := [names[body] for body in sorted(fit.believed_at_rest)]:
        sentences.append(
            _named(at_rest, "was hit", "were hit") + " too soon to show motion: taken to have been at rest."
        )
    sentences += convergence.notes if convergence.converged else (convergence.sentence,)
    return [*sentences, *_untold(fit, status, drawn=drawn)]


def limits_of_tracks(tracks: Tracks) -> dict[str, str]:
    """What limits any result from some tracks: sentences, by what they are about."""
    limits = {}
    if ORIGIN in tracks.data.attrs:
        limits["times"] = "Times are counted from the first frame, since they began long after their zero."
    if len(tracks.times) < FEWEST_FRAMES:
        limits["length"] = (
            f"The video has {len(tracks.times)} frames: next to everything rests on what was believed beforehand."
        )
    if FRAMES_IN_SPAN * (step := float(np.median(np.diff(tracks.times)))) > SPAN:
        limits["frames"] = (
            f"Frames are {step:.3g} s apart, and contacts are told by what is seen within {SPAN:g} s of them: see "
            "whether times are in s."
        )
    if (speed := _fastest(tracks)) > FASTEST:
        limits["speed"] = f"Objects move at {speed:.3g} m/s: see whether positions are in m and times in s."
    if (noise := untold_noise(tracks)) is not None:
        limits["noise"] = (
            f"The positions do not tell their noise (they are computed, rounded, or all on a line): {noise:.2g} m is "
            "taken."
        )
    if unsized := [body.id for body in tracks.bodies if body.radius is None]:
        subject = _named(unsized, "has", "have")
        limits["radius"] = (
            f"{subject} no radius and so cannot meet anything: state radii, and collisions are looked for."
        )
    return limits


def _named(objects: Sequence[str], one_does: str, several_do: str) -> str:
    """The beginning of a sentence about some objects."""
    return f"Object {objects[0]} {one_does}" if len(objects) == 1 else f"Objects {', '.join(objects)} {several_do}"


def _fastest(tracks: Tracks) -> float:
    """Median speed (m/s) of the fastest body between frames in which it was seen."""
    seen, times, positions = tracks.seen, tracks.times, tracks.positions
    speeds = [
        np.linalg.norm(np.diff(positions[there, body], axis=0), axis=1) / np.diff(times[there])
        for body, there in enumerate(seen.T)
    ]
    return max(float(np.median(one)) for one in speeds)


def _untold(fit: MapFit, status: dict[str, BodyStatus], *, drawn: bool) -> Iterator[str]:
    """What the tracks say nothing about, why, and what stands in for it."""
    names = [body.id for body in fit.likelihood.tracks.bodies]
    met = {names[body] for pair in fit.contacts for body in pair}
    unknowns = fit.likelihood.coordinates.places
    groups: dict[tuple[tuple[str, str], str], list[str]] = {}
    for index, (name, one) in enumerate(status.items()):
        untold = {
            key: drawn or (key, index) in unknowns
            for key, parameter in ((MASS.name, one.mass), (RESTITUTION.name, one.restitution))
            if parameter.status is Status.DEFAULT
        }
        if untold:
            why = LATE if name in met else BOUNCED if RESTITUTION.name not in untold else ALONE
            groups.setdefault((why, _stand_in(untold)), []).append(name)
    for ((one_does, several_do), values), group in groups.items():
        yield f"{_named(group, one_does, several_do)}: {values}, not measured."


def _stand_in(untold: Mapping[str, bool]) -> str:
    """What stands in for parameters, by whether they are drawn."""
    if len(untold) > 1 and len(set(untold.values())) == 1:
        return f"{' and '.join(untold)} are {'drawn from the prior' if all(untold.values()) else 'default values'}"
    return " and ".join(
        f"{name} is {'drawn from the prior' if drawn else 'a default value'}" for name, drawn in untold.items()
    )
