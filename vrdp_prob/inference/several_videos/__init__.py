"""Several videos at once: shared parameters, and motion, masses and restitutions of each video."""

from vrdp_prob.inference.several_videos.fitting import SharedFit, fit_together
from vrdp_prob.inference.several_videos.held_out import PredictiveDensity, predictive_log_density
from vrdp_prob.inference.several_videos.learned import learned_model, with_learned_walls
from vrdp_prob.inference.several_videos.posterior import SharedPosterior
from vrdp_prob.inference.several_videos.together import infer_together, sample_together

__all__ = [
    "PredictiveDensity",
    "SharedFit",
    "SharedPosterior",
    "fit_together",
    "infer_together",
    "learned_model",
    "predictive_log_density",
    "sample_together",
    "with_learned_walls",
]
