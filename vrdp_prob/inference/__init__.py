"""How we learn: MAP, Laplace draws, emcee, NUTS, identifiability, the posterior."""

from vrdp_prob.inference.draws.samples import Convergence
from vrdp_prob.inference.draws.summaries import ObjectSummary, PairSummary, ParameterSummary, Summary
from vrdp_prob.inference.identifiability.status import BodyStatus, ParameterStatus, Status
from vrdp_prob.inference.identified import Identified, identified
from vrdp_prob.inference.infer import OPTIONS, SAMPLERS, check_options, default_model, infer
from vrdp_prob.inference.map_fit import MapFit, fit_map
from vrdp_prob.inference.posterior import Posterior
from vrdp_prob.inference.search.plan import ALL_AT_ONCE, CURRICULUM, FREE_FIRST, GROWING, FitPlan, Optimiser
from vrdp_prob.inference.several_videos import (
    PredictiveDensity,
    SharedFit,
    SharedPosterior,
    fit_together,
    infer_together,
    predictive_log_density,
    sample_together,
)

__all__ = [
    "ALL_AT_ONCE",
    "CURRICULUM",
    "FREE_FIRST",
    "GROWING",
    "OPTIONS",
    "SAMPLERS",
    "BodyStatus",
    "Convergence",
    "FitPlan",
    "Identified",
    "MapFit",
    "ObjectSummary",
    "Optimiser",
    "PairSummary",
    "ParameterStatus",
    "ParameterSummary",
    "Posterior",
    "PredictiveDensity",
    "SharedFit",
    "SharedPosterior",
    "Status",
    "Summary",
    "check_options",
    "default_model",
    "fit_map",
    "fit_together",
    "identified",
    "infer",
    "infer_together",
    "predictive_log_density",
    "sample_together",
]
