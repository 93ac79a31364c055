"""The models that a search hands out, with what the videos say of their numbers."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from vrdp_prob.discovery.estimates import widened
from vrdp_prob.discovery.scores import happens_once
from vrdp_prob.discovery.trials import Trial
from vrdp_prob.inference.several_videos.learned import believing
from vrdp_prob.inference.several_videos.population import with_learned_population
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
    return _believing(_of_the_table(trial), trial, gaussian.mean, gaussian.sd, overdispersion)


def models_of_the_others(
    given: Trial, extended: Trial, overdispersion: Float[np.ndarray, "video"]
) -> Mapping[str, tuple[PhysicsModel, PhysicsModel]]:
    """For each video, by name: two models, believing what all other videos say.

    With what a video itself says in its prior as well, that would count twice.

    Parameters
    ----------
    given, extended
        The models, fitted to all videos.
    overdispersion
        As in `extended_model`.
    """
    without, with_causes = (
        {
            video: _believing(model, trial, cavity.mean, np.sqrt(np.diag(cavity.covariance)), overdispersion)
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


def _believing(
    model: PhysicsModel,
    trial: Trial,
    mean: Float[np.ndarray, "shared"],
    sd: Float[np.ndarray, "shared"],
    overdispersion: Float[np.ndarray, "video"],
) -> PhysicsModel:
    wide = widened(sd, overdispersion, trial.unexplained)
    return believing(model, trial.fit.joint.numbers.keys, mean, wide)
