"""Words for changes of physical parameters, learned as inference: which parameter, and how much."""

from vrdp_prob.concepts.physical.examples import Example
from vrdp_prob.concepts.physical.learn import learn_concept
from vrdp_prob.concepts.physical.learned_word import LearnedWord

__all__ = ["Example", "LearnedWord", "learn_concept"]
