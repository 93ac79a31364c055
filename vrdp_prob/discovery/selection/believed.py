"""The models that a search hands out, with what the videos say of their numbers."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.candidates.scores import happens_once
from vrdp_prob.discovery.selection.estimates import widened
from vrdp_prob.discovery.selection.reach import reaches
from vrdp_prob.discovery.selection.trials import Trial
from vrdp_prob.inference.several_videos.beliefs import believing
from vrdp_prob.inference.several_videos.population import shared_sd, with_learned_population
from vrdp_prob.models.physics import PhysicsModel


def extended_model(trial: Trial, overdispersion: Float[np.ndarray, "video"]) -> PhysicsModel:
    """The model of a trial for further videos of the same table.

    It believes what all videos say of what they share, as widely as estimates are told. What happened once in a video
    is no part of it: that is over.

    Parameters
    ----------
    trial
        The model, fitted to all videos.
    overdispersion
        Factor of each video by which variances are larger than what the likelihood says.
    """
    gaussian = trial.fit.joint.gaussian
    mean, wide = gaussian.mean.copy(), widened(shared_sd(trial.fit), overdispersion, trial.unexplained)
    of_causes = {parameter.name for cause in trial.causes for parameter in cause.parameters}
    for place, far in reaches(trial.fit, of_causes, wide).items():
        mean[place], sd = far.moments(np.asarray)
        wide[place] = max(sd, wide[place])
    return believing(_of_the_table(trial), trial.fit.joint.numbers.keys, mean, wide)


def models_of_the_others(
    given: Trial, extended: Trial, overdispersion: Float[np.ndarray, "video"]
) -> Mapping[str, tuple[PhysicsModel, PhysicsModel]]:
    """For each video, by name: two models, believing what all other videos say.

    With what a video itself says of shared numbers in its prior as well, that would count twice. What is believed of
    bodies is what all videos say: one of many says little of what they are like as a rule.

    Parameters
    ----------
    given, extended
        The models, fitted to all videos.
    overdispersion
        As in `extended_model`.
    """
    without, with_causes = (
        {
            video: believing(
                model,
                trial.fit.joint.numbers.keys,
                cavity.mean,
                widened(np.sqrt(np.diag(cavity.covariance)), overdispersion, trial.unexplained),
            )
            for video, cavity in trial.cavities.items()
        }
        for trial, model in ((trial, _of_the_table(trial)) for trial in (given, extended))
    )
    return {video: (model, with_causes[video]) for video, model in without.items()}


def _of_the_table(trial: Trial) -> PhysicsModel:
    """The model of a trial without what happened once, believing of bodies what all videos say."""
    model = with_learned_population(trial.fit)
    for cause in trial.causes:
        if happens_once(cause):
            model = model.without_effect(cause)
    return model
