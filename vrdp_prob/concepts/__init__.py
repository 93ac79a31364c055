"""Words that are learned from questions and answers."""
