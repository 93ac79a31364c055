"""What we believe about the world: simulator, effects, parameters, observation, likelihood."""
