"""Questions answered by marginalising over posterior rollouts."""

from vrdp_prob.reasoning.answer import Answer, ChoiceAnswer
from vrdp_prob.reasoning.ask import AskablePosterior, ask, infer
from vrdp_prob.reasoning.changes import Change
from vrdp_prob.reasoning.explanation.explanation import Explanation
from vrdp_prob.reasoning.worlds import PosteriorWorlds

__all__ = ["Answer", "AskablePosterior", "Change", "ChoiceAnswer", "Explanation", "PosteriorWorlds", "ask", "infer"]
