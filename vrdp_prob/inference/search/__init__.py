"""The way to the most probable values: clues in the tracks, starts, optimisers, courses of events, modes."""
