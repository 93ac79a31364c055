"""Questions answered by marginalising over posterior rollouts."""
