"""How good the answers to a file of questions are: accuracy, proper scores, calibration, against a single best fit."""

from vrdp_prob.evaluation.compared_answers import with_answers
from vrdp_prob.evaluation.evaluate import Evaluation, evaluate
from vrdp_prob.evaluation.judgement import Judgement, Kind
from vrdp_prob.evaluation.scores import Scores

__all__ = ["Evaluation", "Judgement", "Kind", "Scores", "evaluate", "with_answers"]
